"""Davenport's q-method with a Newton finish on the vectors: exact for weight ratios up to 1e16."""

from dataclasses import dataclass

from optsat.attitude.alignment import polish, starting_weights
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion
from optsat.forms import AlignmentForm, Point, required
from optsat.solvers.alignment_point import alignment_point


@dataclass(frozen=True)
class Davenport:
    """Top eigenvector of K, refined by Newton steps in the basis of the heaviest vector.

    No assumption on lengths or on the largest eigenvalue. Source: Davenport (1968); heavy weights: attitude problem
    depot, section 4.
    """

    name: str = "davenport"

    def accepts(self, form: object) -> bool:
        """Return whether the form is an alignment of vectors."""
        return isinstance(form, AlignmentForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return q_BN of the least weighted loss."""
        form = required(form, AlignmentForm, self.name)
        mild = starting_weights(form.weights)
        q_BN = dominant_quaternion(davenport_matrix(form.b_B, form.r_N, mild))
        return alignment_point(form, *polish(form.b_B, form.r_N, form.weights, q_BN))
