"""Dual bound: a number that no feasible point of a convex min-max problem can beat, from multipliers alone."""

from fractions import Fraction
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.arrays import Array, Mask
from optsat.certificates.first_order import FirstOrder
from optsat.convex_rows import ConvexRows
from optsat.forms import MinMaxForm
from optsat.kernels.program import Program
from optsat.smooth_map import SymbolicMap
from optsat.symbolic.interval_evaluation import evaluate_over_box

# excess, relative to the factor (at least 1), below which no sharper bound is sought
_SHARP = 1e-9
# eigenvalues of the growth below this fraction of the largest count as none
_FLAT = 1e-9
# a multiplier below this fraction of the largest is not moved when gradients are balanced
_SMALL = 1e-9
# radii of the box around the answer, in units of 1 / sqrt(curvature), on which strong convexity is tried
_RADII = (1.0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
# singular values of the pressing gradients above this fraction of the largest count as independent
_INDEPENDENT = 1e-6
# entries of the largest matrix whose rank is found in rational arithmetic
_EXACT = 2500
_ROUNDOFF = 2.0**-53


def dual_bound(form: MinMaxForm, convex: ConvexRows, state: FirstOrder, x: Array) -> float:
    """Return a lower bound of the attainment factor over all feasible points; -inf where the multipliers give none.

    With multipliers mu >= 0 and any feasible (z, t): t sum mu w >= L(z) = sum mu value(z), and L is convex, so

        L(z) >= L(x) + r.d + 1/2 d' P d,  d = z - x,  r the gradient of L at x, P what L grows by.

    The minimum over d is closed where r lies in the range of P. A rest outside it is first balanced by moving the
    multipliers of the pressing rows, then bounded by the reach of the bounds; last, P is what interval arithmetic
    proves of the Hessian on a box around x. Rounding of the balance is allowed for; evaluation of L(x) itself is not
    rounded outward.
    """
    factor = form.factor(form.objectives.values(x))
    multipliers = state.multipliers
    excess = _globally(form, convex, state, x, multipliers)
    if excess > _SHARP * max(1.0, abs(factor)):
        excess = min(excess, _globally(form, convex, state, x, _balanced(convex, state, multipliers)))
    if excess > _SHARP * max(1.0, abs(factor)):
        excess = min(excess, _locally(form, state, x))
    return factor - excess


def _globally(form: MinMaxForm, convex: ConvexRows, state: FirstOrder, x: Array, multipliers: Array) -> float:
    """Return by how much the factor may exceed the optimum, from the growth that the rows have everywhere."""
    rows = state.rows
    if not float(rows.weight @ multipliers) > 0:
        return np.inf
    r = rows.gradient.T @ multipliers
    values, vectors = np.linalg.eigh(convex.growth(multipliers))
    along = vectors.T @ r
    grows = values > _FLAT * max(1.0, float(values[-1]))
    decrease = np.full(len(x), np.inf)
    decrease[grows] = along[grows] ** 2 / (2 * values[grows])
    # what remains of a balanced gradient is rounding; exact multipliers exist within that distance (see _balanced)
    size = float(np.max(np.abs(rows.gradient * multipliers[:, None]), initial=0.0))
    rounded = np.abs(along) <= _rounding(state) * size if _spans(convex, state, multipliers) else along == 0.0
    decrease[rounded & ~grows] = 0.0
    reach = _products(np.abs(vectors), np.maximum(form.upper - x, x - form.lower)[:, None]).sum(axis=0)
    decrease = np.minimum(decrease, _products(np.abs(along), reach))
    return float(multipliers @ rows.slack + decrease.sum()) / float(rows.weight @ multipliers)


def _products(a: Array, b: Array) -> Array:
    """Return a b with 0 times infinity = 0: a bound that is absent costs nothing where nothing depends on it."""
    return np.asarray(np.where(a == 0.0, 0.0, a) * np.where(a == 0.0, 0.0, b))


def _rounding(state: FirstOrder) -> float:
    return 64 * _ROUNDOFF * sum(state.rows.gradient.shape)


def _flat_directions(convex: ConvexRows, multipliers: Array) -> Array:
    values, vectors = np.linalg.eigh(convex.growth(multipliers))
    return np.asarray(vectors[:, values <= _FLAT * max(1.0, float(values[-1]))])


def _movable(multipliers: Array) -> Mask:
    return np.asarray(multipliers > _SMALL * np.max(multipliers))


def _spans(convex: ConvexRows, state: FirstOrder, multipliers: Array) -> bool:
    """Return whether the pressing rows' gradients span the directions without growth, so that a balance exists."""
    flat = _flat_directions(convex, multipliers)
    if flat.shape[1] == 0:
        return True
    moved = _movable(multipliers)
    pressing = state.rows.gradient[moved] @ flat
    singular = np.linalg.svd(pressing, compute_uv=False)
    rank = int(np.sum(singular > _INDEPENDENT * max(1.0, float(singular[0]))))
    if rank == flat.shape[1]:
        return True
    # along a direction in which no pressing row changes there is nothing to balance; whether none does is exact only
    # where all of them are affine, so that their gradients are constants
    rows = state.rows.gradient[moved]
    affine = np.array([*(shape.affine for shape in convex.shapes), *[True] * (len(moved) - len(convex.shapes))])
    return bool(flat.shape[1] == len(flat) and affine[moved].all() and rows.size <= _EXACT and _rank(rows) == rank)


def _rank(rows: Array) -> int:
    """Return the rank of the matrix of these floating-point numbers, in rational arithmetic."""
    left = [[Fraction(float(value)) for value in row] for row in rows]
    rank = 0
    for column in range(rows.shape[1]):
        pivot = next((row for row in left if row[column]), None)
        if pivot is None:
            continue
        left.remove(pivot)
        rank += 1
        for i, row in enumerate(left):
            if row[column]:
                ratio = row[column] / pivot[column]
                left[i] = [value - ratio * base for value, base in zip(row, pivot, strict=True)]
    return rank


def _balanced(convex: ConvexRows, state: FirstOrder, multipliers: Array) -> Array:
    """Return multipliers moved least so that no gradient is left in the directions without growth.

    The multipliers of the pressing rows that balance exactly form an affine set; when the pressing gradients have full
    rank in these directions, it meets the neighbourhood of ours, and a positive multiplier stays positive there.
    """
    for _ in range(3):
        flat = _flat_directions(convex, multipliers)
        if flat.shape[1] == 0:
            return multipliers
        moved = _movable(multipliers)
        rest = flat.T @ (state.rows.gradient.T @ multipliers)
        step = np.zeros_like(multipliers)
        step[moved] = np.linalg.lstsq((state.rows.gradient[moved] @ flat).T, -rest, rcond=None)[0]
        multipliers = np.where(moved, np.maximum(multipliers + step, 0.0), 0.0)
        if not multipliers.any():
            return state.multipliers
    return multipliers


def _locally(form: MinMaxForm, state: FirstOrder, x: Array) -> float:
    """Return by how much the factor may exceed the optimum, from strong convexity proven on a box around x.

    In coordinates y = d / scale, with L(x + d) convex everywhere and >= L(x) + r.y + m |y|^2 / 2 for |y| <= h: if
    m h > 2 |r|, L exceeds L(x) on that sphere, so its minimum lies inside and is not below L(x) - |r|^2 / (2 m).
    """
    objectives, constraints = form.objectives, form.constraints
    if not isinstance(objectives, SymbolicMap) or not isinstance(constraints, SymbolicMap):
        return np.inf
    program = _lagrangian_hessian(objectives.function, constraints.function)
    rows, multipliers, n = state.rows, state.multipliers, len(x)
    if not float(rows.weight @ multipliers) > 0:
        return np.inf
    weights = np.zeros(form.objectives.size)
    np.add.at(weights, form.objective, state.dual[: len(form.weight)] * form.sign)
    others = state.dual[len(form.weight) : len(form.weight) + form.constraints.size]
    known = np.concatenate((objectives.p, constraints.p, weights, others))
    here = evaluate_over_box(program, [(x, x), (known, known)])[0].reshape(n, n)
    if not np.all(np.isfinite(here)) or np.any(np.diag(here) <= 0):
        return np.inf
    scale = 1 / np.sqrt(np.diag(here))
    r = float(np.linalg.norm(scale * (rows.gradient.T @ multipliers)))
    for h in _RADII:
        lower, upper = (
            bound.reshape(n, n) * np.outer(scale, scale)
            for bound in evaluate_over_box(program, [(x - h * scale, x + h * scale), (known, known)])
        )
        if not (np.all(np.isfinite(lower)) and np.all(np.isfinite(upper))):
            continue
        m = float(np.linalg.eigvalsh((lower + upper) / 2)[0]) - float(np.max(((upper - lower) / 2).sum(axis=1)))
        if m * h > 2 * r:
            return float(multipliers @ rows.slack + r**2 / (2 * m)) / float(rows.weight @ multipliers)
    return np.inf


# kept with the Functions, so that another start, goal or parameter finds it ready
@lru_cache(maxsize=64)
def _lagrangian_hessian(objectives: Any, constraints: Any) -> Program:
    """Return the program of the Lagrangian's Hessian (n, n), dense, of x and (p, q, weights of F, weights of g)."""
    import casadi as ca

    from optsat.kernels.instructions import read_instructions

    x = ca.SX.sym("x", objectives.size1_in(0))
    sizes = [objectives.size1_in(1), constraints.size1_in(1), objectives.size1_out(0), constraints.size1_out(0)]
    known = ca.SX.sym("known", sum(sizes))
    p, q, weights, others = ca.vertsplit(known, [0, *np.cumsum(sizes).tolist()])
    lagrangian = ca.dot(weights, objectives(x, p))
    if sizes[3]:
        lagrangian += ca.dot(others, constraints(x, q))
    hessian = ca.densify(ca.hessian(lagrangian, x)[0])
    return read_instructions(ca.Function("hessian", [x, known], [hessian]))
