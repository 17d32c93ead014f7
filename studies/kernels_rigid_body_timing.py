"""Time of one rigid-body step as a compiled kernel against Basilisk, a spacecraft and a step; ratios only.

Not like for like: Basilisk's spacecraft also moves along its orbit and writes messages at every step, in C++ and
without Python between the steps; ours turns only, as a batch of many spacecraft whose states go out to arrays and come
back at every step. Both take one fourth-order Runge-Kutta step of the attitude. Without Basilisk no ratio is printed.
"""

import importlib
import importlib.util
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude import mrp, quaternion
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.export.catalogue import build
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.peak import measured_peak
from optsat.models.draws import rotations
from optsat.models.rigid_body import EXAMPLE_INERTIA

BATCH, STEPS = 8192, 2000
DT = 0.1


def cases(count: int) -> list[Case]:
    """Return rounds, each with states of its own."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratio of one round, and how far the two attitudes are apart after 200 s."""
    kernel = make_kernel(build("rigid_body_step"))
    q_BN, omega = rotations(rng, BATCH), 0.03 * rng.standard_normal((BATCH, 3))
    torque, dt = np.zeros(3), np.array(DT)
    alternatives: dict[str, Callable[[], object]] = {"batch": lambda: kernel.batch(q_BN, omega, torque, dt)}
    peer = importlib.util.find_spec("Basilisk") is not None
    if peer:
        alternatives["basilisk"] = basilisk(q_BN[0], omega[0])
    times = time_interleaved(alternatives, rounds=5)
    row: dict[str, Any] = {
        "share_of_peak": times.per_second("batch") * BATCH * kernel.record.operations / measured_peak(),
        "form": kernel.form,
        "width": kernel.record.width,
    }
    if peer:
        row["basilisk_over_batch"] = times.ratio("basilisk", "batch") * BATCH / STEPS
        ours: tuple[Array, Array] = (q_BN[0], omega[0])
        for _ in range(STEPS):
            ours = kernel(*ours, torque, dt)
        row["difference_rad"] = float(quaternion.error_angle(ours[0], basilisk(q_BN[0], omega[0])()))
    return row


def basilisk(q_BN: Array, omega_BN_B: Array) -> Callable[[], Array]:
    """Return a function that moves Basilisk's spacecraft on by `STEPS` steps and returns its attitude then."""

    def part(name: str) -> Any:
        return importlib.import_module(f"Basilisk.{name}")

    macros, spacecraft = part("utilities.macros"), part("simulation.spacecraft").Spacecraft()
    simulation = part("utilities.SimulationBaseClass").SimBaseClass()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(DT)))
    spacecraft.ModelTag = "body"
    hub = spacecraft.hub
    hub.mHub, hub.IHubPntBc_B = 100.0, [list(row) for row in EXAMPLE_INERTIA]
    hub.r_BcB_B = [[0.0]] * 3
    hub.r_CN_NInit, hub.v_CN_NInit = [[7e6], [0.0], [0.0]], [[0.0], [7.5e3], [0.0]]
    hub.sigma_BNInit = mrp.from_quaternion(q_BN)[:, None].tolist()
    hub.omega_BN_BInit = omega_BN_B[:, None].tolist()
    simulation.AddModelToTask("task", spacecraft)
    simulation.InitializeSimulation()
    stops = itertools.count(STEPS, STEPS)

    def advance() -> Array:
        simulation.ConfigureStopTime(macros.sec2nano(DT * next(stops)))
        simulation.ExecuteSimulation()
        return np.asarray(mrp.to_quaternion(np.array(spacecraft.scStateOutMsg.read().sigma_BN)))

    return advance


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each figure over the rounds."""
    names = [name for name, value in rows[0].items() if name != "case" and not isinstance(value, str)]
    return {name: float(np.median([row[name] for row in rows])) for name in names}


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bar on time, where Basilisk is there."""
    if "basilisk_over_batch" not in figures:
        return []
    ratio = figures["basilisk_over_batch"]
    return [
        judge_bar(
            "basilisk", "a spacecraft and a step is 300 times as fast as Basilisk's", measured=ratio, holds=ratio >= 300
        )
    ]


study = Study(
    name="kernels-rigid-body-timing",
    title="Rigid-body step: compiled batch against Basilisk, a spacecraft and a step",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
