"""Checks of a port: what flight code asks of its values, whether that fits together, and what is safe to return."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from optsat.port import Port

ASYMMETRY = 2.0**-26
"""Difference of two entries that a covariance may have by rounding, as a part of the mean of their diagonal entries."""


def fault_of_checks(port: "Port") -> str:
    """Return what is wrong with the checks of a port, or "" where nothing is."""
    square = len(port.shape) == 2 and port.shape[0] == port.shape[1]
    size = math.prod(port.shape)
    for name in ("unit_norm", "direction"):
        tolerance = getattr(port, name)
        if tolerance is not None and not (port.shape and 0.0 < tolerance < 1.0):
            return f"`{name}` must be a number in (0, 1), of a vector or of rows, got {tolerance}"
    if port.unit_norm is not None and port.direction is not None:
        return "`unit_norm` refuses other lengths and `direction` accepts them; give one of the two"
    if port.lower is not None and port.upper is not None and not port.lower < port.upper:
        return f"`lower` {port.lower} must be below `upper` {port.upper}"
    if not all(math.isfinite(limit) for limit in (port.lower, port.upper, port.padding) if limit is not None):
        return "limits and padding must be finite; leave out the limit that is none"
    if port.positive_definite and not square:
        return "only a square matrix can be positive definite"
    if port.verdict and port.shape:
        return "a verdict is one number, 1 or 0"
    if port.counted and not port.shape:
        return "a scalar has no rows to count"
    if port.padding is not None and not port.counted:
        return "`padding` fills the rows beyond a count; say `counted=True`"
    if isinstance(port.safe, tuple) and len(port.safe) != size:
        return f"`safe` must hold {size} numbers or one, got {len(port.safe)}"
    if not is_accepted(port, values := safe_values(port)):
        return f"the safe value {values} does not pass the port's own checks"
    return ""


def safe_values(port: "Port") -> tuple[float, ...]:
    """Return what a result holds when a check failed, matrices counted by rows."""
    size = math.prod(port.shape)
    if isinstance(port.safe, tuple):
        return port.safe
    if port.safe is not None:
        return (port.safe,) * size
    is_square = len(port.shape) == 2 and port.shape[0] == port.shape[1]
    if port.positive_definite or (port.unit_norm is not None and is_square):
        n = port.shape[0]
        return tuple(float(k % (n + 1) == 0) for k in range(size))
    if port.unit_norm is not None or port.direction is not None:
        length = port.shape[-1]
        # scalar last: of four, the identity quaternion
        one = length - 1 if length == 4 else 0
        return tuple(float(k % length == one) for k in range(size))
    low = -math.inf if port.lower is None else port.lower
    high = math.inf if port.upper is None else port.upper
    return (min(max(0.0, low), high),) * size


def is_accepted(port: "Port", values: tuple[float, ...]) -> bool:
    """Return whether the values, matrices counted by rows, pass the port's checks."""
    if not all(math.isfinite(value) for value in values):
        return False
    if port.lower is not None and min(values) < port.lower:
        return False
    if port.upper is not None and max(values) > port.upper:
        return False
    length = port.shape[-1] if port.shape else 1
    norms = [math.hypot(*values[k : k + length]) for k in range(0, len(values), length)]
    if port.unit_norm is not None and any(abs(norm - 1.0) > port.unit_norm for norm in norms):
        return False
    if port.direction is not None and min(norms) == 0.0:
        return False
    if port.positive_definite:
        n = port.shape[0]
        diagonal = [values[k * (n + 1)] for k in range(n)]
        if min(diagonal) <= 0.0:
            return False
        for i in range(n):
            for j in range(i):
                mean = diagonal[i] / 2 + diagonal[j] / 2
                below, above = values[i * n + j], values[j * n + i]
                if abs(below - above) > ASYMMETRY * mean or abs(below) > mean * (1.0 + ASYMMETRY):
                    return False
    return True
