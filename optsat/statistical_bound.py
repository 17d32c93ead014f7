"""Statistical bounds: angle bounds that all hold together with a chosen probability for Gaussian direction noise."""

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import InputError, explain_unknown_options


@explain_unknown_options
def statistical_angle_bound(sigma_rad: ArrayLike, probability: float) -> Array:
    """Return angle bounds (m,) [rad] that hold for all m directions together with at least the given probability.

    eps_i = sigma_i sqrt(-2 ln((1 - probability) / m)): the chi-square quantile of two tangent axes and the union
    bound, so the sensors need not be independent.

    sigma_rad : (m,) standard deviation of each direction per tangent axis, << 1 [rad]; probability : in (0, 1)

    Raises
    ------
    InputError : probability not in (0, 1), sigma_rad negative, not finite, or so large that a bound reaches pi.
    Source: robust Wahba specification, section 7.5.
    """
    sigma = finite_array("sigma_rad", sigma_rad, (None,), "rad")
    if not len(sigma):
        raise InputError("`sigma_rad` holds no deviations; one per direction is needed.")
    if np.any(sigma < 0):
        index = int(np.argmax(sigma < 0))
        raise InputError(f"`sigma_rad` must be >= 0 [rad]: index {index} is {sigma[index]:g}.")
    if not isinstance(probability, int | float) or not 0 < probability < 1:
        raise InputError(f"`probability` must be in (0, 1), got {probability!r}.")
    bound = sigma * np.sqrt(-2 * np.log((1 - probability) / len(sigma)))
    if np.any(bound >= np.pi):
        index = int(np.argmax(bound >= np.pi))
        raise InputError(
            f"`sigma_rad` index {index} is {sigma[index]:g} rad: its bound of {bound[index]:.3g} rad says nothing "
            "about a direction. Is it in degrees? Use numpy.deg2rad."
        )
    return np.asarray(bound)
