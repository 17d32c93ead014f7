"""Davenport matrix K of vector pairs, and the same quadratic form centred at an attitude."""

import numpy as np

from optsat.arrays import Array, cross_rows
from optsat.attitude import dcm, quaternion
from optsat.attitude.edges import unchecked

# inner-loop forms: their arguments come from this package, so the checks of the public edge are left out
rotation_matrix = unchecked(dcm.from_quaternion)
quaternion_from_dcm = unchecked(dcm.to_quaternion)
canonical = unchecked(quaternion.canonical)


def davenport_matrix(b_B: Array, r_N: Array, weights: Array) -> Array:
    """Return K (..., 4, 4), order [v; s], with q^T K q = sum_i w_i b_i . A(q) r_i.

    b_B, r_N : (..., m, 3), any length; weights : (..., m)
    Source: Davenport's q-method; Markley & Crassidis, Fundamentals of Spacecraft Attitude Determination, 5.3.
    """
    weighted = weights[..., None] * b_B
    B = np.einsum("...mi,...mj->...ij", weighted, r_N)
    trace = np.trace(B, axis1=-2, axis2=-1)
    K = np.empty((*B.shape[:-2], 4, 4))
    K[..., :3, :3] = B + np.swapaxes(B, -1, -2) - trace[..., None, None] * np.eye(3)
    z = np.stack((B[..., 1, 2] - B[..., 2, 1], B[..., 2, 0] - B[..., 0, 2], B[..., 0, 1] - B[..., 1, 0]), axis=-1)
    K[..., :3, 3] = z
    K[..., 3, :3] = z
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
    linear = cross_rows(u_B, y_B)
    outer = u_B[..., :, None] * y_B[..., None, :]
    dot = np.sum(u_B * y_B, axis=-1)
    block = outer + np.swapaxes(outer, -1, -2) - (dot + level)[..., None, None] * np.eye(3)
    return linear, block
