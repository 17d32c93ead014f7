"""Time of one step of the joint bank of faults against filterpy's interacting multiple models; ratios only.

filterpy runs sixteen unscented filters of seven states, one for each set of failed sensors, with its model in plain
Python numbers, which is its fastest form. The joint bank has 16, 32 or 128 hypotheses with nine states and densities of
failed channels besides. Every step gets another sample. A peer that is absent is left out, and its claims with it.
"""

import importlib
import importlib.util
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.estimators.attitude_bank import SEED_INERTIA
from optsat.estimators.bank_kernels import attitude_bank
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.peak import measured_peak

MODES = (16, 32, 128)
DT = 0.1
COMMAND = (0.0, 0.0, 5.0)
BATCH = 64
_SAMPLES = 32
_J = tuple(SEED_INERTIA[k][k] for k in range(3))
_STAR, _GYRO = 4e-7, 1e-4


def cases(count: int) -> list[Case]:
    """Return rounds, each with samples of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round."""
    samples = [_sample(rng) for _ in range(_SAMPLES)]
    steps: dict[str, Callable[[], Any]] = {}
    operations = {}
    for modes in MODES:
        source = attitude_bank(modes)
        kernel = make_kernel(source)
        assert source.example is not None
        steps[f"bank_{modes}"] = _step(kernel, source.example(rng), samples)
        steps[f"batch_{modes}"] = _batch(kernel, [source.example(rng) for _ in range(BATCH)])
        operations[modes] = source.operations
    if importlib.util.find_spec("filterpy") is not None:
        steps["filterpy"] = _filterpy(samples)
    times = time_interleaved(steps, rounds=10)
    row: dict[str, Any] = {}
    for modes in MODES:
        peak = measured_peak()
        row[f"share_of_peak_{modes}"] = times.per_second(f"bank_{modes}") * operations[modes] / peak
        row[f"step_over_batch_step_{modes}"] = times.ratio(f"bank_{modes}", f"batch_{modes}") * BATCH
        if "filterpy" in steps:
            row[f"filterpy_over_{modes}"] = times.ratio("filterpy", f"bank_{modes}")
    return row


def _sample(rng: np.random.Generator) -> tuple[Array, Array]:
    turn = 6e-4 * rng.normal(size=3)
    return np.array([*(0.5 * turn), 1.0]), 0.01 * rng.normal(size=3)


def _step(kernel: Kernel, x: Array, samples: Sequence[tuple[Array, Array]]) -> Callable[[], Any]:
    """Return one step of the bank from its own last state, with the next sample."""
    arrays = _arguments(kernel, x)
    carried = len(arrays) - 5
    state = [*arrays[:carried]]
    state[3] = np.array([0.0, 0.0, 0.0, 1.0])
    rest = [np.array(COMMAND), np.array(DT)]
    feed = cycle(samples)
    flags = np.ones(4)

    def step() -> Any:
        star, gyro = next(feed)
        found = kernel(*state, *rest, star, gyro, flags)
        return found[-2]

    return step


def _batch(kernel: Kernel, rows: Sequence[Array]) -> Callable[[], Any]:
    columns = [np.stack(each) for each in zip(*(_arguments(kernel, x) for x in rows), strict=True)]
    room = list(kernel.batch(*columns)[:-1])
    return lambda: kernel.batch(*columns, out=room)


def _arguments(kernel: Kernel, x: Array) -> list[Array]:
    ports = kernel.record.inputs
    parts = np.split(x, np.cumsum([port.size for port in ports])[:-1])
    return [part.reshape(port.shape).copy() for part, port in zip(parts, ports, strict=True)]


def _filterpy(samples: Sequence[tuple[Array, Array]]) -> Callable[[], Any]:
    """Return one step of an IMM of sixteen UKFs, a failed channel's row of the measurement being zero."""
    kalman: Any = importlib.import_module("filterpy.kalman")

    def observation(failed: int) -> Callable[[Array], Array]:
        keep = np.array([0.0 if failed >> bit & 1 else 1.0 for bit in (0, 1, 2, 3, 3, 3, 3)])
        return lambda state: np.array([*state[4:], *state[:4]]) * keep

    filters, chain = [], np.array([[1 - 2e-4, 2e-4], [5e-3, 1 - 5e-3]])
    for failed in range(16):
        points = kalman.MerweScaledSigmaPoints(7, alpha=1.0, beta=2.0, kappa=0.0)
        ukf = kalman.UnscentedKalmanFilter(7, 7, DT, hx=observation(failed), fx=_moved, points=points)
        ukf.x = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        ukf.P = np.diag([2.5e-5] * 4 + [4e-4] * 3)
        ukf.Q = np.diag([1e-10] * 4 + [1e-6] * 3)
        ukf.R = np.diag([_GYRO] * 3 + [_STAR / 4] * 4)
        filters.append(ukf)
    transition = np.ones((1, 1))
    for _ in range(4):
        transition = np.kron(chain, transition)
    bank = kalman.IMMEstimator(filters, np.full(16, 1.0 / 16.0), transition)
    feed: Iterator[tuple[Array, Array]] = cycle(samples)

    def step() -> Any:
        star, gyro = next(feed)
        bank.predict()
        bank.update(np.array([*gyro, *star]))
        return bank.x

    return step


def _moved(x: Array, dt: float) -> Array:
    """One Runge-Kutta step in plain Python numbers."""
    start = x.tolist()
    k1 = _rates(start)
    k2 = _rates([a + 0.5 * dt * b for a, b in zip(start, k1, strict=True)])
    k3 = _rates([a + 0.5 * dt * b for a, b in zip(start, k2, strict=True)])
    k4 = _rates([a + dt * b for a, b in zip(start, k3, strict=True)])
    return np.array(
        [a + dt / 6.0 * (b + 2.0 * (c + d) + e) for a, b, c, d, e in zip(start, k1, k2, k3, k4, strict=True)]
    )


def _rates(state: Sequence[float]) -> list[float]:
    x, y, z, s, p, q, r = state
    jx, jy, jz = _J
    return [
        *(0.5 * (s * p - q * z + r * y), 0.5 * (s * q - r * x + p * z), 0.5 * (s * r - p * y + q * x)),
        -0.5 * (p * x + q * y + r * z),
        *((COMMAND[0] - (jz - jy) * q * r) / jx, (COMMAND[1] - (jx - jz) * r * p) / jy),
        (COMMAND[2] - (jy - jx) * p * q) / jz,
    ]


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each figure over the rounds."""
    names = [name for name in rows[0] if name != "case"]
    return {name: float(np.median([row[name] for row in rows])) for name in names}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars against filterpy, where it is there."""
    bars = ((32, 300), (128, 60))
    return [
        judge_bar(
            f"filterpy-{modes}",
            f"a step of filterpy's bank of 16 filters takes as long as {least} steps of {modes} hypotheses or more",
            measured=figures[f"filterpy_over_{modes}"],
            holds=figures[f"filterpy_over_{modes}"] >= least,
        )
        for modes, least in bars
        if f"filterpy_over_{modes}" in figures
    ]


study = Study(
    name="fault-bank-timing",
    title="Joint bank of fault hypotheses: one compiled step against filterpy's bank of sixteen filters",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=3,
)
