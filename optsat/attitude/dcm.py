"""Direction cosine matrices: dcm_BN = A(q_BN) maps N components to B components."""

from optsat.attitude.backend import Value, components, entries, matrix, norm, reciprocal, scale, stack, where
from optsat.attitude.edges import QUATERNION, ROTATION_MATRIX, checked, unchecked
from optsat.attitude.quaternion import canonical


@checked(q_BN=QUATERNION)
def from_quaternion(q_BN: Value) -> Value:
    """Return A(q) = (s^2 - v.v) I + 2 v v^T - 2 s [v x] (..., 3, 3)."""
    x, y, z, w = components(q_BN)
    return matrix(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
            (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
            (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
        )
    )


@checked(dcm_BN=ROTATION_MATRIX)
def to_quaternion(dcm_BN: Value) -> Value:
    """Return q_BN (..., 4), canonical sign, by the largest column of 4 q q^T, so that no rotation is badly conditioned.

    Raises
    ------
    InputError : not orthogonal to 1e-6, or a reflection.
    Source: Shepperd, Quaternion from rotation matrix, J. Guidance and Control 1 (1978).
    """
    (a11, a12, a13), (a21, a22, a23), (a31, a32, a33) = entries(dcm_BN)
    trace = a11 + a22 + a33
    xy, xz, yz = a12 + a21, a13 + a31, a23 + a32
    xw, yw, zw = a23 - a32, a31 - a13, a12 - a21
    xx, yy, zz, ww = 1 + 2 * a11 - trace, 1 + 2 * a22 - trace, 1 + 2 * a33 - trace, 1 + trace
    column: tuple[Value, ...] = (xw, yw, zw, ww)
    largest = ww
    for size, candidate in ((xx, (xx, xy, xz, xw)), (yy, (xy, yy, yz, yw)), (zz, (xz, yz, zz, zw))):
        larger = size > largest
        largest = where(larger, size, largest)
        column = tuple(where(larger, new, old) for new, old in zip(candidate, column, strict=True))
    q = stack(column)
    return unchecked(canonical)(scale(reciprocal(norm(q)), q))
