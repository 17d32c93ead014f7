"""Kinds of thruster faults: densities by numerical integration, limits, and what cannot be told."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from optsat.errors import InputError
from optsat.estimators.thruster_kind import KINDS, thruster_kinds
from optsat.models.faults import ThrusterFaultKind

U_MAX = 12.0


def by_integration(u: float, s: float, c: float) -> list[float]:
    reduced, _ = quad(lambda a: norm.pdf(u, a * c, s), 0.0, 1.0, points=[min(max(u / c, 0.0), 1.0)], epsabs=1e-14)
    densities = np.array(
        [
            norm.pdf(u, 0.0, s),
            norm.pdf(u, U_MAX, s),
            reduced,
            norm.pdf(u, 0.0, np.hypot(s, 0.6 * U_MAX)),
        ]
    )
    weighted = densities * [3.0, 3.0, 3.0, 1.0]
    return list(weighted / weighted.sum())


@pytest.mark.parametrize("u", [-1.0, 0.0, 2.0, 4.9, 7.0, 11.8])
@pytest.mark.parametrize("s", [0.2, 0.8, 3.0])
@pytest.mark.parametrize("c", [5.0, 0.5, -5.0])
def test_probabilities_are_the_integrals(u: float, s: float, c: float) -> None:
    found = thruster_kinds(u, s, c, U_MAX)
    np.testing.assert_allclose(found.probability, by_integration(u, s, c), rtol=1e-6, atol=1e-12)
    assert found.efficiency == pytest.approx(u / c)
    assert found.efficiency_deviation == pytest.approx(s / abs(c))


@pytest.mark.parametrize(
    ("u", "kind"),
    [
        (0.0, ThrusterFaultKind.CLOSED),
        (12.0, ThrusterFaultKind.OPEN),
        (2.5, ThrusterFaultKind.REDUCED),
        (8.0, ThrusterFaultKind.LOCKED),
        (-4.0, ThrusterFaultKind.LOCKED),
    ],
)
def test_a_sharp_estimate_tells_the_kind(u: float, kind: ThrusterFaultKind) -> None:
    found = thruster_kinds([u, u], 0.05, 5.0, U_MAX)
    assert [KINDS[k] for k in found.most_probable] == [kind] * 2
    assert found.probability.max(axis=-1).min() > 0.75


def test_without_a_command_closed_and_reduced_cannot_be_told() -> None:
    found = thruster_kinds([0.0, 12.0], 0.5, 0.0, U_MAX)
    assert not found.is_commanded.any()
    assert np.isnan(found.probability[:, [0, 2]]).all()
    assert np.isnan(found.efficiency).all()
    np.testing.assert_allclose(np.nansum(found.probability, axis=-1), 1.0)
    assert [KINDS[k] for k in found.most_probable] == [ThrusterFaultKind.LOCKED, ThrusterFaultKind.OPEN]


def test_far_out_numbers_stay_finite() -> None:
    found = thruster_kinds([1e4, -1e4, 5.0], [1e-3, 1e-3, 1e-9], 5.0, U_MAX)
    np.testing.assert_allclose(found.probability.sum(axis=-1), 1.0)


def test_input_is_checked() -> None:
    with pytest.raises(InputError, match="must be positive"):
        thruster_kinds(1.0, 0.0, 5.0, U_MAX)
    with pytest.raises(InputError, match="`greatest_torque`"):
        thruster_kinds(1.0, 1.0, 5.0, 0.0)
    with pytest.raises(InputError, match=r"shapes \(2,\), \(3,\)"):
        thruster_kinds(np.ones(2), np.ones(3), 5.0, U_MAX)
    with pytest.raises(InputError, match="`torque` must be finite"):
        thruster_kinds(np.nan, 1.0, 5.0, U_MAX)
