"""Davenport matrix K of vector pairs, and the same quadratic form centred at an attitude."""

import numpy as np

from optsat.arrays import Array, cross_rows
from optsat.attitude import dcm, quaternion
from optsat.attitude.edges import unchecked

# inner-loop forms: their arguments come from this package, so the checks of the public edge are left out
_rotation_matrices = unchecked(dcm.from_quaternion)
quaternion_from_dcm = unchecked(dcm.to_quaternion)
canonical = unchecked(quaternion.canonical)

_IDENTITY = np.eye(3)


def rotation_matrix(q_BN: Array) -> Array:
    """Return A(q_BN) (..., 3, 3) of quaternions that are unit to rounding."""
    if q_BN.ndim > 1:
        return np.asarray(_rotation_matrices(q_BN))
    # one attitude: the formula of `dcm.from_quaternion` on Python floats takes a tenth of the time, bit for bit the
    # same
    x, y, z, w = q_BN.tolist()
    return np.array(
        (
            (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
            (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
            (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
        )
    )


def davenport_matrix(b_B: Array, r_N: Array, weights: Array) -> Array:
    """Return K (..., 4, 4), order [v; s], with q^T K q = sum_i w_i b_i . A(q) r_i.

    b_B, r_N : (..., m, 3), any length; weights : (..., m)
    Source: Davenport's q-method; Markley & Crassidis, Fundamentals of Spacecraft Attitude Determination, 5.3.
    """
    weighted = weights[..., None] * b_B
    B = np.swapaxes(weighted, -1, -2) @ r_N
    trace = B[..., 0, 0] + B[..., 1, 1] + B[..., 2, 2]
    K = np.empty((*B.shape[:-2], 4, 4))
    K[..., :3, :3] = B + np.swapaxes(B, -1, -2) - trace[..., None, None] * _IDENTITY
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        K[..., k, 3] = K[..., 3, k] = B[..., i, j] - B[..., j, i]
    K[..., 3, 3] = trace
    return K


def pair_matrices(u_B: Array, w_N: Array) -> Array:
    """Return K(u, w) (..., 4, 4) of single pairs with weight 1, so that q^T K(u, w) q = u . A(q) w."""
    return davenport_matrix(u_B[..., None, :], w_N[..., None, :], np.ones((*u_B.shape[:-1], 1)))


def dominant_quaternion(K: Array) -> Array:
    """Return the unit eigenvector(s) (..., 4) of the largest eigenvalue of symmetric K (..., 4, 4)."""
    return np.asarray(np.linalg.eigh(K)[1][..., -1])


def turn(q_BN: Array, gibbs: Array) -> Array:
    """Return the unit quaternion [g; 1] (x) q_BN: `q_BN` turned by the Gibbs vector g = tan(angle/2) axis in B.

    q_BN : (..., 4); gibbs : (..., 3)
    """
    v, s = q_BN[..., :3], q_BN[..., 3:]
    turned = np.concatenate(
        (v + s * gibbs - cross_rows(gibbs, v), s - np.sum(gibbs * v, axis=-1, keepdims=True)), axis=-1
    )
    return np.asarray(turned / np.linalg.norm(turned, axis=-1, keepdims=True))


def centred_blocks(u_B: Array, y_B: Array, level: Array) -> tuple[Array, Array]:
    """Return the first row's vector part and the 3x3 block of K(u, w) - level I in (1, g) coordinates about an
    attitude.

    With y = A(q) w and q' = [g; 1] (x) q, unnormalised:
    q'^T (K(u, w) - level I) q' = (u.y - level) + 2 g.(u x y) + g^T [u y^T + y u^T - (u.y + level) I] g.

    u_B, y_B : (..., m, 3); level : (..., m). The scalar entry is left to the caller, who knows a form without
    cancellation.
    """
    outer = u_B[..., :, None] * y_B[..., None, :]
    dot = outer[..., 0, 0] + outer[..., 1, 1] + outer[..., 2, 2]
    block = outer + np.swapaxes(outer, -1, -2) - (dot + level)[..., None, None] * _IDENTITY
    return cross_rows(u_B, y_B), block
