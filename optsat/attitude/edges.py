"""Edges: what a public attitude function demands of numeric arguments; CasADi values pass untouched."""

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import ParamSpec, TypeVar

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.attitude.backend import is_symbolic
from optsat.errors import InputError

P = ParamSpec("P")
R = TypeVar("R")

TOLERANCE = 1e-6
_ROUNDING = 1e-15


def _as_it_is(name: str, array: Array) -> Array:
    return array


@dataclass(frozen=True)
class Kind:
    """One kind of argument: its trailing shape, its unit, and a check that may repair rounding."""

    shape: tuple[int, ...]
    unit: str = "-"
    check: Callable[[str, Array], Array] = _as_it_is

    def convert(self, name: str, value: object) -> Array:
        """Return the value as a finite float64 array (..., *shape) of this kind.

        Raises
        ------
        InputError : not numeric, not finite, of the wrong trailing shape, or refused by the check.
        """
        array = finite_array(name, value, unit=self.unit)  # type: ignore[arg-type]
        trailing = array.shape[array.ndim - len(self.shape) :] if array.ndim >= len(self.shape) else None
        if trailing != self.shape:
            expected = ", ".join(["...", *map(str, self.shape)])
            columns = array.ndim == 2 and len(self.shape) == 1 and array.shape[0] == self.shape[0]
            hint = " Did you pass columns? Use `.T`." if columns else ""
            raise InputError(f"`{name}` must have shape ({expected}) [{self.unit}], got {array.shape}.{hint}")
        return self.check(name, array)


def _unit_quaternion(name: str, q: Array) -> Array:
    norm = np.sqrt(np.sum(q * q, axis=-1, keepdims=True))
    deviation = np.abs(norm - 1)[..., 0]
    if np.any(deviation > TOLERANCE):
        raise InputError(
            f"`{name}` must hold unit quaternions (scalar last): {_first(deviation > TOLERANCE)}norm was "
            f"{float(norm[..., 0][deviation > TOLERANCE][0]):.6g}. Divide by the norm if that is meant."
        )
    # a quaternion that is unit to rounding keeps its bits
    return np.where(np.abs(norm - 1) <= _ROUNDING, q, q / norm)


def _rotation(name: str, dcm: Array) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        defect = np.abs(dcm @ np.swapaxes(dcm, -1, -2) - np.eye(3)).max(axis=(-2, -1))
    bad = ~(defect <= TOLERANCE)
    if np.any(bad):
        raise InputError(
            f"`{name}` must hold rotation matrices: {_first(bad)}|A A^T - I| was {float(defect[bad][0]):.3g}, allowed "
            f"{TOLERANCE:g}. Orthogonalise it first (nearest rotation by SVD) if that is meant."
        )
    reflected = np.linalg.det(dcm) < 0
    if np.any(reflected):
        raise InputError(
            f"`{name}` must hold rotation matrices: {_first(reflected)}determinant was -1, a reflection. "
            "Check the handedness of the axes."
        )
    return dcm


def _non_zero(name: str, vector: Array) -> Array:
    zero = ~np.any(vector != 0, axis=-1)
    if np.any(zero):
        raise InputError(f"`{name}` must not be the zero vector: {_first(zero) or 'it '}is.")
    return vector


def _first(bad: Array | np.bool_) -> str:
    """Return where the first bad sample is; nothing for a single sample."""
    if np.ndim(bad) == 0:
        return ""
    index = tuple(int(i) for i in np.argwhere(bad)[0])
    return f"row {index[0] if len(index) == 1 else index} "


QUATERNION = Kind((4,), "-", _unit_quaternion)
ROTATION_MATRIX = Kind((3, 3), "-", _rotation)
VECTOR = Kind((3,))
NON_ZERO = Kind((3,), "-", _non_zero)
RATE = Kind((3,), "rad/s")
POSITION = Kind((3,), "m", _non_zero)
VELOCITY = Kind((3,), "m/s", _non_zero)
ANGLES = Kind((3,), "rad")
ANGLE = Kind((), "rad")
TIME = Kind((), "s")


def checked(**kinds: Kind) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function so that its numeric arguments are converted, checked by kind and broadcastable.

    Raises
    ------
    InputError : names the argument, its first bad row and what is expected; never raised for CasADi values.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        signature = inspect.signature(function)

        @functools.wraps(function)
        def at_edge(*args: P.args, **kwargs: P.kwargs) -> R:
            bound = signature.bind(*args, **kwargs)
            batches = {}
            for name, kind in kinds.items():
                value = bound.arguments[name]
                if not is_symbolic(value):
                    array = kind.convert(name, value)
                    bound.arguments[name] = array
                    batches[name] = array.shape[: array.ndim - len(kind.shape)]
            _check_batches(function.__name__, batches)
            return function(*bound.args, **bound.kwargs)

        return at_edge

    return decorate


def unchecked(function: Callable[P, R]) -> Callable[P, R]:
    """Return the body of a checked function, for inner loops whose arguments are known to be good."""
    body: Callable[P, R] = inspect.unwrap(function)
    return body


def _check_batches(function: str, batches: dict[str, tuple[int, ...]]) -> None:
    try:
        np.broadcast_shapes(*batches.values())
    except ValueError:
        listed = ", ".join(f"`{name}` {batch}" for name, batch in batches.items())
        raise InputError(f"{function}: the sample axes do not fit together: {listed}.") from None
