"""Checked conversions from user input to float64 arrays; every refusal names the argument and the first bad row."""

from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optsat.errors import InputError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
NormPolicy = Literal["warn", "error", "silent"]


def finite_array(name: str, value: ArrayLike, shape: tuple[int | None, ...] | None = None, unit: str = "-") -> Array:
    """Return `value` as a float64 array of the given shape (None = any length), all entries finite.

    Raises
    ------
    InputError : not numeric, complex, masked, of the wrong shape, or not finite (first bad index named).
    """
    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        first = tuple(int(i) for i in np.argwhere(np.ma.getmaskarray(value))[0])
        raise InputError(
            f"`{name}` has a masked entry at index {first}. Drop the row or fill it; a mask is not a number."
        )
    try:
        raw = np.asarray(value)
    except ValueError:
        raise InputError(
            f"`{name}` must be a rectangular array of numbers [{unit}]; its rows differ in length."
        ) from None
    if np.iscomplexobj(raw):
        raise InputError(f"`{name}` must be real [{unit}], got complex numbers.")
    if raw.dtype == bool or raw.dtype.kind in "SUMm":
        raise InputError(f"`{name}` must hold numbers [{unit}], got {raw.dtype}{_first_text(raw)}.")
    try:
        array = np.array(raw, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"`{name}` must hold numbers [{unit}]{_first_text(raw)}.") from None
    if shape is not None:
        _check_shape(name, array, shape, unit)
    bad = ~np.isfinite(array)
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        where = f"row {index[0]}" if len(index) > 1 else f"index {index[0]}" if index else "the value"
        count = int(bad.sum())
        raise InputError(
            f"`{name}` must be finite [{unit}]: {where} holds {array[index]}"
            + (f" ({count} such entries in all)" if count > 1 else "")
            + ". Drop or repair the sample; optsat never computes with it."
        )
    return array


def _first_text(raw: NDArray[Any]) -> str:
    for index, item in np.ndenumerate(raw):
        if isinstance(item, str | bytes):
            place = tuple(int(i) for i in index)
            where = f"entry {place[0] if len(place) == 1 else place} is " if place else ""
            return f": {where}{str(item)!r}"
    return ""


def _check_shape(name: str, array: Array, shape: tuple[int | None, ...], unit: str) -> None:
    fits = array.ndim == len(shape) and all(
        want is None or want == got for want, got in zip(shape, array.shape, strict=True)
    )
    if fits:
        return
    # the free axes are (m, ...) or (n, m, ...)
    free = iter("nm"[-sum(want is None for want in shape) :])
    sizes = ", ".join(next(free) if want is None else str(want) for want in shape)
    expected = f"({sizes}{',' if len(shape) == 1 else ''})"
    hint = ""
    if array.ndim == len(shape) >= 2 and shape[-1] == array.shape[-2] != array.shape[-1]:
        hint = f" Did you pass columns? Use `{'.T' if array.ndim == 2 else 'numpy.swapaxes(..., -1, -2)'}`."
    raise InputError(f"`{name}` must have shape {expected} [{unit}], got {array.shape}.{hint}")


def cross_rows(a: Array, b: Array) -> Array:
    """Return a x b along the last axis (..., 3), broadcast: a tenth of `numpy.cross`'s overhead on small arrays."""
    a1, a2, a3 = a[..., 0], a[..., 1], a[..., 2]
    b1, b2, b3 = b[..., 0], b[..., 1], b[..., 2]
    first = a2 * b3 - a3 * b2
    product = np.empty((*first.shape, 3))
    product[..., 0] = first
    product[..., 1] = a3 * b1 - a1 * b3
    product[..., 2] = a1 * b2 - a2 * b1
    return product


def direction_pairs(
    b_B: ArrayLike, r_N: ArrayLike, norm_policy: NormPolicy = "warn", names: tuple[str, str] = ("b_B", "r_N")
) -> tuple[Array, Array]:
    """Return measured and reference directions as (m, 3) arrays of unit rows.

    Raises
    ------
    InputError : shapes differ or are not (m, 3), m = 0, a zero vector, not finite.
    """
    shapes = []
    for value in (b_B, r_N):
        try:
            shapes.append(np.shape(value))
        except ValueError:
            shapes.append(())
    if len(shapes[0]) == 2 and shapes[0] == shapes[1] and shapes[0][0] == 3 and shapes[0][1] != 3:
        raise InputError(
            f"`{names[0]}` and `{names[1]}` must both be (m, 3) arrays of row vectors, got "
            f"{shapes[0]} and {shapes[1]}. "
            "Did you pass columns? Use `.T`."
        )
    if len(shapes[0]) > 0 and shapes[0][0] == 0:
        raise InputError(f"`{names[0]}` holds no vectors; at least one row of shape (m, 3) is needed.")
    b = unit_rows(names[0], b_B, norm_policy)
    r = unit_rows(names[1], r_N, norm_policy)
    if len(b) != len(r):
        raise InputError(
            f"`{names[0]}` and `{names[1]}` must hold the same number of vectors, got {len(b)} and {len(r)}: "
            "row i of one is the same direction as row i of the other."
        )
    return b, r


