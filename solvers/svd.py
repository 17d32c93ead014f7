"""Singular value decomposition of the attitude profile matrix B, with the determinant rule and a Newton finish."""

from dataclasses import dataclass

import numpy as np

from optsat.attitude.alignment import polish, starting_weights
from optsat.attitude.davenport import quaternion_from_dcm
from optsat.forms import AlignmentForm, Point, required
from optsat.solvers.alignment_point import alignment_point


@dataclass(frozen=True)
class SingularValues:
    """A = U diag(1, 1, det U det V) V^T of B = sum w b r^T. Source: Markley (1988)."""

    name: str = "svd"

    def accepts(self, form: object) -> bool:
        """Return whether the form is an alignment of vectors."""
        return isinstance(form, AlignmentForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return q_BN of the least weighted loss."""
        form = required(form, AlignmentForm, self.name)
        B = np.einsum("m,mi,mj->ij", starting_weights(form.weights), form.b_B, form.r_N)
        left, _, right = np.linalg.svd(B)
        rotation = left @ np.diag((1.0, 1.0, np.linalg.det(left) * np.linalg.det(right))) @ right
        return alignment_point(form, *polish(form.b_B, form.r_N, form.weights, quaternion_from_dcm(rotation)))
