"""Smallest provable ball around an admissible set: the 4x4 semidefinite programme, scaled about a pivot attitude.

With 1 - cos(eps) near 1e-9 the plain programme loses its digits; in Gibbs coordinates about a pivot, divided by the
pivot's own radius, every number is of order one.
"""

from dataclasses import dataclass, field
from functools import cache

import numpy as np

from optsat.arrays import Array, Mask
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import davenport_matrix, dominant_quaternion
from optsat.attitude.gibbs_chart import GibbsChart
from optsat.errors import InputError
from optsat.forms import ConeKind, ConicForm, EnclosureForm, Point, required, symmetric_vector
from optsat.solution import Termination
from optsat.solvers.clarabel import Clarabel

_LARGEST_SCALE = np.tan(np.pi / 3)
# a ball that shrank to less than this share of the pivot's deserves a pivot of its own
_WORTH_RENEWING = 0.3


@dataclass(frozen=True)
class ScaledSemidefinite:
    """Optimal weights by the scaled dual of min t, t I >= X >= 0, tr X = 1, tr(M_j X) >= 0.

    passes : the pivot is renewed at the weights found while that shrinks its ball to less than 0.3, this often at most
    Source: robust Wahba specification section 6, Theorem 2 and the scaled programme.
    """

    passes: int = 2
    conic: Clarabel = field(default_factory=lambda: Clarabel(prescaled=True))
    name: str = "scaled_semidefinite"

    def __post_init__(self) -> None:
        if self.passes < 1:
            raise InputError(f"`passes` must be at least 1, got {self.passes}.")

    def accepts(self, form: object) -> bool:
        """Return whether the form asks for an enclosing ball."""
        return isinstance(form, EnclosureForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return weights (`dual`, sum 1) and their Davenport attitude (`x`); `stats["candidates"]` holds every pass."""
        form = required(form, EnclosureForm, self.name)
        admissible = form.admissible
        weights = pivot_weights(admissible) if start is None else start.dual
        candidates, iterations = [weights], 0
        chart = pivot_chart(admissible, weights)
        last, found = _solve_about(chart, self.conic)
        for _ in range(self.passes - 1):
            if found is None:
                break
            candidates.append(found)
            if last.termination is Termination.CONVERGED and _radius_in(chart, found) > _WORTH_RENEWING:
                break
            iterations += last.iterations
            chart = pivot_chart(admissible, found)
            last, found = _solve_about(chart, self.conic)
        if found is not None and found is not candidates[-1]:
            candidates.append(found)
        weights, iterations = candidates[-1], iterations + last.iterations
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


def pivot_chart(admissible: AdmissibleSet, weights: Array) -> GibbsChart:
    """Return the chart about the Davenport attitude of `weights`, in units of the ball that they prove."""
    q_BN = dominant_quaternion(davenport_matrix(admissible.left_B, admissible.right_N, weights))
    quadratics = admissible.centred(q_BN)
    scale = _radius(weights, *quadratics)
    if scale == 0.0:
        # the weights themselves contradict the data, or nearly so: the bounds alone give the size
        scale = float(np.sqrt(max(float(weights[: admissible.cone_count] @ admissible.cone_versine), 1e-26)))
    return GibbsChart.of(admissible, q_BN, min(scale, _LARGEST_SCALE), quadratics)


def _radius(weights: Array, a: Array, h: Array, G: Array) -> float:
    """Return tan(theta / 2) of the ball that the weighted quadratics a + 2 h.g + g^T G g prove, to first order."""
    C = -np.tensordot(weights, G, 1)
    c = float(np.linalg.eigvalsh(C)[0])
    if c <= 1e-14:
        return float("inf")
    pull = weights @ h
    value = float(weights @ a) + float(pull @ np.linalg.solve(C, pull))
    return float(np.sqrt(max(value, 0.0) / c))


def _radius_in(chart: GibbsChart, weights: Array) -> float:
    """Return the radius that the weights prove, in units of the chart's own."""
    return _radius(weights * chart.size, chart.a, chart.h, chart.G)


def _solve_about(chart: GibbsChart, conic: Clarabel) -> tuple[Point, Array | None]:
    """Return the solver's point and the weights of all constraints (sum 1), None where it gave none."""
    keep = _active(chart)
    a, h, G = chart.a, chart.h, chart.G
    if not keep.all():
        a, h, G = a[keep], h[keep], G[keep]
    point = conic.run(_programme(a, h, G, chart.scale**2))
    multipliers = np.where(np.isfinite(point.dual), point.dual, 0.0)[: int(keep.sum())]
    weights = np.zeros(len(chart.a))
    weights[keep] = np.maximum(multipliers, 0.0) / chart.size[keep]
    total = float(weights.sum())
    return point, weights / total if 0 < total < np.inf else None


def _active(chart: GibbsChart) -> Mask:
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
