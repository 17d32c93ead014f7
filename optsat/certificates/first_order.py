"""First-order conditions of a min-max point, recomputed from the form: feasibility, multipliers and KKT residual."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array, Mask
from optsat.forms import MinMaxForm

# slacks, relative to the size of the bound, below which a row may press: the best of the three is kept
_ACTIVE = (1e-9, 1e-7, 1e-5)
# residual of the solver's own multipliers below which no better ones are sought
_GOOD = 1e-10


@dataclass(frozen=True)
class OneSidedRows:
    """All constraints of a form at one point as value <= weight t, linearised.

    slack (r,) : weight t - value at t = the attainment factor; scale (r,) : size of the bound, at least 1
    gradient (r, n) of the values; weight (r,) >= 0
    place (r,), sign (r,) : where the multiplier stands in the form's `dual`, and with which sign
    """

    slack: Array
    scale: Array
    gradient: Array
    weight: Array
    place: NDArray[np.intp]
    sign: Array

    @property
    def violation(self) -> float:
        """Largest violation relative to the bound's size (at least 1)."""
        return float(max(0.0, np.max(-self.slack / self.scale)))

    def multipliers(self, dual: Array) -> Array:
        """Return multipliers (r,) >= 0 from those in the form's order."""
        return np.asarray(np.maximum(self.sign * dual[self.place], 0.0))

    def dual(self, multipliers: Array, length: int) -> Array:
        """Return multipliers (r,) in the form's order."""
        result = np.zeros(length)
        np.add.at(result, self.place, self.sign * multipliers)
        return result


@dataclass(frozen=True)
class FirstOrder:
    """How far a point is from the first-order conditions, with the multipliers that come nearest.

    multipliers (r,) >= 0, sum of weight times multiplier = 1; dual : the same in the form's order
    stationarity : largest component of sum multiplier * gradient, relative to the largest term (at least 1)
    complementarity : largest multiplier * slack, relative to the attainment factor (at least 1)
    violation : largest violation, relative to the bound's size (at least 1)
    weight_sum : sum of weight times multiplier as the solver gave it, NaN where it gave none
    """

    rows: OneSidedRows
    multipliers: Array
    dual: Array
    stationarity: float
    complementarity: float
    violation: float
    weight_sum: float

    @property
    def residual(self) -> float:
        """The KKT residual: the largest of the three."""
        return max(self.stationarity, self.complementarity, self.violation)


def one_sided_rows(form: MinMaxForm, x: Array) -> OneSidedRows:
    """Return all constraints of the form at x."""
    F, n, m = form.objectives.values(x), len(x), len(form.weight)
    rows, factor = form.rows(F), form.factor(F)
    gradients = form.sign[:, None] * form.objectives.jacobian(x)[form.objective]
    parts = [
        (
            form.weight * factor - rows,
            np.maximum(1.0, np.abs(form.level)),
            gradients,
            form.weight,
            np.arange(m),
            np.ones(m),
        )
    ]
    first = m
    for values, jacobian, lower, upper in (
        (
            form.constraints.values(x),
            form.constraints.jacobian(x),
            form.constraint_lower,
            form.constraint_upper,
        ),
        (form.A @ x, form.A, form.linear_lower, form.linear_upper),
        (x, np.eye(n), form.lower, form.upper),
    ):
        places = np.arange(first, first + len(values))
        for bound, sign in ((upper, 1.0), (lower, -1.0)):
            given = np.isfinite(bound)
            parts.append(
                (
                    sign * (bound - values)[given],
                    np.maximum(1.0, np.abs(bound[given])),
                    sign * jacobian[given],
                    np.zeros(int(given.sum())),
                    places[given],
                    np.full(int(given.sum()), sign),
                )
            )
        first += len(values)
    return OneSidedRows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def first_order(form: MinMaxForm, x: Array, dual: Array) -> FirstOrder:
    """Return the first-order residuals at x with the best multipliers: the solver's, or fitted to the active rows.

    x (n,) : where all functions are finite; dual : in the form's order, or empty
    At a kink where a derivative does not exist the residuals are infinite.
    """
    rows = one_sided_rows(form, x)
    length = len(form.weight) + form.constraints.size + len(form.A) + len(x)
    weight_sum = float("nan")
    size = max(1.0, abs(form.factor(form.objectives.values(x))))
    judged: list[tuple[float, float, float, Array]] = []
    if np.all(np.isfinite(rows.gradient)):
        if len(dual) == length and np.all(np.isfinite(dual)):
            given = rows.multipliers(dual)
            weight_sum = float(rows.weight @ given)
            judged += _judged(rows, given, size)
        if not judged or judged[0][0] > _GOOD:
            for tolerance in _ACTIVE:
                judged += _judged(rows, _fitted(rows, rows.slack <= tolerance * rows.scale), size)
    if not judged:
        nothing = np.zeros(len(rows.slack))
        return FirstOrder(rows, nothing, np.zeros(length), np.inf, np.inf, rows.violation, weight_sum)
    _, stationarity, complementarity, best = min(judged, key=lambda each: each[0])
    return FirstOrder(rows, best, rows.dual(best, length), stationarity, complementarity, rows.violation, weight_sum)


def _judged(rows: OneSidedRows, multipliers: Array, size: float) -> list[tuple[float, float, float, Array]]:
    """Return residual, stationarity and complementarity of the multipliers at weight sum 1; nothing where it is 0."""
    total = float(rows.weight @ multipliers)
    if not total > 0:
        return []
    scaled = multipliers / total
    terms = scaled[:, None] * rows.gradient
    stationarity = float(np.max(np.abs(terms.sum(axis=0))) / max(1.0, np.max(np.abs(terms), initial=0.0)))
    complementarity = float(np.max(scaled * np.maximum(rows.slack, 0.0))) / size
    return [(max(stationarity, complementarity), stationarity, complementarity, scaled)]


def _fitted(rows: OneSidedRows, active: Mask) -> Array:
    """Return multipliers >= 0 of the active rows that bring the gradients nearest to balance at weight sum 1."""
    from scipy.optimize import nnls

    multipliers = np.zeros(len(active))
    if not np.any(active & (rows.weight > 0)):
        return multipliers
    gradient, weight = rows.gradient[active], rows.weight[active]
    emphasis = max(1.0, float(np.max(np.abs(gradient), initial=0.0)))
    system = np.vstack((gradient.T, emphasis * weight))
    right = np.concatenate((np.zeros(gradient.shape[1]), [emphasis]))
    try:
        multipliers[active] = nnls(system, right)[0]
    except RuntimeError:
        # its iteration limit: the other candidates stand
        return np.zeros(len(active))
    return multipliers
