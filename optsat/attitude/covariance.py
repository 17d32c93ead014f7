"""First-order covariance of a weighted vector attitude."""

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import InputError


def attitude_covariance(b_B: Array, weights: Array, sigma_rad: ArrayLike) -> Array:
    """Return the covariance (3, 3) [rad^2] in B of the Wahba attitude with weights (m,) under independent direction
    noise.

    P = H^-1 (sum w^2 sigma^2 (I - b b^T)) H^-1, H = sum w (I - b b^T); equals (sum (I - b b^T) / sigma^2)^-1 at w =
    1 / sigma^2.

    b_B : (m, 3) unit; sigma_rad : (m,) or scalar, standard deviation of each direction per tangent axis [rad]

    Raises
    ------
    InputError : sigma_rad negative, not finite or of the wrong length, or the directions leave a rotation free.
    Source: Markley & Crassidis, Fundamentals of Spacecraft Attitude Determination, 5.5.
    """
    sigma = finite_array("sigma_rad", sigma_rad, unit="rad")
    if sigma.ndim == 0:
        sigma = np.full(len(b_B), float(sigma))
    if sigma.shape != (len(b_B),):
        raise InputError(f"`sigma_rad` must have shape ({len(b_B)},) [rad], got {sigma.shape}.")
    if np.any(sigma < 0) or np.any(sigma >= np.pi):
        index = int(np.argmax((sigma < 0) | (sigma >= np.pi)))
        raise InputError(
            f"`sigma_rad` must be in [0, pi) [rad]: index {index} is {sigma[index]:g}."
            + (" This looks like degrees; use numpy.deg2rad." if sigma[index] >= np.pi else "")
        )
    tangent = np.eye(3) - b_B[:, :, None] * b_B[:, None, :]
    information = np.einsum("m,mij->ij", weights, tangent)
    if float(np.linalg.eigvalsh(information)[0]) < 1e-15:
        raise InputError(
            "The covariance does not exist: the weighted directions are collinear, so the rotation about "
            f"{np.array2string(b_B[int(np.argmax(weights))], precision=6)} in B is undetermined. Add "
            "a direction off that axis."
        )
    spread = np.einsum("m,mij->ij", (weights * sigma) ** 2, tangent)
    inverse = np.linalg.inv(information)
    covariance = inverse @ spread @ inverse
    return np.asarray((covariance + covariance.T) / 2)
