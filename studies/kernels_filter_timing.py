"""Time of the seven-state unscented filter as a compiled kernel against filterpy and Stone Soup; ratios only.

All three take one step of the same attitude filter: a rigid body's quaternion and rate by one Runge-Kutta step, both
measured, 15 sigma points. filterpy gets the model in plain Python numbers, which is its fastest form; Stone Soup the
model over all sigma points at once. A peer that is absent is left out, and its claim with it.
"""

import importlib
import importlib.util
import math
import types
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.export.catalogue import build
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.peak import measured_peak
from optsat.kernels.processor import lane_width
from optsat.models.rigid_body import EXAMPLE_INERTIA

BATCH = 2048
DT = 0.1
TORQUE = (0.01, -0.02, 0.005)
PROCESS, MEASUREMENT = np.full(7, 1e-8), np.full(7, 1e-6)
_INERTIA = tuple(float(EXAMPLE_INERTIA[k][k]) for k in range(3))


def cases(count: int) -> list[Case]:
    """Return rounds, each with a state of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round, and how far the peers' states are from ours after a step."""
    kernel = make_kernel(build("unscented_filter_7"))
    x = np.concatenate([_unit(rng.standard_normal(4)), 0.05 * rng.standard_normal(3)])
    z = x + 1e-3 * rng.standard_normal(7)
    P, torque, dt = 1e-6 * np.eye(7), np.array(TORQUE), np.array(DT)
    states, measured = np.tile(x, (BATCH, 1)), z + 1e-4 * rng.standard_normal((BATCH, 7))
    covariances = np.tile(P, (BATCH, 1, 1))
    arguments = (x, P, torque, dt, z, PROCESS, MEASUREMENT)
    batch = (states, covariances, torque, dt, measured, PROCESS, MEASUREMENT)
    room = [np.empty_like(result) for result in kernel.batch(*batch)]
    peers = {name: maker(x, P, z) for name, maker in PEERS.items() if maker.available()}
    times = time_interleaved(
        {
            "call": lambda: kernel(*arguments),
            "batch": lambda: kernel.batch(*batch, out=room),
            "fresh_batch": lambda: kernel.batch(*batch),
            **peers,
        },
        rounds=5,
    )
    ours = kernel(*arguments)[0]
    row: dict[str, Any] = {
        "share_of_peak": times.per_second("batch") * BATCH * kernel.record.operations / measured_peak(),
        "form": kernel.form,
        "lanes": lane_width("double"),
    }
    for name, step in peers.items():
        row[f"{name}_over_call"] = times.ratio(name, "call")
        row[f"{name}_over_batch"] = times.ratio(name, "batch") * BATCH
        row[f"{name}_over_fresh_batch"] = times.ratio(name, "fresh_batch") * BATCH
        row[f"{name}_difference"] = float(np.max(np.abs(_unit_part(step()) - ours)))
    return row


class Peer:
    """A filter of another library as a function of nothing that takes one step from the same state."""

    def __init__(self, module: str, make: Callable[[Array, Array, Array], Callable[[], Array]]) -> None:
        self.module, self.make = module, make

    def available(self) -> bool:
        """Return whether the library is installed."""
        return importlib.util.find_spec(self.module) is not None

    def __call__(self, x: Array, P: Array, z: Array) -> Callable[[], Array]:
        """Return the step."""
        return self.make(x, P, z)


def _filterpy(x: Array, P: Array, z: Array) -> Callable[[], Array]:
    kalman: Any = importlib.import_module("filterpy.kalman")
    points = kalman.MerweScaledSigmaPoints(7, alpha=1.0, beta=2.0, kappa=0.0)
    ukf = kalman.UnscentedKalmanFilter(7, 7, DT, hx=lambda state: state, fx=_scalar_step, points=points)
    ukf.Q, ukf.R = np.diag(PROCESS), np.diag(MEASUREMENT)

    def step() -> Array:
        ukf.x, ukf.P = x.copy(), P.copy()
        ukf.predict()
        ukf.update(z)
        return np.asarray(ukf.x)

    return step


