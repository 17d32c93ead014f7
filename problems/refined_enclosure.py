"""Refined enclosure: a tighter guaranteed bound for three and more vectors, starting from a proven ball."""

from dataclasses import dataclass, replace

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import canonical, rotation_matrix, turn
from optsat.attitude.gibbs_chart import GibbsChart
from optsat.certificates.attitude_certificate import AttitudeCertificate
from optsat.certificates.cell_cover import CellCover, proof_slack
from optsat.certificates.subpaving import Subpaving
from optsat.forms import CoverForm, Point
from optsat.problems.certified_attitude import CertifiedAttitude
from optsat.solution import Proof, Solution

_REPAIRS = 60


@dataclass(frozen=True)
class RefinedEnclosure:
    """Cover the proven ball of `first` (status OK) with cells and bound each; keep the better of the two bounds."""

    first: CertifiedAttitude

    def lower(self) -> CoverForm:
        """Return the cover form of the proven ball, its scale rounded outward."""
        certificate = self.first.certificate
        scale = float(np.tan(certificate.bound_rad / 2) * (1 + 1e-13))
        return CoverForm(certificate.admissible, certificate.q_BN, certificate.weights, scale)

    def interpret(self, point: Point, solver: str) -> Solution[CertifiedAttitude]:
        """Return the refined answer where its certificate verifies and its bound is smaller, else the first one."""
        refined = self._cells(point) if "tau" in point.stats else self._subpaving(point)
        better = refined is not None and refined.bound_rad < self.first.bound_rad and bool(refined.verify())
        stats = {
            **self.first.stats,
            "refinement": solver,
            "refined": better,
            "order_1_bound_rad": self.first.bound_rad,
        }
        answer = replace(self.first, stats=stats)
        if refined is not None and better:
            answer = replace(
                answer,
                q_BN=refined.q_BN,
                dcm_BN=rotation_matrix(refined.q_BN),
                bound_rad=refined.bound_rad,
                certificate=refined,
            )
        return Solution(
            answer=answer,
            termination=point.termination,
            proof=Proof.GLOBAL,
            residuals={"certificate_margin": answer.certificate.margin()},
            certificate=answer.certificate,
            stats={**stats, "iterations": point.iterations},
        )

    def _cells(self, point: Point) -> AttitudeCertificate | None:
        form = self.lower()
        chart = GibbsChart.about(form.admissible, form.q_BN, form.scale)
        low, high = point.stats["low"], point.stats["high"]
        tau, multipliers = repaired(chart, point.x, point.stats["tau"], low, high, point.dual)
        if not np.isfinite(tau):
            return None
        cover = CellCover(form.q_BN, form.weights, form.scale, point.x, tau, low, high, multipliers)
        return replace(
            self.first.certificate,
            q_BN=canonical(turn(form.q_BN, form.scale * point.x)),
            bound_rad=cover.bound_rad * (1 + 1e-13),
            refinement=cover,
        )

    def _subpaving(self, point: Point) -> AttitudeCertificate | None:
        if "bound_rad" not in point.stats:
            return None
        form = self.lower()
        paving = Subpaving(
            form.q_BN,
            form.weights,
            form.scale,
            point.stats["levels"],
            point.stats["second_BN"],
            point.stats["second_scale"],
            canonical(point.x),
            point.stats["bound_rad"] * (1 + 1e-9),
        )
        return replace(
            self.first.certificate, q_BN=paving.centre_BN, bound_rad=paving.bound_rad * (1 + 1e-13), refinement=paving
        )


def repaired(
    chart: GibbsChart, centre: Array, tau: float, low: Array, high: Array, multipliers: Array
) -> tuple[float, Array]:
    """Return a level and multipliers whose every cell is proven with rounding allowed for; inf when that failed.

    An interior-point dual is not exactly feasible: what a cell lacks is put on the multiplier of the unit ball,
    whose block is positive definite, and what that costs in the corner is paid by the level.
    """
    multipliers = np.array(multipliers)
    level = tau * (1 + 1e-9) + 1e-12
    added = np.zeros(len(low))
    for _ in range(_REPAIRS):
        slack = proof_slack(chart, centre, level, low, high, multipliers)
        lacking = slack < 0
        if not lacking.any():
            return float(level), multipliers
        step = np.where(lacking, np.maximum(-4 * slack, added), 0.0)
        multipliers[:, -1] += step
        added = np.maximum(added, step)
        level += 4 * float(step.max())
        if level > 4 * max(tau, 1.0):
            break
    return float("inf"), multipliers
