"""Offered kernels by name: the catalogue's definition behind the cache."""

import numpy as np
import pytest

import optsat
from optsat.errors import InputError, UnknownOptionError
from optsat.export.catalogue import build


def test_an_offered_kernel_gives_what_its_definition_gives() -> None:
    rng = np.random.default_rng(1)
    r_N = rng.standard_normal((3, 3))
    r_N /= np.linalg.norm(r_N, axis=1)[:, None]
    offered = optsat.kernel("wahba_3")
    expected = optsat.make_kernel(build("wahba_3"))(r_N, r_N, np.ones(3))
    for found, wanted in zip(offered(r_N, r_N, np.ones(3)), expected, strict=True):
        np.testing.assert_array_equal(found, wanted)
    assert offered(r_N, r_N, np.ones(3))[0] == pytest.approx([0, 0, 0, 1], abs=1e-15)


def test_precision_and_parameters_reach_the_definition() -> None:
    inertia_B = np.diag([2.0, 3.0, 4.0])
    step = optsat.kernel("rigid_body_step", "float", inertia_B=inertia_B)
    assert step.record.real == "float"
    q_BN, omega_BN_B = step(*(np.asarray(value, np.float32) for value in ([0, 0, 0, 1], [0, 0, 0.1], [0, 0, 4.0], 0.5)))
    # torque over inertia about the third axis, alone
    assert omega_BN_B == pytest.approx([0, 0, 0.1 + 0.5], rel=1e-6)
    assert q_BN == pytest.approx([0, 0, np.sin(0.0875), np.cos(0.0875)], rel=1e-5)


def test_a_wrong_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match="wahba_4"):
        optsat.kernel("wahba4")
    with pytest.raises(UnknownOptionError, match="inertia_B"):
        optsat.kernel("rigid_body_step", inertia=np.eye(3))