def unit_rows(name: str, value: ArrayLike, norm_policy: NormPolicy = "warn") -> Array:
    """Return (..., 3) vectors scaled to length 1, safe from 1e-300 to 1e300.

    `norm_policy`: "warn" (one warning when a length differs from 1 by more than 0.05), "error" (raise above 1e-3),
    "silent".
    """
    array = finite_array(name, value)
    if array.ndim < 2 or array.shape[-1] != 3:
        _check_shape(name, array, (None, 3), "-")
    return normalise_rows(name, array, norm_policy)


def normalise_rows(name: str, array: Array, norm_policy: NormPolicy = "silent") -> Array:
    """Scale finite (..., 3) vectors to length 1; lengths carry no meaning, zero vectors are refused."""
    if norm_policy not in ("warn", "error", "silent"):
        raise InputError(f"`norm_policy` must be 'warn', 'error' or 'silent', got {norm_policy!r}.")
    largest = np.max(np.abs(array), axis=-1, keepdims=True)
    if not np.all(largest > 0.0):
        index = tuple(int(i) for i in np.argwhere(largest[..., 0] == 0.0)[0])
        raise InputError(
            f"`{name}` row {index[0] if len(index) == 1 else index} is the zero vector, which has no direction."
        )
    scaled = array / largest
    length = np.sqrt(np.sum(scaled * scaled, axis=-1, keepdims=True))
    if norm_policy != "silent":
        with np.errstate(over="ignore", under="ignore"):
            deviation = np.abs(length * largest - 1.0)[..., 0]
        index = tuple(int(i) for i in np.unravel_index(int(np.argmax(deviation)), deviation.shape))
        worst, norm = float(deviation[index]), float((length * largest)[..., 0][index])
        where = index[0] if len(index) == 1 else index
        if norm_policy == "error" and worst > 1e-3:
            raise InputError(
                f"`{name}` must hold unit vectors; row {where} has norm {norm:.6g}. Normalise it or "
                "use norm_policy='warn'."
            )
        if norm_policy == "warn" and worst > 0.05:
            import warnings

            warnings.warn(
                f"`{name}` row {where} has norm {norm:.4g}; vectors are scaled to length 1 (pass "
                "norm_policy='silent' to accept).",
                stacklevel=4,
            )
    return np.asarray(scaled / length)


def angle_bounds(name: str, value: ArrayLike, count: int) -> Array:
    """Return one angle bound per pair [rad], each in [0, pi); a scalar is repeated.

    Raises
    ------
    InputError : wrong count, not finite, negative, or not below pi (hint: degrees).
    """
    array = finite_array(name, value, unit="rad")
    if array.ndim == 0:
        array = np.full(count, float(array))
    if array.shape != (count,):
        raise InputError(f"`{name}` must hold one bound per vector pair: shape ({count},) [rad], got {array.shape}.")
    if np.any(array < 0.0):
        index = int(np.argmax(array < 0.0))
        raise InputError(f"`{name}` must be >= 0 [rad]: index {index} is {array[index]:g}.")
    if np.any(array >= np.pi):
        index = int(np.argmax(array >= np.pi))
        raise InputError(
            f"`{name}` must be below pi [rad]: index {index} is {array[index]:g}. This looks like "
            "degrees; use numpy.deg2rad."
        )
    return array


def pair_weights(name: str, value: ArrayLike | None, count: int) -> Array:
    """Return weights >= 0 scaled to sum 1 (equal when None), safe for denormal and huge entries.

    Raises
    ------
    InputError : wrong count, not finite, negative, or all zero.
    """
    if value is None:
        return np.full(count, 1.0 / count)
    array = finite_array(name, value)
    if array.shape != (count,):
        raise InputError(f"`{name}` must hold one weight per vector pair: shape ({count},), got {array.shape}.")
    if np.any(array < 0.0):
        index = int(np.argmax(array < 0.0))
        raise InputError(f"`{name}` must be >= 0: index {index} is {array[index]:g}. Drop a pair by weight 0.")
    largest = float(array.max())
    if largest == 0.0:
        raise InputError(f"`{name}` are all zero; at least one must be positive.")
    scaled = np.ldexp(array, -np.frexp(largest)[1])
    return np.asarray(scaled / scaled.sum())


def unit_quaternion(name: str, value: ArrayLike, tolerance: float = 1e-6) -> Array:
    """Return a (4,) quaternion of length 1, scalar last.

    Raises
    ------
    InputError : not (4,), not finite, zero, or length off by more than `tolerance`.
    """
    q = finite_array(name, value, (4,))
    norm = float(np.linalg.norm(q))
    if abs(norm - 1.0) > tolerance:
        raise InputError(
            f"`{name}` must be a unit quaternion (scalar last): norm was {norm:.6g}. Divide by the "
            "norm if that is meant."
        )
    return np.asarray(q / norm)
