"""The worked step of the specification, three channels on one axis: the dense bank and the compiled one."""

from math import prod
from pathlib import Path

import numpy as np
import pytest
from dense_bank import DenseChannel, Drive, Modes, Outcome, dense_step, normal, transition
from kernel_source_harness import compiled
from one_axis_bank import CHAINS, R_GYRO, R_STAR, B, F, J, T, one_axis

from optsat.arrays import Array

REFERENCE, COMMAND = np.array([0.1, 0.05, -2.0]), 5.0
GYRO, LAST_GYRO, STAR, LAST_STAR = 0.046, 0.0557, 0.1078, 0.1021

PREDICTED = [0.1050428571, 0.05085714286, -2.0]
C = [6.8120286179e-1, 6.9837174057e-3, 1.3970197806e-2, 1.4322299428e-4]
C += [2.8875707241e-1, 2.9603483863e-3, 5.9218679863e-3, 6.0711213722e-5]
STAR_DENSITY = {0: 5.0226150677, 2: -0.40814578002, 4: 3.9532950190, 6: -0.40819884645}
GYRO_DENSITY = [3.0129298237, -0.40983855482, 3.1999097489, -0.40953456461]
GYRO_DENSITY += [2.6927807161, -0.41066520155, 3.1831277040, -0.40962733319]
POSTERIOR = [9.0401703085e-1, 3.0234123748e-4, 9.7894340489e-5, 2.7164769887e-8]
POSTERIOR += [9.5497937296e-2, 4.3953629991e-5, 4.0803963951e-5, 1.1513274556e-8]
FAULTS = [3.4633354551e-4, 1.3873698248e-4, 9.5582706404e-2]
MERGED = [1.0677318929e-1, 5.2915118938e-2, -1.1952624627e-1]
MERGED_P = [8.1187952812e-7, 2.4701189438e-6, 9.1899110975e-5, 4.3086006281e-5, 2.1802836656e-4, 4.7554457852e-1]


def start() -> Modes:
    mu = np.array(
        [prod(p if mode >> bit & 1 else 1 - p for bit, p in enumerate((0.01, 0.02, 0.3))) for mode in range(8)]
    )
    m = np.array([[0.001, 0.002, 2.0]] * 4 + [[-0.0005, -0.001, 0.5]] * 4)
    healthy = np.diag([1e-6, 1e-4, 0.0])
    failed = np.array([[1.2e-6, 0.0, 0.0], [0.0, 1.5e-4, 0.01], [0.0, 0.01, 4.0]])
    return Modes(mu, m, np.array([healthy] * 4 + [failed] * 4))


def dense() -> tuple[Array, Outcome]:
    reference = F @ REFERENCE + np.array([T * T / (2 * J), T / J, 0.0]) * COMMAND
    s_star, s_gyro = 1e-6 * R_STAR, 1e-6 * R_GYRO
    free_star = np.log(0.25) + normal(STAR - LAST_STAR, 2 * s_star)
    free_gyro = np.log(0.25) + np.logaddexp(normal(GYRO, s_gyro), normal(GYRO - LAST_GYRO, 2 * s_gyro))
    channels = [
        DenseChannel(1, np.array([STAR - reference[0]]), np.eye(3)[:1], np.array([R_STAR]), free_star, B),
        DenseChannel(0, np.array([GYRO - reference[1]]), np.eye(3)[1:2], np.array([R_GYRO]), free_gyro, B),
    ]
    drives = [Drive(2, 2, 36.0, -REFERENCE[2], 0.0, 0.01)]
    return reference, dense_step(start(), transition(CHAINS), F, np.array([0.0, 1e-6, 0.0]), drives, channels)


