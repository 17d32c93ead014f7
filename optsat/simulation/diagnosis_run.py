"""Diagnosis run: what the sensors of a scenario send, and apart from it the truth, for one seed or many at once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.models.parts import Part
from optsat.records.record import Mask
from optsat.records.telemetry import Telemetry
from optsat.simulation.diagnosis_scenario import DiagnosisScenario
from optsat.simulation.diagnosis_truth import DiagnosisTruth
from optsat.simulation.readings import Draws, readings_of
from optsat.simulation.true_run import Motion, true_run

Seed = int | np.random.Generator
_MOST_NUMBERS = 200_000_000


@dataclass(frozen=True, eq=False)
class DiagnosisRun:
    """One run: its telemetry for the diagnosis, its truth for the judge. The telemetry holds nothing of the truth."""

    telemetry: Telemetry
    truth: DiagnosisTruth


@dataclass(frozen=True, eq=False)
class DiagnosisRuns:
    """N runs of one scenario as arrays, for estimators that work on many at once; runs[i] is one of them.

    t : (N, T) [s]; command_torque_B : (T, 3) [N m]
    readings : the arrays (N, T) or (N, T, k) of `Telemetry` by name
    motion : the truth; torque_B, gyro_bias : (N, T, 3) [N m], [rad/s]; faulty : (N, T, P) of the spacecraft's parts
    """

    scenario: DiagnosisScenario
    t: Array
    command_torque_B: Array
    readings: dict[str, Array]
    motion: Motion
    torque_B: Array
    gyro_bias: Array
    faulty: Mask

    def __len__(self) -> int:
        return len(self.t)

    def __getitem__(self, index: int) -> DiagnosisRun:
        """Return one run.

        Raises
        ------
        IndexError : there are not so many.
        """
        source = f"simulated scenario {self.scenario.name}"
        own = {name: values[index] for name, values in self.readings.items()}
        motion = {name: values[index].copy() for name, values in vars(self.motion).items() if name != "gravity_N"}
        return DiagnosisRun(
            Telemetry(t=self.t[index], command_torque_B=self.command_torque_B, source=source, **own),
            DiagnosisTruth(
                t=self.t[index].copy(),
                **motion,
                torque_B=self.torque_B[index].copy(),
                gyro_bias=self.gyro_bias[index].copy(),
                parts=self.scenario.spacecraft.parts,
                faulty=self.faulty[index].copy(),
                faults=self.scenario.faults,
            ),
        )

    def __iter__(self) -> Iterator[DiagnosisRun]:
        return (self[index] for index in range(len(self)))


def simulate(scenario: DiagnosisScenario, seed: Seed) -> DiagnosisRun:
    """Return what the sensors send in one run, and the truth.

    seed : whole number >= 0, or a generator, from which each noise takes a stream of its own: the noise of one sensor
        does not depend on faults, nor on which other sensors there are

    Raises
    ------
    InputError : the seed is neither.
    """
    return simulate_many(scenario, (seed,))[0]


def simulate_many(scenario: DiagnosisScenario, seeds: Sequence[Seed]) -> DiagnosisRuns:
    """Return one run for each seed, each the same to the bit as alone.

    Raises
    ------
    InputError : no seeds, one that is none, or more numbers than fit into memory; simulate those in parts.
    """
    grid = scenario.grid()
    if not len(seeds):
        raise InputError("`seeds` holds no seed; one run needs one.")
    if len(seeds) * len(grid) > _MOST_NUMBERS // 50:
        raise InputError(f"{len(seeds)} runs of {len(grid)} rows do not fit into memory; simulate them in parts.")
    draws = [Draws(_generator(seed), scenario) for seed in seeds]
    t = np.stack([grid + draw.jitter for draw in draws])
    thrusters = scenario.spacecraft.thrusters
    command = scenario.command_torque_B.at(grid)
    condition = [value.reshape(-1, 3) for value in thrusters.condition(t, scenario.faults)]
    wanted = np.broadcast_to(command, (*t.shape, 3)).reshape(-1, 3)
    torque_B = thrusters.torque().batch(wanted, *condition).reshape(*t.shape, 3)
    motion = true_run(
        scenario,
        t,
        torque_B,
        np.stack([draw.rate_noise for draw in draws]),
        np.stack([draw.acceleration_noise for draw in draws]),
    )
    readings, gyro_bias = readings_of(scenario, t, motion, torque_B, draws)
    kept = np.ones(len(grid), dtype=bool)
    for start, stop in scenario.gaps_s:
        kept &= ~((grid >= start) & (grid < stop))
    faulty = _faulty(scenario, t)
    return DiagnosisRuns(
        scenario=scenario,
        t=t[:, kept],
        command_torque_B=command[kept],
        readings={name: values[:, kept] for name, values in readings.items()},
        motion=Motion(**{name: values[:, kept] for name, values in vars(motion).items()}),
        torque_B=torque_B[:, kept],
        gyro_bias=gyro_bias[:, kept],
        faulty=faulty[:, kept],
    )


def _faulty(scenario: DiagnosisScenario, t: Array) -> Mask:
    parts: tuple[Part, ...] = scenario.spacecraft.parts
    faulty = np.zeros((*t.shape, len(parts)), dtype=bool)
    for fault in scenario.faults:
        faulty[..., parts.index(fault.part)] |= fault.active(t)
    return faulty


def _generator(seed: Seed) -> np.random.Generator:
    if isinstance(seed, np.random.Generator):
        return seed
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"`seed` must be a whole number >= 0 or a numpy.random.Generator, got {seed!r}.")
    return np.random.default_rng(seed)