def _stone_soup(x: Array, P: Array, z: Array) -> Callable[[], Array]:
    def part(module: str, name: str) -> Any:
        return getattr(importlib.import_module(f"stonesoup.{module}"), name)

    vectors, state_vector = part("types.array", "StateVectors"), part("types.array", "StateVector")
    transition_base = part("models.transition.base", "TransitionModel")
    gaussian = part("models.base", "GaussianModel")

    def function(_self: Any, state: Any, noise: Any = False, **_options: Any) -> Any:
        moved = _batched_step(np.asarray(state.state_vector, dtype=float))
        return vectors(moved) if moved.shape[1] > 1 else state_vector(moved)

    body = {"ndim_state": 7, "function": function, "covar": lambda _self, **_options: np.diag(PROCESS)}
    motion = types.new_class("Motion", (transition_base, gaussian), exec_body=lambda space: space.update(body))

    from datetime import UTC, datetime, timedelta

    start = datetime(2026, 1, 1, tzinfo=UTC)
    measurement_model = part("models.measurement.linear", "LinearGaussian")(
        ndim_state=7, mapping=tuple(range(7)), noise_covar=np.diag(MEASUREMENT)
    )
    predictor = part("predictor.kalman", "UnscentedKalmanPredictor")(motion(), alpha=1.0, beta=2.0, kappa=0.0)
    updater = part("updater.kalman", "UnscentedKalmanUpdater")(measurement_model, alpha=1.0, beta=2.0, kappa=0.0)
    prior = part("types.state", "GaussianState")(x[:, None], P, timestamp=start)
    detection = part("types.detection", "Detection")(z[:, None], timestamp=start + timedelta(seconds=DT))
    hypothesis = part("types.hypothesis", "SingleHypothesis")

    def step() -> Array:
        prediction = predictor.predict(prior, timestamp=detection.timestamp)
        posterior = updater.update(hypothesis(prediction, detection))
        return np.asarray(posterior.state_vector, dtype=float).ravel()

    return step


PEERS = {"filterpy": Peer("filterpy", _filterpy), "stone_soup": Peer("stonesoup", _stone_soup)}


def _scalar_step(x: Array, dt: float) -> Array:
    """One Runge-Kutta step in plain Python numbers."""
    start = x.tolist()
    k1 = _rates(start)
    k2 = _rates([a + 0.5 * dt * b for a, b in zip(start, k1, strict=True)])
    k3 = _rates([a + 0.5 * dt * b for a, b in zip(start, k2, strict=True)])
    k4 = _rates([a + dt * b for a, b in zip(start, k3, strict=True)])
    moved = [a + dt / 6.0 * (b + 2.0 * (c + d) + e) for a, b, c, d, e in zip(start, k1, k2, k3, k4, strict=True)]
    length = math.sqrt(sum(a * a for a in moved[:4]))
    return np.array([*(a / length for a in moved[:4]), *moved[4:]])


def _rates(state: Sequence[float]) -> list[float]:
    x, y, z, s, p, q, r = state
    jx, jy, jz = _INERTIA
    return [
        *(0.5 * (s * p - q * z + r * y), 0.5 * (s * q - r * x + p * z), 0.5 * (s * r - p * y + q * x)),
        -0.5 * (p * x + q * y + r * z),
        *((TORQUE[0] - (jz - jy) * q * r) / jx, (TORQUE[1] - (jx - jz) * r * p) / jy),
        (TORQUE[2] - (jy - jx) * p * q) / jz,
    ]


def _batched_step(x: Array) -> Array:
    """The same over columns (7, n)."""

    def rates(state: Array) -> Array:
        return np.stack(_rates(list(state)))

    k1 = rates(x)
    k2 = rates(x + 0.5 * DT * k1)
    k3 = rates(x + 0.5 * DT * k2)
    k4 = rates(x + DT * k3)
    moved = x + DT / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    moved[:4] /= np.linalg.norm(moved[:4], axis=0)
    return np.asarray(moved)


def _unit(q: Array) -> Array:
    return np.asarray(q / np.linalg.norm(q))


def _unit_part(x: Array) -> Array:
    return np.concatenate([_unit(x[:4]), x[4:]])


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each figure over the rounds."""
    names = [name for name, value in rows[0].items() if name != "case" and not isinstance(value, str)]
    return {name: float(np.median([row[name] for row in rows])) for name in names}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars on time, each where its peer is there; the batch's bar follows the width of the vectors."""
    batch = 1500 if figures["lanes"] >= 8 else 1000
    bars = [
        (
            "filterpy-batch",
            "filterpy_over_batch",
            batch,
            "a step of a batch, into arrays that are there, is as many times as fast as filterpy's",
        ),
        ("filterpy-call", "filterpy_over_call", 150, "one Python call is 150 times as fast as filterpy's step"),
        ("stone-soup-call", "stone_soup_over_call", 40, "one Python call is 40 times as fast as Stone Soup's step"),
    ]
    return [
        judge_bar(id, f"{says}, ratio >= {least}", measured=figures[name], holds=figures[name] >= least)
        for id, name, least, says in bars
        if name in figures
    ]


study = Study(
    name="kernels-filter-timing",
    title="Unscented filter of seven states: compiled kernel against filterpy and Stone Soup",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
