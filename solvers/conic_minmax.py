"""Conic min-max: quadratic and norm objectives as a second-order cone programme, solved by Clarabel."""

from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array
from optsat.convex_rows import ConvexRows, convex_rows
from optsat.forms import ConeKind, ConicForm, MinMaxForm, Point, required
from optsat.solvers.clarabel import Clarabel
from optsat.symbolic.curvature import Norm, Shape, square_root


@dataclass(frozen=True)
class ConicMinMax:
    """Min-max of convex quadratics, Euclidean norms and absolute values, without a start; it returns no multipliers.

    conic : the conic solver. Source: Lobo, Vandenberghe, Boyd & Lebret (1998).
    """

    conic: Clarabel = field(default_factory=lambda: Clarabel(tolerance=1e-12))
    name: str = "conic_minmax"

    def accepts(self, form: object) -> bool:
        """Return whether the form is a min-max whose rows are surely convex quadratics and norms."""
        if not isinstance(form, MinMaxForm):
            return False
        convex = convex_rows(form)
        return convex is not None and convex.conic

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the point of the conic solver; `stats["status"]` keeps its own word."""
        form = required(form, MinMaxForm, self.name)
        convex = convex_rows(form)
        if convex is None or not convex.conic:
            raise TypeError("the rows are not all convex quadratics and norms")
        point = self.conic.run(conic_form(form, convex))
        return Point(point.x[: len(form.lower)], np.zeros(0), point.termination, point.iterations, point.stats)


def conic_form(form: MinMaxForm, convex: ConvexRows) -> ConicForm:
    """Return the programme in (x, t, one s >= norm for each norm)."""
    n = len(form.lower)
    norms = [norm for shape in convex.shapes for _, norm in shape.norms]
    size = n + 1 + len(norms)
    blocks: list[tuple[ConeKind, Array, Array]] = []
    # rows are value - weight t <= 0 as coefficients of the variables and a constant
    linear: list[tuple[Array, float]] = []
    weights = np.concatenate((form.weight, np.zeros(len(convex.upper) + len(convex.lower))))
    place = n + 1
    for shape, weight in zip(convex.shapes, weights, strict=True):
        row = np.zeros(size)
        row[:n], row[n] = shape.c, -weight
        for factor, _ in shape.norms:
            row[place] = factor
            place += 1
        if shape.Q.any():
            blocks.append(_quadratic_cone(shape, row))
        else:
            linear.append((row, -shape.d))
    for k, norm in enumerate(norms):
        blocks.append(_norm_cone(norm, n, n + 1 + k, size))
    equal = form.linear_lower == form.linear_upper
    rows = np.hstack((form.A, np.zeros((len(form.A), size - n))))
    for matrix, low, high in (
        (rows[~equal], form.linear_lower[~equal], form.linear_upper[~equal]),
        (np.eye(n, size), form.lower, form.upper),
    ):
        for row, below, above in zip(matrix, low, high, strict=True):
            linear += [(row, float(above))] * bool(np.isfinite(above))
            linear += [(-row, -float(below))] * bool(np.isfinite(below))
    if np.any(equal):
        blocks.insert(0, ("zero", rows[equal], form.linear_upper[equal]))
    if linear:
        blocks.insert(0, ("nonnegative", np.array([row for row, _ in linear]), np.array([b for _, b in linear])))
    return ConicForm(
        q=np.eye(size)[n],
        A=np.vstack([matrix for _, matrix, _ in blocks]),
        b=np.concatenate([right for _, _, right in blocks]),
        cones=tuple((kind, len(right)) for kind, _, right in blocks),
    )


def _quadratic_cone(shape: Shape, row: Array) -> tuple[ConeKind, Array, Array]:
    """Return |R x|^2 <= tau, tau = -row z - d, R' R = Q / 2, as |(2 R x, tau - 1)| <= tau + 1."""
    R = square_root(shape.Q / 2)
    inner = np.hstack((2 * R, np.zeros((len(R), len(row) - R.shape[1]))))
    matrix = np.vstack((row, -inner, row))
    return "second_order", matrix, np.concatenate(([1 - shape.d], np.zeros(len(R)), [-1 - shape.d]))


def _norm_cone(norm: Norm, n: int, place: int, size: int) -> tuple[ConeKind, Array, Array]:
    """Return |(L x + e, sqrt level)| <= s."""
    matrix = np.zeros((len(norm.e) + 2, size))
    matrix[0, place] = -1.0
    matrix[1:-1, :n] = -norm.L
    return "second_order", matrix, np.concatenate(([0.0], norm.e, [np.sqrt(norm.level)]))
