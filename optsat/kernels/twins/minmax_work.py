"""Min-max, the work memory of the twin, named as in `minmax.c`."""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, Mask
from optsat.kernels.evaluate import Leaf

EPSILON = float(np.finfo(float).eps)
LARGEST = float(np.finfo(float).max)
SMALLEST = float(np.finfo(float).tiny)
TOLERANCE = float(0.5 * np.sqrt(EPSILON))

STEPS = 60
"""Interior-point steps, before the fallback and once more after it."""

ADAPTIVE_STEPS = 30
"""Steps after which the barrier is lowered only when the problem at the present one is solved."""

FALLBACK_STEPS = 40
"""Steps of the fallback."""


@dataclass(frozen=True)
class Sizes:
    """Unknowns, rows and scalar parameters of one problem."""

    unknowns: int
    rows: int
    parameters: int

    @property
    def pairs(self) -> int:
        """Rows, lower bounds and upper bounds: each has a slack and a multiplier."""
        return self.rows + 2 * self.unknowns

    @property
    def padded(self) -> int:
        """Length of a row of x and gamma with its padding, a multiple of four."""
        return -(-(self.unknowns + 1) // 4) * 4

    def of_template(self) -> dict[str, int]:
        """Return the sizes under the names of the template."""
        return {
            "N": self.unknowns,
            "V": self.unknowns + 1,
            "PADDED": self.padded,
            "ROWS": self.rows,
            "PAIRS": self.pairs,
            "PARAMETERS": self.parameters,
            "STEPS": STEPS,
            "ADAPTIVE_STEPS": ADAPTIVE_STEPS,
            "FALLBACK_STEPS": FALLBACK_STEPS,
        }


@dataclass
class MinmaxPoint:
    """Where the iteration stands: unknowns, rows, slacks of the pairs, and the two parts of the merit."""

    x: Array
    gamma: float
    row: Array
    slack: Array
    misfit: float = 0.0
    log_sum: float = 0.0


@dataclass(frozen=True)
class MinmaxStep:
    """Change of the unknowns and gamma, of the slacks and of the multipliers."""

    v: Array
    slack: Array
    multiplier: Array


class MinmaxWork:
    """One call: the problem, and what the iteration knows."""

    def __init__(self, sizes: Sizes, rows_leaf: Leaf, derivatives_leaf: Leaf, x: Array, unbounded: float) -> None:
        n, rows = sizes.unknowns, sizes.rows
        self.sizes = sizes
        self.rows_leaf, self.derivatives_leaf = rows_leaf, derivatives_leaf
        self.parameters = x[n : n + sizes.parameters]
        self.lower, self.upper = x[n + sizes.parameters :].reshape(2, n)
        self.width = np.zeros(rows)
        size = fmax(np.abs(self.lower), np.abs(self.upper))
        self.fixed = self.upper - self.lower <= (256.0 * EPSILON) * size
        self.present = np.concatenate(
            [np.ones(rows, bool), ~self.fixed & (self.lower > -unbounded), ~self.fixed & (self.upper < unbounded)]
        )
        self.count = float(np.sum(self.present))
        self.now = MinmaxPoint(x[:n].copy(), 0.0, np.zeros(rows), np.ones(sizes.pairs))
        self.trial = self.now
        self.multiplier = np.zeros(sizes.pairs)
        self.value, self.row = np.zeros(rows), np.zeros((rows, n + 1))
        self.inverse = np.ones(sizes.pairs)
        self.hessian = np.zeros((n + 1, n + 1))
        self.gradient, self.dual_residual = np.zeros(n), np.zeros(n + 1)
        self.row_residual, self.product = np.zeros(rows), np.zeros(sizes.pairs)
        self.matrix = np.zeros((n + 1, n + 1))
        self.factor, self.reciprocal = self.matrix, np.zeros(n + 1)
        self.best_x, self.best_gamma, self.best_violation = x[:n], LARGEST, LARGEST
        self.dual_error = self.row_error = self.gap = self.error = 0.0
        self.damping, self.penalty, self.iterations = 0.0, 1.0, 0.0

    @property
    def hard(self) -> Mask:
        """Which rows are constraints (rows,)."""
        return ~(self.width > 0.0)

    def fitting(self, point: MinmaxPoint) -> Array:
        """Return what the rows leave for their slacks."""
        return self.width * point.gamma - point.row

    def evaluate(self, point: MinmaxPoint) -> bool:
        """Take the rows at a point; False where one is not finite."""
        point.row = self.rows_leaf(np.concatenate([point.x, self.parameters]))
        return bool(np.isfinite(point.row).all())


def fmax(a: Array | float, b: Array | float) -> Array:
    """Return the larger; a NaN loses, a tie returns the first, as `os_fmax` does."""
    return np.where(np.isnan(b) | (np.asarray(a) >= b), a, b)


def fmin(a: Array | float, b: Array | float) -> Array:
    """Return the smaller, as `os_fmin` does."""
    return np.where(np.isnan(b) | (np.asarray(a) <= b), a, b)


def largest_of(values: Array, least: float) -> float:
    """Return the last of the largest, `least` and NaN aside."""
    for value in values:
        least = np.float64(fmax(value, least))
    return least


def ordered_sum(values: Array, start: float = 0.0) -> float:
    """Return the sum in the order of the entries."""
    # no Python float: the C form divides by zero without a word
    return np.float64(np.add.accumulate(np.concatenate([[start], values]))[-1])
