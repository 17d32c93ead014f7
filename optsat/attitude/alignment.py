"""Wahba's loss near an attitude, evaluated from the vectors so that weight ratios of 1e16 lose nothing.

Eigenvectors of K and singular vectors of B lose the lighter vectors when the gap of K falls below rounding; the
gradient and Hessian formed here, in a body basis whose first axis is the heaviest vector, do not.
"""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, cross_rows
from optsat.attitude.davenport import rotation_matrix, turn

_UNIT_ROUNDOFF = 2.0**-53


@dataclass(frozen=True)
class Curvature:
    """Second-order picture of Wahba's loss at an attitude.

    step : (3,) Newton step (Gauss-Newton where the Hessian is not positive), Gibbs vector in B axes [-]; NaN at a
    flat optimum
    sharpness : least eigenvalue of the diagonally scaled Hessian over its own rounding error; > 1 proves a strict
    minimum
    free_axes_B : (k, 3) rotation axes along which the loss is flat to rounding, k = 0 at a strict minimum
    gradient : (3,) of the loss along the basis axes, relative to the square root of the Hessian's diagonal
    amplification : radians of answer per radian of data error, an upper estimate [-]
    """

    step: Array
    sharpness: float
    free_axes_B: Array
    gradient: Array
    amplification: float


def heaviest_first_basis(b_B: Array, weights: Array) -> Array:
    """Return a right-handed orthonormal basis (3, 3), rows, whose first row is exactly the heaviest vector."""
    first = b_B[int(np.argmax(weights))]
    helper = np.zeros(3)
    helper[int(np.argmin(np.abs(first)))] = 1.0
    second = cross_rows(first, helper)
    second /= np.linalg.norm(second)
    return np.stack((first, second, cross_rows(first, second)))


def curvature(b_B: Array, r_N: Array, weights: Array, q_BN: Array) -> Curvature:
    """Return gradient, Hessian and Newton step of Wahba's loss at q_BN.

    Loss along [g; 1] (x) q: const - 2 g.sum w (b x y) + g^T H g + ..., H = sum w [2 (b.y) I - b y^T - y b^T], y =
    A(q) r; entries as (b x e_i).(y x e_j) + (y x e_i).(b x e_j), free of cancellation for vectors near an axis.
    """
    y = r_N @ rotation_matrix(q_BN).T
    basis = heaviest_first_basis(b_B, weights)
    b_cross = cross_rows(b_B[:, None, :], basis[None, :, :])
    y_cross = cross_rows(y[:, None, :], basis[None, :, :])
    # b . (b x e) = 0, so y - b may stand for y: the rounding of a nearly parallel cross product then meets a small
    # vector
    gradient = -np.einsum("m,mic,mc->i", weights, b_cross, y - b_B)
    product = np.einsum("m,mic,mjc->ij", weights, b_cross, y_cross)
    hessian = product + product.T

    b_size, y_size = np.linalg.norm(b_cross, axis=-1), np.linalg.norm(y_cross, axis=-1)
    u = 8 * _UNIT_ROUNDOFF
    # rounding of the products, and of the vectors themselves (one ulp each)
    noise = u * np.einsum("m,mi,mj->ij", weights, b_size + u, y_size + u) + u * np.einsum(
        "m,mij->ij", weights, b_size[:, :, None] * u + u * y_size[:, None, :] + u * u
    )
    noise = noise + noise.T + 2 * u * u * weights.sum()
    values, vectors, scale = _scaled_eigen(hessian, noise)
    uncertainty = np.einsum("ik,ij,jk->k", np.abs(vectors), noise * np.outer(scale, scale), np.abs(vectors))
    uncertainty += 16 * _UNIT_ROUNDOFF
    flat = np.abs(values) <= uncertainty
    free = (vectors[:, flat].T * scale) @ basis
    if len(free):
        free = np.linalg.qr(free.T)[0].T
    sharpness = float(np.min(values / uncertainty))
    if sharpness <= 1 and not flat.any():
        # not convex here: the Gauss-Newton matrix is, and leads to where the heavy vectors agree
        gauss_newton = 2 * np.einsum("m,mic,mjc->ij", weights, y_cross, y_cross)
        values, vectors, scale = _scaled_eigen(gauss_newton, noise)
    step = np.full(3, np.nan)
    if not flat.any() and values[0] > 0:
        step = (scale * (vectors @ ((vectors.T @ (scale * gradient)) / values))) @ basis
    amplification = np.inf
    if sharpness > 1:
        inverse = scale[:, None] * (vectors / values) @ vectors.T * scale
        response = np.einsum("ij,m,mjc->mic", inverse, weights, b_cross)
        amplification = float(2 * np.linalg.norm(response, axis=(1, 2)).sum())
    return Curvature(step, sharpness, free, scale * gradient, amplification)


def _scaled_eigen(matrix: Array, noise: Array) -> tuple[Array, Array, Array]:
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(matrix)), np.diag(noise)))
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    return values, vectors, scale


def polish(b_B: Array, r_N: Array, weights: Array, q_BN: Array, steps: int = 20) -> tuple[Array, Curvature]:
    """Return q_BN refined by Newton steps on Wahba's loss, and the curvature there.

    A strict local minimum of Wahba's loss is its global minimum (stationary points are the eigenvectors of K), so a
    Hessian that is positive beyond its rounding error proves the answer.
    """
    here = curvature(b_B, r_N, weights, q_BN)
    for _ in range(steps):
        length = float(np.linalg.norm(here.step))
        if not np.isfinite(length):
            break
        q_BN = turn(q_BN, here.step * min(1.0, 1.0 / length) if length > 0 else here.step)
        here = curvature(b_B, r_N, weights, q_BN)
        if length < 4 * _UNIT_ROUNDOFF:
            break
    return q_BN, here


def loss(b_B: Array, r_N: Array, weights: Array, q_BN: Array) -> float:
    """Return Wahba's loss 1/2 sum w |b - A(q) r|^2 [-]."""
    gap = b_B - r_N @ rotation_matrix(q_BN).T
    return float(0.5 * np.sum(weights * np.sum(gap * gap, axis=-1)))


def starting_weights(weights: Array) -> Array:
    """Return weights whose ratio is mild enough for an eigenvector of K: the fourth root when the ratio exceeds 1e4."""
    positive = weights[weights > 0]
    if float(positive.max() / positive.min()) <= 1e4:
        return weights
    root = np.where(weights > 0, weights, 0.0) ** 0.25
    return np.asarray(root / root.sum())


def smallest_rotation(q_BN: Array, free_axes_B: Array) -> Array:
    """Return the smallest rotation in the optimal set spanned by q_BN and its turns about the free axes."""
    tangent = [_tangent(q_BN, axis) for axis in free_axes_B]
    span = np.linalg.qr(np.stack([q_BN, *tangent]).T)[0]
    projected = span @ span[3]
    norm = float(np.linalg.norm(projected))
    return np.asarray(projected / norm) if norm > 1e-8 else q_BN


def _tangent(q_BN: Array, axis_B: Array) -> Array:
    v, s = q_BN[:3], q_BN[3]
    return np.concatenate((s * axis_B - cross_rows(axis_B, v), [-float(axis_B @ v)]))