def test_dense_bank_gives_the_figures_of_the_specification() -> None:
    reference, found = dense()
    np.testing.assert_allclose(reference, PREDICTED, rtol=1e-9)
    np.testing.assert_allclose(found.c, C, rtol=1e-9)
    np.testing.assert_allclose(found.mixed.m[0], [9.9359248185e-4, 1.9871849637e-3, 2.0], rtol=1e-9)
    mixed = found.mixed.P[0]
    np.testing.assert_allclose(
        [mixed[0, 0], mixed[0, 1], mixed[1, 1]], [1.0104245567e-6, 1.9140441886e-8, 1.0025186482e-4], rtol=1e-9
    )
    np.testing.assert_allclose(mixed[2], 0.0, rtol=0, atol=1e-30)
    np.testing.assert_allclose(found.mixed.m[4], [-4.9647295936e-4, -9.9294591871e-4, 5.0352704064e-1], rtol=1e-9)
    np.testing.assert_allclose(
        found.mixed.P[4][np.triu_indices(3)],
        [1.2048078489e-6, 1.0556241903e-8, 5.2781209517e-6, 1.4990354446e-4, 9.9870426376e-3, 4.0805216547],
        rtol=1e-9,
    )
    for mode, density in STAR_DENSITY.items():
        np.testing.assert_allclose(found.densities[0][[mode, mode + 1]], density, rtol=1e-9)
    np.testing.assert_allclose(found.densities[1], GYRO_DENSITY, rtol=1e-9)
    assert found.evidence == pytest.approx(7.7525568415, rel=1e-9)
    np.testing.assert_allclose(found.modes.mu, POSTERIOR, rtol=1e-9)
    np.testing.assert_allclose(found.faults, FAULTS, rtol=1e-9)
    either = sum(found.modes.mu[mode] for mode in range(8) if mode & 0b101)
    assert either == pytest.approx(9.5885074806e-2, rel=1e-9)
    np.testing.assert_allclose(found.modes.m[0], [1.7963017902e-3, 1.9416218099e-3, 2.0], rtol=1e-9)
    np.testing.assert_allclose(found.modes.m[4], [1.1067732265e-3, 3.1454805338e-3, 7.4940932248e-1], rtol=1e-9)
    np.testing.assert_allclose(reference + found.merged, MERGED, rtol=1e-9)
    np.testing.assert_allclose(found.covariance[np.triu_indices(3)], MERGED_P, rtol=1e-9)
    mean, variance = found.deviation[0]
    np.testing.assert_allclose([mean + reference[2], variance], [-1.2505007523, 3.5609311976], rtol=1e-9)


@pytest.mark.parametrize("form", ["compiled", "twin"])
def test_butterflies_give_the_same_figures(form: str, tmp_path: Path) -> None:
    source, modes = one_axis(), start()
    lower = np.tril_indices(3)
    packed = modes.P[:, lower[0], lower[1]].T
    x = np.concatenate(
        [modes.mu, modes.m.T.ravel(), packed.ravel(), REFERENCE, [LAST_STAR, LAST_GYRO, STAR, GYRO, COMMAND, 1.0, 1.0]]
    )
    assert source.twin is not None
    call = compiled(source, tmp_path) if form == "compiled" else source.twin
    status, y = call(x)
    assert status == 0
    ends = np.cumsum([port.size for port in source.outputs])[:-1]
    got = dict(zip((port.name for port in source.outputs), np.split(y, ends), strict=True))
    np.testing.assert_allclose(got["probability"], POSTERIOR, rtol=1e-9)
    np.testing.assert_allclose(got["fault_probability"], FAULTS, rtol=1e-9)
    np.testing.assert_allclose(got["reference"], MERGED, rtol=1e-9)
    np.testing.assert_allclose(got["merged_covariance"].reshape(3, 3)[np.triu_indices(3)], MERGED_P, rtol=1e-9)
    assert got["log_evidence"][0] == pytest.approx(7.7525568415, rel=1e-9)
    np.testing.assert_allclose(
        [got["deviation"][0], got["deviation_variance"][0]], [-1.2505007523, 3.5609311976], rtol=1e-9
    )
    # means stand about the merged state
    mean, merged = got["mean"].reshape(3, 8), np.array(MERGED) - PREDICTED
    np.testing.assert_allclose(mean[:, 0] + merged, [1.7963017902e-3, 1.9416218099e-3, 2.0], rtol=1e-7)
    _, found = dense()
    np.testing.assert_allclose(mean.T, found.modes.m - found.merged, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        got["covariance"].reshape(6, 8).T, found.modes.P[:, lower[0], lower[1]], rtol=0, atol=1e-12
    )
