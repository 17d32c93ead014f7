"""Box maximum: the largest value of a function over a box, found and bounded by branch and bound on intervals."""

import heapq
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.kernels.program import Program
from optsat.symbolic.interval_evaluation import evaluate_over_box

Known = tuple[Array, Array]


@dataclass(frozen=True)
class BoxMaximum:
    """What was found.

    u (m,) : where the value was found; bound : that no u in the box exceeds, value <= bound, rounding included
    boxes : how many were looked at
    """

    u: Array
    value: float
    bound: float
    boxes: int


@dataclass(frozen=True)
class Row:
    """One value as programs of (x, u, p): itself (1,), and its derivatives by u (m,), dense."""

    value: Program
    gradient: Program


def largest_over_box(
    row: Row, x: Array, p: Array, lower: Array, upper: Array, tolerance: float, most_boxes: int
) -> BoxMaximum:
    """Return the largest value over lower <= u <= upper at x and p, to the tolerance unless `most_boxes` are spent.

    Boxes whose bound is the largest are split first; a direction in which the value surely rises or falls collapses to
    its end. Source: Moore, Kearfott & Cloud (2009), mean value form.
    """
    search = _Search(row, (x, x), (p, p), 0.5 * (lower + upper))
    search.add(lower, upper)
    while search.heap and search.boxes < most_boxes:
        if -search.heap[0][0] <= search.value + tolerance:
            break
        _, _, low, high, slope = heapq.heappop(search.heap)
        k = int(np.argmax((high - low) * slope))
        middle = 0.5 * (low[k] + high[k])
        for ends in ((low[k], middle), (middle, high[k])):
            below, above = low.copy(), high.copy()
            below[k], above[k] = ends
            search.add(below, above)
    remaining = max((-entry[0] for entry in search.heap), default=-np.inf)
    return BoxMaximum(search.u, search.value, max(search.value, search.closed, remaining), search.boxes)


class _Search:
    """Open boxes by their bounds, and the best point."""

    def __init__(self, row: Row, x: Known, p: Known, u: Array) -> None:
        self.row, self.x, self.p = row, x, p
        self.u, self.value, self.closed = u, -np.inf, -np.inf
        self.boxes = 0
        self.heap: list[tuple[float, int, Array, Array, Array]] = []

    def add(self, low: Array, high: Array) -> None:
        """Bound a box, look at points in it, and keep it open unless it is a single point."""
        self.boxes += 1
        least, most = evaluate_over_box(self.row.gradient, [self.x, (low, high), self.p])
        low, high = np.where(least >= 0, high, low), np.where(most <= 0, low, high)
        middle, radius = 0.5 * (low + high), 0.5 * (high - low)
        # rounded up, so that the box about the middle holds both ends
        radius = np.where(high > low, np.nextafter(np.maximum(high - middle, middle - low), np.inf), radius)
        slope = np.maximum(np.abs(least), np.abs(most))
        at_middle = self._evaluated(middle, middle)[1]
        rise = float(np.sum(np.where(radius > 0, slope * radius, 0.0)))
        by_slope = np.nextafter(at_middle + rise * (1 + 4e-16 * len(low)), np.inf)
        bound = float(min(self._evaluated(low, high)[1], by_slope))
        uphill = np.where(least + most > 0, high, low)
        for u in (middle, uphill):
            value = self._evaluated(u, u)[0]
            if value > self.value:
                self.u, self.value = u, value
        if np.all(radius == 0.0):
            self.closed = max(self.closed, bound)
        else:
            heapq.heappush(self.heap, (-bound, self.boxes, low, high, np.where(np.isfinite(slope), slope, 1e300)))

    def _evaluated(self, low: Array, high: Array) -> tuple[float, float]:
        least, most = evaluate_over_box(self.row.value, [self.x, (low, high), self.p])
        return float(least[0]), float(most[0])
