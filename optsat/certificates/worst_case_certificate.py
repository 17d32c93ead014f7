"""Worst-case certificate: an attitude, its worst-case loss over component boxes, and what no attitude can undercut.

Mix the corners of each pair's boxes with shares mu >= 0 that sum to the pair's weight. For every attitude the mixed
loss sum_v mu_v 1/2 |b_v - A r_v|^2 is at most the worst-case loss, and it is itself a Wahba loss, whose least value
over all attitudes is an eigenvalue. So every mixture proves a lower bound, whoever found it.
"""

import json
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.box_corners import BoxCorners
from optsat.certificates.certificate import Verdict
from optsat.certificates.stored_fields import StoredFields
from optsat.errors import CertificateFormatError

FORMAT = "optsat-worst-case-certificate/1"
_ROUNDOFF = 2.0**-53


@dataclass(frozen=True)
class LossBound:
    """What a mixture of corners proves about an attitude.

    loss : worst-case loss of the attitude; least : no attitude has less, rounding allowed for
    distance_rad : every attitude whose worst-case loss is no more than `loss` is this near, pi when nothing is proven
    """

    loss: float
    least: float
    distance_rad: float


def loss_bound(corners: BoxCorners, shares: Array, q_BN: Array) -> LossBound:
    """Return what the shares (S,) >= 0, summed by pair to the weights, prove about q_BN.

    With a + 2 h.g + g^T C g the mixed loss about q_BN and c the least eigenvalue of C, every attitude at the angle
    theta has the mixed loss a cos^2 - 2 |h| cos sin + c sin^2 of theta / 2 or more.
    """
    loss = corners.worst_case_loss(q_BN)
    a, h, C = corners.mixture(shares, q_BN)
    # data of order one are known to an ulp, sums of products of them to some more
    count = len(shares) + 40
    pad = 4 * count * _ROUNDOFF * loss + 32 * _ROUNDOFF * np.sqrt(2 * loss) + (32 * _ROUNDOFF) ** 2
    pull = float(np.linalg.norm(h)) + 32 * _ROUNDOFF
    c = float(np.linalg.eigvalsh(C)[0]) - 4 * count * _ROUNDOFF
    apart = c - a
    spread = float(np.hypot(apart, 2 * pull))
    drop = 2 * pull**2 / (apart + spread) if apart > 0 else (spread - apart) / 2
    whole = np.block([[np.array([[a]]), h[None, :]], [h[:, None], C]])
    least = max(a - drop, float(np.linalg.eigvalsh(whole)[0]) - 4 * count * _ROUNDOFF) - pad
    steep = c - loss
    if steep <= 0:
        return LossBound(loss, float(least), float(np.pi))
    tangent = (pull + np.sqrt(pull**2 + steep * max(loss - a + 2 * pad, 0.0))) / steep
    return LossBound(loss, float(least), float(2 * np.arctan(tangent)))


