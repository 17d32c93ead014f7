"""Uncertain rows: functions of unknowns x and of u anywhere in a box, and at which corners they are surely largest."""

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from optsat.arrays import Array, Mask
from optsat.certificates.box_maximum import Row
from optsat.errors import InputError
from optsat.kernels.instructions import read_instructions
from optsat.kernels.program import Operation, Program
from optsat.symbolic.curvature import shapes_of
from optsat.symbolic.interval_evaluation import evaluate_over_box

# corners of one row above which a search inside the box takes their place
_MOST_CORNERS = 256
# operations with kinks or jumps, whose derivatives say nothing about curvature
_NOT_SMOOTH = frozenset(
    (
        *("FABS", "FMAX", "FMIN", "SIGN", "FLOOR", "CEIL", "FMOD", "REMAINDER", "COPYSIGN", "HYPOT", "ATAN2"),
        *("IF_ELSE_ZERO", "LT", "LE", "EQ", "NE", "NOT", "AND", "OR"),
    )
)


@dataclass(frozen=True)
class UncertainRow:
    """One function f(x, u, p).

    corners (c, m) : where its maximum over the box of u surely lies, whatever x in its bounds; None where not known
    """

    function: Any
    row: Row
    corners: Array | None


def uncertain_rows(
    values: Any, x: Any, u: Any, p: Any, boxes: list[tuple[Array, Array]], names: tuple[str, str] = ("objective", "u")
) -> list[UncertainRow]:
    """Return the rows of a column of SX expressions, each with its proof of where it is largest.

    boxes : bounds of x (may be infinite), of u and of p (equal: known)
    The largest value lies at a corner where f is convex in u: jointly with x, by the rules of composition; or in each
    component alone, by the sign of the second derivative over all boxes. A component in which f rises or falls
    throughout has one end only, one that f does not depend on its middle.

    Raises
    ------
    InputError : an operation that cannot be read.
    """
    import casadi as ca

    rows = []
    for i in range(values.numel()):
        value = values[i]
        gradient = ca.gradient(value, u)
        second = ca.vertcat(*(ca.gradient(gradient[k], u)[k] for k in range(u.numel())))
        arguments = [x, u, p]
        function = ca.Function("value", arguments, [ca.densify(value)])
        try:
            programs = [
                read_instructions(ca.Function("part", arguments, [ca.densify(each)]))
                for each in (value, gradient, second)
            ]
        except InputError as error:
            raise InputError(f"{names[0]} {i} cannot be bounded over a box of `{names[1]}`: {error}") from error
        row = Row(programs[0], programs[1])
        depends = np.array(ca.which_depends(value, u, 1, False)).reshape(-1).astype(np.bool_)
        rows.append(UncertainRow(function, row, _corners(value, arguments, programs, depends, boxes)))
    return rows


def _corners(
    value: Any, arguments: list[Any], programs: list[Program], depends: Mask, boxes: list[tuple[Array, Array]]
) -> Array | None:
    import casadi as ca

    lower, upper = boxes[1]
    smooth = not any(isinstance(node, Operation) and node.code in _NOT_SMOOTH for node in programs[0].nodes)
    rising = falling = convex = np.zeros(len(lower), dtype=np.bool_)
    if smooth:
        least, most = evaluate_over_box(programs[1], boxes)
        rising, falling = least >= 0, most <= 0
        convex = evaluate_over_box(programs[2], boxes)[0] >= 0
    if not np.all(~depends | rising | falling | convex):
        x, u, p = arguments
        together = ca.Function("value", [ca.vertcat(x, u), p], [ca.densify(value)])
        ends = [np.concatenate(each) for each in zip(boxes[0], boxes[1], strict=True)]
        if not shapes_of(together, boxes[2][0], *ends)[0].convex:
            return None
        convex = np.ones_like(convex)
    choices = [
        (0.5 * (low + high),) if not used else (high,) if up else (low,) if down else (low, high)
        for low, high, used, up, down in zip(lower, upper, depends, rising, falling, strict=True)
    ]
    if np.prod([len(each) for each in choices], dtype=np.float64) > _MOST_CORNERS:
        return None
    return np.array(list(product(*choices)))
