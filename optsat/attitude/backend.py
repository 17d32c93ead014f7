"""Backend: the few operations that let one function body serve NumPy arrays `(..., n)` and CasADi columns `(n, 1)`."""

from collections.abc import Iterable
from typing import Any, TypeAlias

import numpy as np

# A NumPy array (or what converts to one) or a CasADi SX, MX or DM; CasADi carries no types, hence Any.
Value: TypeAlias = Any


def is_symbolic(*values: object) -> bool:
    """Return whether any value is a CasADi matrix, without importing CasADi."""
    return any(type(value).__module__.partition(".")[0] == "casadi" for value in values)


def components(value: Value) -> tuple[Value, ...]:
    """Return the entries along the last axis of an array, or the entries of a CasADi column."""
    if is_symbolic(value):
        return tuple(value[k] for k in range(value.numel()))
    return tuple(value[..., k] for k in range(value.shape[-1]))


def entries(matrix: Value) -> tuple[tuple[Value, ...], ...]:
    """Return the rows of entries of matrices (..., n, m)."""
    if is_symbolic(matrix):
        return tuple(tuple(matrix[i, j] for j in range(matrix.shape[1])) for i in range(matrix.shape[0]))
    return tuple(tuple(matrix[..., i, j] for j in range(matrix.shape[-1])) for i in range(matrix.shape[-2]))


def stack(parts: Iterable[Value]) -> Value:
    """Return scalars stacked along a new last axis, or as a CasADi column."""
    parts = tuple(parts)
    if is_symbolic(*parts):
        return _casadi().vertcat(*parts)
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def matrix(rows: Iterable[Iterable[Value]]) -> Value:
    """Return rows of scalars as matrices (..., n, m), or as a CasADi matrix."""
    grid = tuple(tuple(row) for row in rows)
    flat = tuple(entry for row in grid for entry in row)
    if is_symbolic(*flat):
        ca = _casadi()
        return ca.vertcat(*(ca.horzcat(*row) for row in grid))
    stacked = np.stack(np.broadcast_arrays(*flat), axis=-1)
    return stacked.reshape(*stacked.shape[:-1], len(grid), len(grid[0]))


def join(*vectors: Value) -> Value:
    """Return vectors joined along their last axis."""
    return stack(part for vector in vectors for part in components(vector))


def dot(a: Value, b: Value) -> Value:
    """Return the inner product along the last axis."""
    total: Value = 0
    for left, right in zip(components(a), components(b), strict=True):
        total = total + left * right
    return total


def cross(a: Value, b: Value) -> Value:
    """Return the vector product a x b."""
    (a1, a2, a3), (b1, b2, b3) = components(a), components(b)
    return stack((a2 * b3 - a3 * b2, a3 * b1 - a1 * b3, a1 * b2 - a2 * b1))


def scale(factor: Value, vector: Value) -> Value:
    """Return one factor per sample times a vector."""
    return stack(factor * part for part in components(vector))


def reciprocal(x: Value) -> Value:
    """Return 1 / x, which CasADi would turn into one division for each product with it."""
    return 0.5 / (0.5 * x) if is_symbolic(x) else 1 / x


def where(condition: Value, yes: Value, no: Value) -> Value:
    """Return `yes` where the condition holds, else `no`, for scalars; both are evaluated, so both must stay finite."""
    return _casadi().if_else(condition, yes, no) if is_symbolic(condition, yes, no) else np.where(condition, yes, no)


def sqrt(x: Value) -> Value:
    """Return the square root."""
    return _casadi().sqrt(x) if is_symbolic(x) else np.sqrt(x)


def sin(x: Value) -> Value:
    """Return the sine."""
    return _casadi().sin(x) if is_symbolic(x) else np.sin(x)


def cos(x: Value) -> Value:
    """Return the cosine."""
    return _casadi().cos(x) if is_symbolic(x) else np.cos(x)


def atan2(y: Value, x: Value) -> Value:
    """Return the angle of the point (x, y), in [-pi, pi]."""
    return _casadi().atan2(y, x) if is_symbolic(y, x) else np.arctan2(y, x)


def absolute(x: Value) -> Value:
    """Return the absolute value."""
    return _casadi().fabs(x) if is_symbolic(x) else np.abs(x)


def norm(vector: Value) -> Value:
    """Return the Euclidean length along the last axis."""
    return sqrt(dot(vector, vector))


def _casadi() -> Any:
    import casadi

    return casadi
