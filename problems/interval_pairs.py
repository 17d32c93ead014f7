"""Interval pairs: measured and reference directions in component boxes, and Davenport's matrix split over them."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, pair_weights
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion, quaternion_from_dcm
from optsat.attitude.two_vector import collinear, wahba_dcm
from optsat.errors import InputError, explain_unknown_fields
from optsat.problems.component_box import ComponentBox


@dataclass(frozen=True)
class LossParts:
    """Wahba's loss of directions inside their boxes, L = mid + change.

    mid : L_m = 1 - q^T K_m q of the middles; change : -q^T (K_Db + K_Dr + K_DbDr) q. Their sum is Wahba's loss only
    where the directions have length 1.
    """

    mid: Array
    change: Array


@explain_unknown_fields
@dataclass(frozen=True)
class IntervalPairs:
    """Directions b_i = b_i^m + alpha_i * b_i^r in B and r_i = r_i^m + beta_i * r_i^r in N, components of alpha, beta in
    [-1, 1].

    b_B, r_N : ComponentBox of m rows, whose middle and radius are b^m, b^r and r^m, r^r
    weights : (m,) >= 0, any scale, equal when None
    Source: interval-robust Wahba paper, eqs. (3) to (7), with its shape matrices G = H = I (independent components).

    Raises
    ------
    InputError : no box, counts differ, weights that cannot be used; the message names the argument.
    """

    b_B: ComponentBox
    r_N: ComponentBox
    weights: ArrayLike | None = None
    b_mid: Array = field(init=False, repr=False)
    b_radius: Array = field(init=False, repr=False)
    r_mid: Array = field(init=False, repr=False)
    r_radius: Array = field(init=False, repr=False)
    share: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        for name in ("b_B", "r_N"):
            if not isinstance(getattr(self, name), ComponentBox):
                raise InputError(
                    f"`{name}` must be a ComponentBox, got {type(getattr(self, name)).__name__}; use "
                    "ComponentBox.from_half_width(directions, half_width) or ComponentBox.from_relative."
                )
        if len(self.b_B) != len(self.r_N) or len(self.b_B) == 0:
            raise InputError(
                f"`b_B` and `r_N` must hold the same number of boxes, at least one, got {len(self.b_B)} and "
                f"{len(self.r_N)}."
            )
        for name, box in (("b", self.b_B), ("r", self.r_N)):
            object.__setattr__(self, f"{name}_mid", box.midpoint)
            object.__setattr__(self, f"{name}_radius", box.radius)
        object.__setattr__(self, "share", pair_weights("weights", self.weights, len(self.b_B)))

    def __len__(self) -> int:
        return len(self.b_mid)

    def directions(self, alpha: Array, beta: Array) -> tuple[Array, Array]:
        """Return b_B and r_N (..., m, 3) at the interval parameters alpha, beta (..., m, 3) or broadcast to it."""
        return self.b_mid + alpha * self.b_radius, self.r_mid + beta * self.r_radius

    def matrices(self, alpha: Array, beta: Array) -> tuple[Array, Array, Array, Array]:
        """Return K_m (4, 4) and K_Db, K_Dr, K_DbDr (..., 4, 4), whose sum is K of the directions."""
        db, dr = alpha * self.b_radius, beta * self.r_radius
        return (
            davenport_matrix(self.b_mid, self.r_mid, self.share),
            davenport_matrix(db, np.broadcast_to(self.r_mid, db.shape), self.share),
            davenport_matrix(np.broadcast_to(self.b_mid, dr.shape), dr, self.share),
            davenport_matrix(db, dr, self.share),
        )

    def losses(self, q_BN: Array, alpha: Array, beta: Array) -> LossParts:
        """Return L_m and the change of the loss (...) at unit q_BN (..., 4)."""
        K_m, *rest = self.matrices(alpha, beta)
        mid = 1.0 - np.einsum("...i,...ij,...j->...", q_BN, K_m, q_BN)
        change = -np.einsum("...i,...ij,...j->...", q_BN, np.sum(rest, axis=0), q_BN)
        return LossParts(mid, change)

    def mid_matrix(self) -> Array:
        """Return K_m (4, 4)."""
        return davenport_matrix(self.b_mid, self.r_mid, self.share)

    def triad(self) -> Array:
        """Return the TRIAD quaternion q_BN (4,) of the middles: pair 0 matched, pair 1 fixing the rotation about it.

        Where these are parallel the first later pair that is not takes the place of pair 1; where none is left, the
        q-method's attitude.
        """
        b, r = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in self._middles())
        for k in range(1, len(b)):
            if not collinear(b[[0, k]], r[[0, k]], 1e-6):
                return np.asarray(quaternion_from_dcm(wahba_dcm(b[[0, k]], r[[0, k]], np.array([1.0, 0.0]))))
        return dominant_quaternion(self.mid_matrix())

    def _middles(self) -> tuple[Array, Array]:
        return self.b_B.midpoint_directions(), self.r_N.midpoint_directions()
