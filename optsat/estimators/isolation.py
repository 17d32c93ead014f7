"""Isolation: which measurements must go so that the others agree with their bounds."""

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import NormPolicy
from optsat.attitude import quaternion
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.status import AttitudeStatus
from optsat.determine import certify_attitude
from optsat.errors import InputError, explain_unknown_options

if TYPE_CHECKING:
    from optsat.problems.certified_attitude import CertifiedAttitude

_LARGEST_SEARCH = 12


@dataclass(frozen=True)
class Isolation:
    """Smallest sets of measurements whose removal leaves no proof of inconsistency.

    candidates : index sets of equal size, () alone when the data are consistent; none when removal does not help
    attitudes : the certified attitude without each candidate
    bound_rad : radius of a ball about `centre.q_BN` that holds the truth if any one candidate is the faulty set
    """

    candidates: tuple[tuple[int, ...], ...]
    attitudes: "tuple[CertifiedAttitude, ...]"
    centre: "CertifiedAttitude | None"
    bound_rad: float

    @property
    def isolated(self) -> bool:
        """Whether exactly one set explains the data."""
        return len(self.candidates) == 1


@explain_unknown_options
def isolate(
    b_B: ArrayLike,
    r_N: ArrayLike,
    angle_bound_rad: ArrayLike,
    *,
    most: int = 3,
    norm_policy: NormPolicy = "warn",
) -> Isolation:
    """Return the smallest sets of at most `most` measurements whose removal restores consistency, and the union bound.

    b_B, r_N : (m, 3) directions, m <= 12; angle_bound_rad : (m,) or scalar [rad]

    Raises
    ------
    InputError : input that cannot be used, more than 12 pairs, or `most` not in 0..m - 1.
    Source: robust Wahba specification, section 7.5; both consistency tests are one-sided proofs.
    """
    whole = certify_attitude(b_B, r_N, angle_bound_rad, norm_policy=norm_policy)
    data = whole.certificate.admissible
    m = data.cone_count
    if m > _LARGEST_SEARCH:
        raise InputError(f"`b_B` holds {m} pairs; the exhaustive search takes at most {_LARGEST_SEARCH}.")
    if isinstance(most, bool) or not isinstance(most, int) or not most >= 0:
        raise InputError(f"`most` must be an integer >= 0, got {most!r}.")
    if whole.status is not AttitudeStatus.INCONSISTENT:
        return Isolation(((),), (whole,), whole, whole.bound_rad)
    for size in range(1, min(most, m - 1) + 1):
        found = [
            (removed, attitude)
            for removed in itertools.combinations(range(m), size)
            if (attitude := _consistent(data.without(removed))) is not None
        ]
        if found:
            return _union(tuple(removed for removed, _ in found), tuple(attitude for _, attitude in found))
    return Isolation((), (), None, float("nan"))


def _consistent(data: AdmissibleSet) -> "CertifiedAttitude | None":
    if data.inconsistent_pairs():
        return None
    attitude = certify_attitude(data.b_B, data.r_N, data.angle_bound_rad, norm_policy="silent")
    return None if attitude.status is AttitudeStatus.INCONSISTENT else attitude


def _union(candidates: tuple[tuple[int, ...], ...], attitudes: "tuple[CertifiedAttitude, ...]") -> Isolation:
    q = np.stack([attitude.q_BN for attitude in attitudes])
    bounds = np.array([attitude.bound_rad for attitude in attitudes])
    reach = quaternion.error_angle(q[:, None, :], q[None, :, :]) + bounds[None, :]
    radius = np.minimum(reach.max(axis=1), np.pi)
    best = int(np.argmin(radius))
    return Isolation(candidates, attitudes, attitudes[best], float(radius[best]))
