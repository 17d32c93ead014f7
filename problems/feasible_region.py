"""Feasible region: bounds, linear and nonlinear constraints on the unknowns, checked and named."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import InputError
from optsat.forms import MinMaxForm


@dataclass(frozen=True)
class LinearRows:
    """lower <= A x <= upper; the first `inequalities` rows are the user's `A`, the others `Aeq`."""

    A: Array
    lower: Array
    upper: Array
    inequalities: int


def bounds(names: tuple[str, str], lower: ArrayLike | None, upper: ArrayLike | None, n: int) -> tuple[Array, Array]:
    """Return lower and upper bounds (n,), infinite where None; a scalar is repeated.

    Raises
    ------
    InputError : wrong length, NaN, an infinite bound on the wrong side, or lower > upper.
    """
    low, high = _bound(names[0], lower, n, -np.inf), _bound(names[1], upper, n, np.inf)
    if np.any(low > high):
        i = int(np.argmax(low > high))
        raise InputError(
            f"`{names[0]}` must not exceed `{names[1]}`: at index {i} they are {low[i]:g} and {high[i]:g}."
        )
    return low, high


def _bound(name: str, value: ArrayLike | None, n: int, absent: float) -> Array:
    if value is None:
        return np.full(n, absent)
    try:
        raw = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"`{name}` must hold numbers, got {value!r}.") from None
    if raw.shape not in ((), (n,)):
        raise InputError(f"`{name}` must be a scalar or of shape ({n},), got {raw.shape}.")
    array = np.array(np.broadcast_to(raw, (n,)))
    wrong = np.isnan(array) | (array == -absent)
    if wrong.any():
        i = int(np.argmax(wrong))
        raise InputError(f"`{name}` must hold numbers, or {absent:g} for no bound: index {i} is {array[i]:g}.")
    return array


def linear_rows(
    A: ArrayLike | None, b: ArrayLike | None, Aeq: ArrayLike | None, beq: ArrayLike | None, n: int
) -> LinearRows:
    """Return A x <= b and Aeq x = beq as rows.

    Raises
    ------
    InputError : a matrix without its right side or the reverse, wrong shapes, not finite.
    """
    upper_part, equal_part = _system(("A", "b"), A, b, n), _system(("Aeq", "beq"), Aeq, beq, n)
    return LinearRows(
        A=np.vstack((upper_part[0], equal_part[0])),
        lower=np.concatenate((np.full(len(upper_part[1]), -np.inf), equal_part[1])),
        upper=np.concatenate((upper_part[1], equal_part[1])),
        inequalities=len(upper_part[1]),
    )


def _system(names: tuple[str, str], matrix: ArrayLike | None, right: ArrayLike | None, n: int) -> tuple[Array, Array]:
    if matrix is None and right is None:
        return np.zeros((0, n)), np.zeros(0)
    if matrix is None or right is None:
        given, lacking = names if right is None else names[::-1]
        raise InputError(f"`{given}` was given without `{lacking}`.")
    rows = finite_array(names[0], np.atleast_2d(np.asarray(matrix)), (None, n))
    side = finite_array(names[1], np.atleast_1d(np.asarray(right)))
    if side.shape != (len(rows),):
        raise InputError(
            f"`{names[1]}` must have shape ({len(rows)},), one number per row of `{names[0]}`, got {side.shape}."
        )
    return rows, side


def named_rows(form: MinMaxForm, inequalities: int) -> list[str]:
    """Return the names of all entries of the form's `dual`, as a user knows them."""
    sides = ["at most" if sign > 0 else "at least" for sign in form.sign]
    return [
        *(
            f"{'hard goal' if weight == 0 else 'objective'} {k} ({side})"
            for k, side, weight in zip(form.objective, sides, form.weight, strict=True)
        ),
        *(f"constraint {i}" for i in range(form.constraints.size)),
        *(f"A row {i}" if i < inequalities else f"Aeq row {i - inequalities}" for i in range(len(form.A))),
        *(f"bound of x[{i}]" for i in range(len(form.lower))),
    ]
