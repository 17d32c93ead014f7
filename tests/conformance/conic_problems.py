"""Tiny conic programmes with answers known by hand, and a problem class that recomputes a conic point's residuals."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.forms import ConeKind, ConicForm, Point, symmetric_vector
from optsat.solution import Proof, Solution


@dataclass(frozen=True)
class ConicProblem:
    """A conic form as a problem of its own; the answer is the solver's point."""

    form: ConicForm

    def lower(self) -> ConicForm:
        """Return the form."""
        return self.form

    def interpret(self, point: Point, solver: str) -> Solution[Point]:
        """Return the point with its distance from the cones and its gap."""
        form = self.form
        residuals = {
            "primal": outside(form, form.b - form.A @ point.x),
            "dual": float(np.max(np.abs(form.q + form.A.T @ point.dual))),
            "dual_cone": outside(form, point.dual, dual=True),
            "gap": float(abs(form.q @ point.x + form.b @ point.dual)),
        }
        return Solution(point, point.termination, Proof.UNDECIDED, residuals, None, {"solver": solver, **point.stats})


def outside(form: ConicForm, rows: Array, dual: bool = False) -> float:
    """Return how far `rows` lie outside the form's cones, or outside their duals."""
    worst, first = 0.0, 0
    for kind, size in form.cones:
        length = size * (size + 1) // 2 if kind == "psd_triangle" else size
        part = rows[first : first + length]
        first += length
        if kind == "zero":
            lacking = 0.0 if dual else float(np.max(np.abs(part)))
        elif kind == "nonnegative":
            lacking = -float(part.min())
        elif kind == "second_order":
            lacking = float(np.linalg.norm(part[1:]) - part[0])
        else:
            lacking = -float(np.linalg.eigvalsh(symmetric_matrix(part, size))[0])
        worst = max(worst, lacking)
    assert first == len(rows)
    return worst


def symmetric_matrix(rows: Array, k: int) -> Array:
    """Return the symmetric matrix whose "psd_triangle" rows are given."""
    matrix = np.zeros((k, k))
    places = [(i, j) for j in range(k) for i in range(j + 1)]
    for value, (i, j) in zip(rows, places, strict=True):
        matrix[i, j] = matrix[j, i] = value if i == j else value / np.sqrt(2)
    return matrix


def conic(q: object, A: object, b: object, *cones: tuple[ConeKind, int]) -> ConicProblem:
    """Return a conic problem from nested lists."""
    costs, matrix, right = (np.array(part, dtype=np.float64) for part in (q, A, b))
    return ConicProblem(ConicForm(costs, matrix, right, cones))


MATRIX = np.array([[2.0, 1.0, 0.0], [1.0, 2.0, 1.0], [0.0, 1.0, 2.0]])

SOLVABLE = {
    # min x + y, x >= 1, y >= 2
    "linear": (conic([1, 1], [[-1, 0], [0, -1]], [-1, -2], ("nonnegative", 2)), 3.0),
    # min x + 2 y, x + y = 1, x, y >= 0
    "equality": (conic([1, 2], [[1, 1], [-1, 0], [0, -1]], [1, 0, 0], ("zero", 1), ("nonnegative", 2)), 1.0),
    # min t, |(3, 4)| <= t
    "second order": (conic([1], [[-1], [0], [0]], [0, 3, 4], ("second_order", 3)), 5.0),
    # min t, t I - M >= 0: the largest eigenvalue
    "semidefinite": (
        conic(
            [1],
            -symmetric_vector(np.eye(3))[:, None],
            -symmetric_vector(MATRIX),
            ("psd_triangle", 3),
        ),
        2 + np.sqrt(2),
    ),
    # the linear one with columns eight decades apart
    "badly scaled": (conic([1e4, 1e-4], [[-1e4, 0], [0, -1e-4]], [-1, -2], ("nonnegative", 2)), 3.0),
    # every point of an edge is optimal
    "degenerate": (conic([1, 1], [[-1, -1], [-1, 0], [0, -1]], [-1, 0, 0], ("nonnegative", 3)), 1.0),
}

# x >= 1 and x <= 0
INFEASIBLE = conic([1], [[-1], [1]], [-1, 0], ("nonnegative", 2))
# min -x, x >= 0
UNBOUNDED = conic([-1], [[-1]], [0], ("nonnegative", 1))
