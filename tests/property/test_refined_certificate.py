"""Refined certificates: cells and subpaving hold the truth, are never worse than Theorem 1, and cannot be forged."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bounded_draws import Pose, drawn_pose, poses
from hypothesis import assume, given, settings

import optsat
from optsat.attitude import quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.certificates.attitude_certificate import AttitudeCertificate
from optsat.certificates.cell_cover import CellCover
from optsat.certificates.subpaving import Subpaving
from optsat.determine import Refinement

few = settings(derandomize=True, max_examples=12)
REFINEMENTS = pytest.mark.parametrize("refine", ["cells", "subpaving"])


def pose() -> Pose:
    """Return a pose whose first bound is a good deal larger than the admissible set."""
    return drawn_pose(5, (-1.3, -2.0, -1.0, -1.6), False)


def refined(refine: Refinement) -> AttitudeCertificate:
    drawn = pose()
    first = optsat.certify_attitude(drawn.b_B, drawn.r_N, drawn.angle_bound_rad)
    second = optsat.certify_attitude(drawn.b_B, drawn.r_N, drawn.angle_bound_rad, refine=refine)
    assert second.bound_rad < 0.99 * first.bound_rad
    assert second.certificate.verify()
    assert second.certificate.margin() >= -1e-10 * second.bound_rad
    return second.certificate


@pytest.fixture(scope="module")
def cells() -> tuple[AttitudeCertificate, CellCover]:
    certificate = refined("cells")
    assert isinstance(certificate.refinement, CellCover)
    assert len(certificate.refinement.low) >= 2
    return certificate, certificate.refinement


@pytest.fixture(scope="module")
def subpaving() -> tuple[AttitudeCertificate, Subpaving]:
    certificate = refined("subpaving")
    assert isinstance(certificate.refinement, Subpaving)
    assert certificate.refinement.second_BN is not None
    return certificate, certificate.refinement


@REFINEMENTS
@few
@given(drawn=poses(least=3, most=5, smallest=1e-5, largest=0.3))
def test_truth_is_within_the_refined_bound(refine: Refinement, drawn: Pose) -> None:
    first = optsat.certify_attitude(drawn.b_B, drawn.r_N, drawn.angle_bound_rad)
    assume(first.status is AttitudeStatus.OK)
    second = optsat.certify_attitude(drawn.b_B, drawn.r_N, drawn.angle_bound_rad, refine=refine)
    assert quaternion.error_angle(second.q_BN, drawn.q_BN) <= second.bound_rad <= first.bound_rad
    assert second.certificate.verify()
    again = AttitudeCertificate.from_json(second.certificate.to_json())
    assert again.verify() == second.certificate.verify()
    assert again.to_json() == second.certificate.to_json()
    # the plain ellipsoid is still stated about the centre of the first proof
    np.testing.assert_allclose(second.ellipsoid_B(), first.ellipsoid_B(), rtol=1e-6)


CELL_FORGERIES: dict[str, Any] = {
    "a removed cell": lambda c: replace(c, low=c.low[1:], high=c.high[1:], multipliers=c.multipliers[1:]),
    "a cell twice": lambda c: replace(
        c,
        low=np.vstack((c.low, c.low[:1])),
        high=np.vstack((c.high, c.high[:1])),
        multipliers=np.vstack((c.multipliers, c.multipliers[:1])),
    ),
    "a moved cell": lambda c: replace(c, low=c.low + [[0.25, 0, 0]] * (np.arange(len(c.low)) == 0)[:, None]),
    "a moved wall": lambda c: replace(c, low=c.low - 0.125, high=c.high - 0.125),
    "a lowered level": lambda c: replace(c, tau=c.tau * (1 - 1e-6)),
    "a negated multiplier": lambda c: replace(c, multipliers=-c.multipliers),
    "a multiplier that is not finite": lambda c: replace(c, multipliers=c.multipliers * np.nan),
    "multipliers left out": lambda c: replace(c, multipliers=0 * c.multipliers),
    "a smaller pivot ball": lambda c: replace(c, scale=c.scale * (1 - 1e-6)),
    "negative pivot weights": lambda c: replace(c, pivot_weights=-c.pivot_weights),
}


@pytest.mark.parametrize("forgery", CELL_FORGERIES)
def test_forged_cells_are_rejected(cells: tuple[AttitudeCertificate, CellCover], forgery: str) -> None:
    certificate, cover = cells
    verdict = replace(certificate, refinement=CELL_FORGERIES[forgery](cover)).verify()
    assert not verdict
    assert verdict.reason


SUBPAVING_FORGERIES: dict[str, Any] = {
    "a lowered bound": lambda s: replace(s, bound_rad=s.bound_rad * (1 - 1e-6)),
    "a smaller pivot ball": lambda s: replace(s, scale=s.scale * (1 - 1e-6)),
    "a smaller second ball": lambda s: replace(s, second_scale=s.second_scale * (1 - 1e-6)),
    "fewer halvings": lambda s: replace(s, levels=(s.levels[0], s.levels[1] - 2)),
    "one round for two": lambda s: replace(s, second_BN=None),
}


@pytest.mark.parametrize("forgery", SUBPAVING_FORGERIES)
def test_forged_subpavings_are_rejected(subpaving: tuple[AttitudeCertificate, Subpaving], forgery: str) -> None:
    certificate, paving = subpaving
    verdict = replace(certificate, refinement=SUBPAVING_FORGERIES[forgery](paving)).verify()
    assert not verdict
    assert verdict.reason


@REFINEMENTS
def test_a_refined_claim_is_tied_to_its_proof(
    refine: Refinement,
    cells: tuple[AttitudeCertificate, CellCover],
    subpaving: tuple[AttitudeCertificate, Subpaving],
) -> None:
    certificate = cells[0] if refine == "cells" else subpaving[0]
    turn = np.array([0.0, 0.0, 1e-3 * certificate.bound_rad, 1.0])
    turned = quaternion.compose(turn / np.linalg.norm(turn), certificate.q_BN)
    data = certificate.admissible
    wider = replace(data, angle_bound_rad=data.angle_bound_rad * 1.01)
    assert not replace(certificate, bound_rad=certificate.bound_rad * (1 - 1e-6)).verify()
    assert not replace(certificate, q_BN=turned).verify()
    assert not replace(certificate, admissible=wider).verify()
    assert not replace(certificate, refinement=None).verify()


def test_margin_of_a_cover_is_the_slack_of_its_worst_cell(cells: tuple[AttitudeCertificate, CellCover]) -> None:
    certificate, cover = cells
    assert cover.margin(certificate.admissible) >= 0
    assert replace(cover, tau=cover.tau * 0.99).margin(certificate.admissible) < 0


def test_cells_of_a_subpaving_hold_the_truth(subpaving: tuple[AttitudeCertificate, Subpaving]) -> None:
    certificate, paving = subpaving
    for part in (paving, replace(paving, second_BN=None)):
        chart, centres, half = part.cells(certificate.admissible)
        error = quaternion.compose(pose().q_BN, quaternion.inverse(chart.q_BN))
        g = error[:3] / (error[3] * chart.scale)
        assert np.any(np.all(np.abs(centres - g) <= half, axis=1))
        np.testing.assert_allclose(np.abs(chart.attitude(g) @ pose().q_BN), 1.0, atol=1e-12)
