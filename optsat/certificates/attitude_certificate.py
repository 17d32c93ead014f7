"""Attitude certificate: the data, an attitude and the angle that its error surely does not exceed."""

import json
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.davenport import turn
from optsat.attitude.status import AttitudeStatus
from optsat.certificates.attitude_bound import ROUNDOFF, Ball, ball_of, sum_about
from optsat.certificates.cell_cover import CellCover
from optsat.certificates.certificate import Verdict
from optsat.certificates.stored_fields import StoredFields
from optsat.certificates.subpaving import Subpaving
from optsat.errors import CertificateFormatError

FORMAT = "optsat-attitude-certificate/1"


@dataclass(frozen=True)
class AttitudeCertificate:
    """Claim about all attitudes that satisfy the stored inequalities.

    admissible : the data; weights : (count,) >= 0; q_BN : (4,) centre; bound_rad : claimed angle [rad]
    pair : two cones whose mismatch exceeds their bounds, when that is the proof of inconsistency
    refinement : a tighter proof than Theorem 1, where one was made
    """

    admissible: AdmissibleSet
    weights: Array
    q_BN: Array
    bound_rad: float
    status: AttitudeStatus
    pair: tuple[int, int] | None = None
    refinement: CellCover | Subpaving | None = None

    @property
    def claim(self) -> str:
        """The claim, one sentence."""
        if self.status is AttitudeStatus.INCONSISTENT:
            which = f" (pairs {self.pair[0]} and {self.pair[1]} contradict each other)" if self.pair else ""
            return f"No attitude satisfies all {self.admissible.count} bounds{which}."
        if self.status is AttitudeStatus.UNBOUNDED:
            return "The data and their bounds leave the attitude undetermined."
        return (
            f"Every attitude that satisfies all {self.admissible.count} bounds lies within "
            f"{np.degrees(self.bound_rad):.6g} deg of q_BN = {np.array2string(self.q_BN, precision=9)}."
        )

    @property
    def error_bound(self) -> float:
        """Guaranteed attitude error [rad]."""
        return self.bound_rad

    def ball(self) -> Ball:
        """Return the ball about the stored q_BN that the stored weights prove, recomputed from the data."""
        return ball_of(sum_about(self.admissible, self.weights / self.weights.sum(), self.q_BN))

    def margin(self) -> float:
        """Claimed less recomputed bound [rad]; for INCONSISTENT -s1, or the mismatch beyond the bounds [rad]."""
        if self.status is AttitudeStatus.UNBOUNDED:
            return 0.0
        if self.status is AttitudeStatus.INCONSISTENT:
            return self._pair_excess() if self.pair else -float(self.ball().s1)
        if self.refinement is not None:
            return self.bound_rad - self.refinement.bound_rad
        return self.bound_rad - float(self.ball().bound_rad)

    def _pair_excess(self) -> float:
        i, j = self.pair or (0, 0)
        eps = self.admissible.angle_bound_rad
        return float(self.admissible.mismatch_rad()[i, j] - eps[i] - eps[j] - 40 * ROUNDOFF)

    def verify(self) -> Verdict:
        """Rebuild the proof from the stored data, rounding allowed for; milliseconds, no solver."""
        data = self.admissible
        numbers = (data.left_B, data.right_N, data.level, self.weights, self.q_BN, np.array(self.bound_rad))
        if not all(bool(np.all(np.isfinite(x))) for x in numbers):
            return Verdict(False, "a number is not finite")
        if np.any(np.abs(np.linalg.norm(data.b_B, axis=1) - 1) > 1e-12) or np.any(
            np.abs(np.linalg.norm(data.r_N, axis=1) - 1) > 1e-12
        ):
            return Verdict(False, "a direction is not a unit vector")
        if np.any(self.weights < 0) or not np.any(self.weights > 0):
            return Verdict(False, "the weights must be >= 0 and not all zero")
        if abs(float(np.linalg.norm(self.q_BN)) - 1) > 8 * ROUNDOFF:
            return Verdict(False, "q_BN is not a unit quaternion to rounding")
        if self.status is AttitudeStatus.UNBOUNDED:
            if self.bound_rad < np.pi:
                return Verdict(False, "an unbounded attitude cannot carry a bound below pi")
            return Verdict(True, "nothing is claimed")
        if self.status is AttitudeStatus.INCONSISTENT:
            return self._verify_empty()
        if self.refinement is not None:
            return self._verify_refinement(self.refinement)
        recomputed = float(self.ball().bound_rad)
        if not self.bound_rad >= recomputed * (1 - 1e-10):
            return Verdict(
                False, f"recomputed bound {recomputed:.12g} rad exceeds the claimed {self.bound_rad:.12g} rad"
            )
        return Verdict(True, f"recomputed bound {recomputed:.12g} rad")

    def _verify_empty(self) -> Verdict:
        if self.pair is not None:
            excess = self._pair_excess()
            return Verdict(excess > 0, f"mismatch of pairs {self.pair} beyond their bounds: {excess:.6g} rad")
        ball = self.ball()
        return Verdict(bool(ball.empty), f"s1 = {float(ball.s1):.6g}, s2 = {float(ball.s2):.6g}; both must be negative")

    def _verify_refinement(self, refinement: CellCover | Subpaving) -> Verdict:
        if not self.bound_rad >= refinement.bound_rad * (1 - 1e-10):
            return Verdict(False, "the claimed bound is below that of the refinement")
        centre = _cover_centre(refinement) if isinstance(refinement, CellCover) else refinement.centre_BN
        if 1 - abs(float(centre @ self.q_BN)) > 1e-15 + 1e-12 * self.bound_rad**2:
            return Verdict(False, "q_BN is not the centre of the refinement")
        return refinement.check(self.admissible)

    def to_json(self) -> str:
        """Return the certificate as JSON text; numbers are written so that they are read back exactly."""
        data = self.admissible
        content: dict[str, Any] = {
            "format": FORMAT,
            "claim": self.claim,
            "conventions": "q_BN scalar last, b_B = A(q_BN) r_N, angles in rad",
            "status": self.status.value,
            "q_BN": self.q_BN.tolist(),
            "bound_rad": self.bound_rad,
            "weights": self.weights.tolist(),
            "b_B": data.b_B.tolist(),
            "r_N": data.r_N.tolist(),
            "angle_bound_rad": data.angle_bound_rad.tolist(),
            "cuts": {
                "u_B": data.cut_B.tolist(),
                "w_N": data.cut_N.tolist(),
                "level": data.cut_level.tolist(),
            },
            "pair": list(self.pair) if self.pair else None,
            "refinement": _refinement_content(self.refinement),
        }
        return json.dumps(content, allow_nan=False)

    @staticmethod
    def from_json(text: str) -> "AttitudeCertificate":
        """Return the certificate that `to_json` wrote.

        Raises
        ------
        CertificateFormatError : not JSON, another format, a field missing, of the wrong type or shape.
        """
        reader = StoredFields.of(text, FORMAT)
        content = reader.content
        m = len(reader.array("angle_bound_rad", (None,)))
        cuts = StoredFields(reader.mapping("cuts"), "cuts.")
        k = len(cuts.array("level", (None,)))
        admissible = AdmissibleSet(
            reader.array("b_B", (m, 3)),
            reader.array("r_N", (m, 3)),
            reader.array("angle_bound_rad", (m,)),
            cuts.array("u_B", (k, 3)),
            cuts.array("w_N", (k, 3)),
            cuts.array("level", (k,)),
        )
        pair = content.get("pair")
        if pair is not None and not (
            isinstance(pair, list) and len(pair) == 2 and all(type(i) is int and 0 <= i < m for i in pair)
        ):
            raise CertificateFormatError(f"`pair` must be null or two indices below {m}, got {pair!r}.")
        if content.get("status") not in [status.value for status in AttitudeStatus]:
            raise CertificateFormatError(
                f"`status` must be ok, unbounded or inconsistent, got {content.get('status')!r}."
            )
        return AttitudeCertificate(
            admissible,
            reader.array("weights", (m + k,)),
            reader.array("q_BN", (4,)),
            float(reader.array("bound_rad", ())),
            AttitudeStatus(content["status"]),
            (pair[0], pair[1]) if pair else None,
            _read_refinement(content.get("refinement"), m + k),
        )


