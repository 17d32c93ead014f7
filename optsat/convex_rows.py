"""Convex rows: whether all constraints of a min-max form are surely convex, and how fast each grows."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.forms import MinMaxForm
from optsat.smooth_map import SmoothMap, SymbolicMap
from optsat.symbolic.curvature import Rest, Shape, shapes_of

# a negative eigenvalue beyond this fraction of the largest is no rounding
_BENT = 1e-6


@dataclass(frozen=True)
class ConvexRows:
    """Shapes of the rows of a convex form, each as value <= 0 or value <= weight t.

    objectives : of sign F - level, row by row; upper, lower : of g - bound and bound - g where the bound is finite
    """

    objectives: tuple[Shape, ...]
    upper: tuple[Shape, ...]
    lower: tuple[Shape, ...]

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """All shapes, in the order of `one_sided_rows`, of which linear rows and bounds come last."""
        return (*self.objectives, *self.upper, *self.lower)

    @property
    def conic(self) -> bool:
        """Whether only quadratics and norms occur."""
        return all(shape.rest is Rest.NONE for shape in self.shapes)

    def growth(self, multipliers: Array) -> Array:
        """Return the sum (n, n) of multiplier times the second-order growth that each row has everywhere.

        multipliers (r,) : in the order of `one_sided_rows`
        """
        total = np.zeros_like(self.objectives[0].Q)
        for multiplier, shape in zip(multipliers, self.shapes, strict=False):
            total += multiplier * shape.Q
        return total


@lru_cache(maxsize=16)
def convex_rows(form: MinMaxForm) -> ConvexRows | None:
    """Return the shapes of the rows when all of them are surely convex, else None."""
    if _bends_down(form):
        return None
    objectives, constraints = _shapes(form, form.objectives), _shapes(form, form.constraints)
    if objectives is None or constraints is None:
        return None
    n = len(form.lower)

    def shifted(shape: Shape, sign: float, level: float) -> Shape:
        nothing = Shape(np.zeros((n, n)), np.zeros(n), -level, (), Rest.NONE, -level, -level)
        return shape.scaled(sign).plus(nothing)

    rows = tuple(
        shifted(objectives[k], float(sign), float(level))
        for k, sign, level in zip(form.objective, form.sign, form.level, strict=True)
    )
    upper = tuple(
        shifted(shape, 1.0, float(bound))
        for shape, bound in zip(constraints, form.constraint_upper, strict=True)
        if np.isfinite(bound)
    )
    lower = tuple(
        shifted(shape, -1.0, -float(bound))
        for shape, bound in zip(constraints, form.constraint_lower, strict=True)
        if np.isfinite(bound)
    )
    if not all(shape.convex for shape in (*rows, *upper, *lower)):
        return None
    return ConvexRows(rows, upper, lower)


def _bends_down(form: MinMaxForm) -> bool:
    """Return whether some row has negative curvature at the start, which settles the matter without an analysis."""
    maps = [
        (form.objectives, zip(form.objective.tolist(), form.sign.tolist(), strict=True)),
        (form.constraints, ((i, 1.0) for i in np.flatnonzero(np.isfinite(form.constraint_upper)).tolist())),
        (form.constraints, ((i, -1.0) for i in np.flatnonzero(np.isfinite(form.constraint_lower)).tolist())),
    ]
    for values, rows in maps:
        for i, sign in rows:
            if not isinstance(values, SymbolicMap):
                return False
            hessian = values.hessian(form.start, sign * (np.arange(values.size) == i))
            if np.all(np.isfinite(hessian)):
                curvature = np.linalg.eigvalsh(hessian)
                if curvature[0] < -_BENT * np.max(np.abs(curvature)):
                    return True
    return False


def _shapes(form: MinMaxForm, values: SmoothMap) -> tuple[Shape, ...] | None:
    if not isinstance(values, SymbolicMap) or not values.function.is_a("SXFunction"):
        return None
    return _read(values.function, *(each.tobytes() for each in (values.p, form.lower, form.upper)))


# kept with the Function, so that another start, goal or weight needs no second analysis
@lru_cache(maxsize=64)
def _read(function: Any, p: bytes, lower: bytes, upper: bytes) -> tuple[Shape, ...] | None:
    try:
        return tuple(shapes_of(function, *(np.frombuffer(each) for each in (p, lower, upper))))
    except InputError:
        # an instruction that cannot be read: nothing is claimed
        return None