@dataclass(frozen=True)
class WorstCaseCertificate:
    """Claim: no attitude has a worst-case loss below that of q_BN less `gap`.

    corners : the data; q_BN (4,); shares (S,) : the mixture of corners that proves it; gap >= 0 [-]
    distance_rad : claimed distance of q_BN to every attitude that is as good, pi when none is claimed [rad]
    """

    corners: BoxCorners
    q_BN: Array
    shares: Array
    gap: float
    distance_rad: float

    @staticmethod
    def of(corners: BoxCorners, shares: Array, q_BN: Array) -> "WorstCaseCertificate":
        """Return the strongest claim that the shares prove."""
        proven = loss_bound(corners, shares, q_BN)
        return WorstCaseCertificate(corners, q_BN, shares, max(proven.loss - proven.least, 0.0), proven.distance_rad)

    @property
    def claim(self) -> str:
        """The claim, one sentence."""
        loss = self.corners.worst_case_loss(self.q_BN)
        near = ""
        if self.distance_rad < np.pi:
            near = f"; every attitude that is as good lies within {np.degrees(self.distance_rad):.3g} deg"
        return (
            f"The worst-case loss of q_BN = {np.array2string(self.q_BN, precision=9)} is {loss:.9g}, and no attitude "
            f"has one below {loss - self.gap:.9g}{near}."
        )

    @property
    def error_bound(self) -> float:
        """Guaranteed distance to every optimal attitude [rad]."""
        return self.distance_rad

    def margin(self) -> float:
        """Claimed less recomputed gap [-]."""
        proven = loss_bound(self.corners, self.shares, self.q_BN)
        return self.gap - max(proven.loss - proven.least, 0.0)

    def verify(self) -> Verdict:
        """Recompute worst case and lower bound from the stored data; no solver."""
        data = self.corners
        numbers = (data.b_B, data.r_N, data.weights, self.q_BN, self.shares, np.array([self.gap, self.distance_rad]))
        if not all(bool(np.all(np.isfinite(x))) for x in numbers):
            return Verdict(False, "a number is not finite")
        if min(float(x.min()) for x in (data.b_radius, data.r_radius, data.weights, self.shares)) < 0:
            return Verdict(False, "radii, weights and shares must be >= 0")
        if len(self.shares) != len(data.pair):
            return Verdict(False, f"there are {len(data.pair)} corners but {len(self.shares)} shares")
        if abs(float(np.linalg.norm(self.q_BN)) - 1) > 8 * _ROUNDOFF:
            return Verdict(False, "q_BN is not a unit quaternion to rounding")
        sums = np.add.reduceat(self.shares, data.first)
        if np.any(sums > data.weights + 4 * len(self.shares) * _ROUNDOFF):
            return Verdict(False, "the shares of a pair exceed its weight")
        proven = loss_bound(data, self.shares, self.q_BN)
        gap = max(proven.loss - proven.least, 0.0)
        if not self.gap >= gap * (1 - 1e-10):
            return Verdict(False, f"recomputed gap {gap:.6g} exceeds the claimed {self.gap:.6g}")
        if not self.distance_rad >= proven.distance_rad * (1 - 1e-10):
            return Verdict(False, f"recomputed distance {proven.distance_rad:.6g} rad exceeds the claimed")
        return Verdict(True, f"recomputed gap {gap:.6g}, distance {proven.distance_rad:.6g} rad")

    def to_json(self) -> str:
        """Return the certificate as JSON text; numbers are written so that they are read back exactly."""
        data = self.corners
        names = ("b_mid", "b_radius", "r_mid", "r_radius", "weights")
        return json.dumps(
            {
                "format": FORMAT,
                "claim": self.claim,
                "conventions": "q_BN scalar last, b_B = A(q_BN) r_N, loss 1/2 sum w |b - A r|^2, angles in rad",
                "q_BN": self.q_BN.tolist(),
                "gap": self.gap,
                "distance_rad": self.distance_rad,
                **{name: getattr(data, name).tolist() for name in names},
                "shares": self.shares.tolist(),
            },
            allow_nan=False,
        )

    @staticmethod
    def from_json(text: str) -> "WorstCaseCertificate":
        """Return the certificate that `to_json` wrote.

        Raises
        ------
        CertificateFormatError : not JSON, another format, a field missing, of the wrong type or shape.
        """
        fields = StoredFields.of(text, FORMAT)
        m = len(fields.array("weights", (None,)))
        if m == 0:
            raise CertificateFormatError("`weights` is empty; a certificate is about at least one pair.")
        b_mid, b_radius, r_mid, r_radius = (
            fields.array(name, (m, 3)) for name in ("b_mid", "b_radius", "r_mid", "r_radius")
        )
        corners = BoxCorners(b_mid, b_radius, r_mid, r_radius, fields.array("weights", (m,)))
        return WorstCaseCertificate(
            corners,
            fields.array("q_BN", (4,)),
            fields.array("shares", (len(corners.pair),)),
            float(fields.array("gap", ())),
            float(fields.array("distance_rad", ())),
        )