def _cover_centre(cover: CellCover) -> Array:
    return turn(cover.pivot_BN, cover.scale * cover.centre)


def _refinement_content(refinement: CellCover | Subpaving | None) -> dict[str, Any] | None:
    if refinement is None:
        return None
    content: dict[str, Any] = {"kind": "cells" if isinstance(refinement, CellCover) else "subpaving"}
    for name, value in vars(refinement).items():
        content[name] = value.tolist() if isinstance(value, np.ndarray) else value
    return content


def _read_refinement(content: Any, count: int) -> CellCover | Subpaving | None:
    if content is None:
        return None
    if not isinstance(content, dict) or content.get("kind") not in ("cells", "subpaving"):
        raise CertificateFormatError("`refinement` must be null or an object with `kind` cells or subpaving.")
    reader = StoredFields(content, "refinement.")
    pivot, weights = reader.array("pivot_BN", (4,)), reader.array("pivot_weights", (count,))
    scale = float(reader.array("scale", ()))
    if content["kind"] == "cells":
        k = len(reader.array("low", (None, 3)))
        return CellCover(
            pivot,
            weights,
            scale,
            reader.array("centre", (3,)),
            float(reader.array("tau", ())),
            reader.array("low", (k, 3)),
            reader.array("high", (k, 3)),
            reader.array("multipliers", (k, count + 4)),
        )
    levels = reader.array("levels", (2,))
    if not all(0 <= level <= 12 and level == int(level) for level in levels):
        raise CertificateFormatError("`refinement.levels` must be two integers from 0 to 12.")
    second = None if content.get("second_BN") is None else reader.array("second_BN", (4,))
    return Subpaving(
        pivot,
        weights,
        scale,
        (int(levels[0]), int(levels[1])),
        second,
        float(reader.array("second_scale", ())),
        reader.array("centre_BN", (4,)),
        float(reader.array("bound_rad", ())),
    )
