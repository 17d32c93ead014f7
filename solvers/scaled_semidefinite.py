"""Smallest provable ball around an admissible set: the 4x4 semidefinite programme, scaled about a pivot attitude.

With 1 - cos(eps) near 1e-9 the plain programme loses its digits; in Gibbs coordinates about a pivot, divided by the
pivot's
own radius, every number is of order one.
"""

from dataclasses import dataclass, field
from functools import cache

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion, turn
from optsat.attitude.gibbs_chart import GibbsChart
from optsat.forms import ConeKind, ConicForm, EnclosureForm, Point, symmetric_vector
from optsat.solution import Termination
from optsat.solvers.clarabel import Clarabel

_LARGEST_SCALE = np.tan(np.pi / 3)


@dataclass(frozen=True)
class ScaledSemidefinite:
    """Optimal weights by the scaled dual of min t, t I >= X >= 0, tr X = 1, tr(M_j X) >= 0.

    passes : the pivot is renewed at the weights found while that shrinks its ball to less than 0.3, this often at most
    Source: robust Wahba specification section 6, Theorem 2 and the scaled programme.
    """

    passes: int = 2
    conic: Clarabel = field(default_factory=Clarabel)
    name: str = "scaled_semidefinite"

    def accepts(self, form: object) -> bool:
        """Return whether the form asks for an enclosing ball."""
        return isinstance(form, EnclosureForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return weights (`dual`, sum 1) and their Davenport attitude (`x`); `stats["candidates"]` holds every pass."""
        assert isinstance(form, EnclosureForm)
        admissible = form.admissible
        weights = pivot_weights(admissible) if start is None else start.dual
        chart, candidates, iterations = _pivot_chart(admissible, weights), [weights], 0
        for _ in range(self.passes):
            last, found = _solve_about(chart, self.conic)
            iterations += last.iterations
            if found is None:
                break
            weights, former = found, chart.scale
            candidates.append(weights)
            chart = _pivot_chart(admissible, weights)
            if last.termination is Termination.CONVERGED and 0.3 * former < chart.scale < _LARGEST_SCALE:
                break
        return Point(
            x=chart.q_BN,
            dual=weights,
            termination=last.termination,
            iterations=iterations,
            stats={"candidates": tuple(candidates), "status": last.stats["status"]},
        )


def pivot_weights(admissible: AdmissibleSet) -> Array:
    """Return weights 1 / (1 - cos eps) of the cones, 0 for cuts, sum 1: the heuristic that needs no optimisation."""
    versine = admissible.cone_versine
    floor = max(float(versine.max()) * 1e-12, 1e-30)
    weights = 1 / np.maximum(versine, floor)
    return np.concatenate((weights / weights.sum(), np.zeros(len(admissible.cut_level))))


def _pivot_chart(admissible: AdmissibleSet, weights: Array) -> GibbsChart:
    """Return the chart about the Davenport attitude of `weights`, in units of the ball that they prove."""
    q_BN = dominant_quaternion(davenport_matrix(admissible.left_B, admissible.right_N, weights))
    a, h, G = admissible.centred(q_BN)
    C = -np.einsum("m,mij->ij", weights, G)
    c = float(np.linalg.eigvalsh(C)[0])
    scale = np.inf
    if c > 1e-14:
        step = np.linalg.solve(C, weights @ h)
        if float(np.linalg.norm(step)) < 1.0:
            q_BN = turn(q_BN, step)
            a = admissible.centred(q_BN)[0]
        scale = float(np.sqrt(max(float(weights @ a), 0.0) / c))
    return GibbsChart.about(admissible, q_BN, _LARGEST_SCALE if scale > _LARGEST_SCALE else max(scale, 1e-13))


def _solve_about(chart: GibbsChart, conic: Clarabel) -> tuple[Point, Array | None]:
    """Return the solver's point and the weights of all constraints (sum 1), None where it gave none."""
    keep = _active(chart)
    point = conic.run(_programme(chart.a[keep], chart.h[keep], chart.G[keep], chart.scale**2))
    multipliers = np.where(np.isfinite(point.dual), point.dual, 0.0)[: int(keep.sum())]
    weights = np.zeros(len(chart.a))
    weights[keep] = np.maximum(multipliers, 0.0) / chart.size[keep]
    total = float(weights.sum())
    return point, weights / total if 0 < total < np.inf else None


def _active(chart: GibbsChart) -> Array:
    # a constraint that holds on the whole unit ball can only have multiplier 0
    if chart.scale >= _LARGEST_SCALE or len(chart.a) <= 8:
        return np.ones(len(chart.a), dtype=bool)
    lowest = chart.a - 2 * np.linalg.norm(chart.h, axis=1) + np.minimum(np.linalg.eigvalsh(chart.G)[:, 0], 0.0)
    return np.asarray(lowest <= 0.0)


_UPPER = tuple((i, j) for j in range(3) for i in range(j + 1))


def _programme(a: Array, h: Array, G: Array, s2: float) -> ConicForm:
    """Maximise tau over x = (G: 6 upper-triangle entries, h: 3, tau), R = 1 - s^2 tr G.

    tr(M_j Y) >= 0;  Y = [[R, h^T], [h, G]] >= 0;  [[tr G - tau, -h^T], [-h, (1 - s^2 tau) I - s^2 G]] >= 0.
    """
    count = len(a)
    constant, linear, quadratic = _semidefinite_rows()
    A = np.empty((count + 20, 10))
    for k, (i, j) in enumerate(_UPPER):
        A[:count, k] = s2 * a - G[:, i, i] if i == j else -2 * G[:, i, j]
    A[:count, 6:9] = -2 * h
    A[:count, 9] = 0.0
    A[count:] = -(linear + s2 * quadratic)
    q = np.zeros(10)
    q[9] = -1.0
    cones: tuple[tuple[ConeKind, int], ...] = (
        ("nonnegative", count),
        ("psd_triangle", 4),
        ("psd_triangle", 4),
    )
    return ConicForm(q, A, np.concatenate((a, constant)), cones)


@cache
def _semidefinite_rows() -> tuple[Array, Array, Array]:
    """Return constant (20,), linear (20, 10) and s^2 (20, 10) parts of the two semidefinite blocks in x."""
    zero = np.zeros((4, 4))
    lower = np.diag((0.0, 1.0, 1.0, 1.0))
    trace = [_unit(0, 0) if i == j else zero for i, j in _UPPER]
    entries = [_unit(i + 1, j + 1) for i, j in _UPPER]
    sides = [_unit(0, k) for k in (1, 2, 3)]
    first = (_unit(0, 0), [*entries, *sides, zero], [*(-t for t in trace), zero, zero, zero, zero])
    second = (
        lower,
        [*trace, *(-side for side in sides), -_unit(0, 0)],
        [*(-e for e in entries), zero, zero, zero, -lower],
    )
    constant, linear, quadratic = (
        np.concatenate([symmetric_vector(np.array(block[part])) for block in (first, second)], axis=-1)
        for part in range(3)
    )
    return constant, linear.T, quadratic.T


def _unit(i: int, j: int) -> Array:
    E = np.zeros((4, 4))
    E[i, j] = E[j, i] = 1.0
    return E
