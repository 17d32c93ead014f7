"""Two-vector solvers in closed form: the Wahba optimum, and TRIAD with its primary vector matched exactly."""

from dataclasses import dataclass

import numpy as np

from optsat.attitude.davenport import quaternion_from_dcm
from optsat.attitude.two_vector import collinear, wahba_dcm
from optsat.errors import InputError
from optsat.forms import AlignmentForm, Point, required
from optsat.solution import Termination


def _two_directions(form: object) -> bool:
    return isinstance(form, AlignmentForm) and len(form.b_B) == 2 and not collinear(form.b_B, form.r_N)


@dataclass(frozen=True)
class TwoVector:
    """Closed-form Wahba optimum of two non-collinear pairs with any weights. Source: Markley (2002)."""

    name: str = "two_vector"

    def accepts(self, form: object) -> bool:
        """Return whether the form has exactly two non-collinear pairs."""
        return _two_directions(form)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return q_BN of the least weighted loss."""
        form = required(form, AlignmentForm, self.name)
        rotation = wahba_dcm(form.b_B, form.r_N, form.weights)
        return Point(x=quaternion_from_dcm(rotation), dual=np.zeros(0), termination=Termination.CONVERGED)


@dataclass(frozen=True)
class Triad:
    """TRIAD: the primary pair is matched exactly, the other fixes the rotation about it; weights play no part.

    primary : index of the pair that is trusted, None for the heavier one
    Source: Black (1964). It is the Wahba optimum only where the data agree or the primary weight dominates.
    """

    primary: int | None = None
    name: str = "triad"

    def __post_init__(self) -> None:
        if self.primary not in (None, 0, 1):
            raise InputError(f"`primary` must be 0, 1 or None, got {self.primary!r}.")

    def accepts(self, form: object) -> bool:
        """Return whether the form has exactly two non-collinear pairs."""
        return _two_directions(form)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return q_BN that maps the primary reference direction onto its measurement."""
        form = required(form, AlignmentForm, self.name)
        primary = int(np.argmax(form.weights)) if self.primary is None else self.primary
        weights = np.zeros(2)
        weights[primary] = 1.0
        rotation = wahba_dcm(form.b_B, form.r_N, weights)
        return Point(x=quaternion_from_dcm(rotation), dual=np.zeros(0), termination=Termination.CONVERGED)
