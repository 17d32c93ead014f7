"""Hypothesis bank as a kernel: mixing against all pairs of modes, the twin, other compilers, hostile arguments."""

from pathlib import Path

import numpy as np
import pytest
from dense_bank import DenseChannel, Drive, Modes, dense_step, transition
from kernel_source_harness import FORMS, compiled, sanitized
from one_axis_bank import CHAINS, B, F, one_axis

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.hypothesis_bank import BankStructure, Channel, hypothesis_bank
from optsat.kernels.source import KernelSource
from optsat.kernels.status import Status

LOWER = np.tril_indices(3)
MISSING, INVALID = 0.0, 2.0


def drawn(rng: np.random.Generator) -> tuple[Modes, Array]:
    """Modes with semidefinite covariances, those of healthy thrusters without any deviation, and the reference."""
    reference = rng.normal(size=3)
    roots = rng.normal(size=(8, 3, 3))
    modes = Modes(rng.dirichlet(np.full(8, 0.3)), rng.normal(size=(8, 3)), roots @ roots.transpose(0, 2, 1))
    modes.m[:4, 2] = -reference[2]
    modes.P[:4, 2, :] = modes.P[:4, :, 2] = 0.0
    return modes, reference


def row(modes: Modes, reference: Array, kinds: tuple[float, float], sample: Array) -> Array:
    packed = modes.P[:, LOWER[0], LOWER[1]].T
    parts = [modes.mu, modes.m.T.ravel(), packed.ravel(), reference, sample, np.array(kinds)]
    return np.concatenate(parts)


def split(source: KernelSource, y: Array) -> dict[str, Array]:
    ends = np.cumsum([port.size for port in source.outputs])[:-1]
    return {port.name: part.reshape(port.shape) for port, part in zip(source.outputs, np.split(y, ends), strict=True)}


def test_butterflies_mix_as_all_pairs_do(tmp_path: Path) -> None:
    rng, source = np.random.default_rng(0), one_axis()
    call = compiled(source, tmp_path)
    for _ in range(200):
        modes, reference = drawn(rng)
        sample = rng.normal(size=5)
        status, y = call(row(modes, reference, (MISSING, MISSING), sample))
        got = split(source, y)
        silent = [DenseChannel(None, np.zeros(1), np.eye(3)[:1], np.ones(1), 0.0, B, kind=0)]
        drives = [Drive(2, 2, 36.0, -reference[2], 0.0, 0.01)]
        noise = np.array([0.0, 1e-6, 0.0])
        found = dense_step(modes, transition(CHAINS), F, noise, drives, silent)
        assert status == Status.OK
        np.testing.assert_allclose(got["probability"], found.modes.mu, rtol=1e-12)
        np.testing.assert_allclose(got["mean"].T, found.modes.m - found.merged, rtol=0, atol=1e-12)
        P = found.modes.P
        np.testing.assert_allclose(got["covariance"].T, P[:, LOWER[0], LOWER[1]], rtol=0, atol=1e-12 * np.abs(P).max())
        assert not got["covariance"][3:, :4].any()
        assert got["log_evidence"] == pytest.approx(0.0, abs=1e-14)


def test_an_invalid_sample_speaks_for_the_fault_alone(tmp_path: Path) -> None:
    rng, source = np.random.default_rng(1), one_axis()
    modes, reference = drawn(rng)
    _, y = compiled(source, tmp_path)(row(modes, reference, (INVALID, MISSING), rng.normal(size=5)))
    got = split(source, y)
    assert got["fault_probability"][1] == pytest.approx(1.0, abs=1e-12)
    c = modes.mu @ transition(CHAINS)
    gyro = np.array([c[mode] for mode in range(8) if mode & 0b010])
    np.testing.assert_allclose(got["probability"][[2, 3, 6, 7]], gyro / gyro.sum(), rtol=1e-12)
    # healthy modes stay at the floor, not at zero
    np.testing.assert_allclose(got["probability"][[0, 1, 4, 5]], 1e-60, rtol=1e-6)


def samples() -> list[Array]:
    rng = np.random.default_rng(2)
    good = []
    for kinds in ((1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (2.0, 1.0), (0.0, 0.0)):
        for _ in range(4):
            modes, reference = drawn(rng)
            sample = np.append(reference[:2], [*reference[:2], 5.0]) + 0.01 * rng.normal(size=5)
            good.append(row(modes, reference, kinds, sample))
    hostile = []
    for x in good:
        for value in (np.nan, np.inf, -1.0, 0.0, 1e200, -1e300):
            bad = x.copy()
            bad[rng.integers(len(x))] = value
            hostile.append(bad)
    empty = good[0].copy()
    empty[:8] = 0.0
    return [*good, *hostile, empty]


def test_twin_and_every_compiler_agree(tmp_path: Path) -> None:
    source, rows = one_axis(), samples()
    assert source.twin is not None
    expected = [source.twin(x) for x in rows]
    assert {status for status, _ in expected} >= {Status.OK, Status.NOT_FINITE, Status.STATE}
    calls = [compiled(source, tmp_path, *form) for form in FORMS]
    found = [[call(x) for x in rows] for call in calls] + [sanitized(source, np.array(rows), tmp_path)]
    for results in found:
        for (status, y), (wanted, answer) in zip(results, expected, strict=True):
            assert status == wanted
            scale = max(1.0, float(np.abs(answer).max())) if status == Status.OK else 1.0
            np.testing.assert_allclose(y, answer, rtol=1e-9, atol=1e-11 * scale)
    for results in found[1:]:
        for got, first in zip(results, found[0], strict=True):
            np.testing.assert_array_equal(got[1], first[1])


def structure(**changes: object) -> BankStructure:
    fields = {"bits": 1, "channels": (Channel(1, 0, 1.0),), "actuated": (), "F_pattern": (), "H_pattern": ()}
    return BankStructure(**{"states": 1, **fields, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize("bits", [0, 11])
def test_a_bank_has_one_to_ten_bits(bits: int) -> None:
    source = one_axis()
    with pytest.raises(InputError, match="`bits` must be a whole number from 1 to 10"):
        hypothesis_bank("bank", structure(bits=bits), source, source, source, (), (), ())  # type: ignore[arg-type]


@pytest.mark.parametrize("floor", [0.0, 1e-14, float("nan")])
def test_a_high_floor_is_refused(floor: float) -> None:
    source = one_axis()
    with pytest.raises(InputError, match="push their far-off states"):
        hypothesis_bank("bank", structure(), source, source, source, (), (), (), floor)  # type: ignore[arg-type]
