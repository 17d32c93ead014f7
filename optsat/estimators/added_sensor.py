"""Added sensor: the cheapest of the sensors on offer with which faults can be told apart."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optsat.errors import InputError
from optsat.estimators.isolability import AdditiveFault, Isolability, isolability
from optsat.models.linear_discrete import LinearDiscreteModel, LinearSensor

MOST_CANDIDATES = 10


@dataclass(frozen=True, eq=False)
class AddedSensor:
    """What to add so that no exact zero is left, and what each candidate does alone.

    sensors : names to add; empty when nothing is missing, None when all candidates together do not help
    cost : of these sensors together; infinite when nothing helps
    isolability : with them; with all candidates when nothing helps
    alone : by candidate, with that one added
    """

    sensors: tuple[str, ...] | None
    cost: float
    isolability: Isolability
    alone: dict[str, Isolability]

    @property
    def says(self) -> str:
        """The answer as a sentence."""
        if self.sensors is None:
            return "No sensor on offer removes the zeros, nor do all together. " + " ".join(self.isolability.says)
        if not self.sensors:
            return "No sensor is missing: the faults are told apart already."
        return f"Cheapest that tells the faults apart: {' and '.join(self.sensors)}, cost {self.cost:g}."


def cheapest_added_sensor(
    model: LinearDiscreteModel,
    faults: Sequence[AdditiveFault],
    window: float,
    candidates: Sequence[LinearSensor],
    simultaneous: bool = False,
    least: float = 0.0,
) -> AddedSensor:
    """Return the cheapest sensors to add so that every fault is seen and no pair is confused.

    All subsets are tried by rising cost, then fewest sensors. An added sensor is taken as healthy: name it in `faults`
    by its own name to count its failure too; such a fault is left out where the sensor is not fitted.

    simultaneous : every fault must also be told from all the others failing together
    least : [nats] that detection and every pair must reach besides; 0 removes exact zeros alone

    Raises
    ------
    InputError : as for `isolability`; no candidate, more than 10, or a negative cost.
    """
    if not 1 <= len(candidates) <= MOST_CANDIDATES:
        raise InputError(f"`candidates` must hold 1 to {MOST_CANDIDATES} sensors, got {len(candidates)}.")
    offered = {sensor.name for sensor in candidates}

    def judged(added: Sequence[LinearSensor]) -> Isolability:
        absent = offered - {sensor.name for sensor in added}
        return isolability(model.with_sensors(*added), [f for f in faults if not absent & set(f.sizes)], window)

    alone = {sensor.name: judged([sensor]) for sensor in candidates}
    subsets = [s for k in range(len(candidates) + 1) for s in itertools.combinations(candidates, k)]
    for subset in sorted(subsets, key=lambda s: (sum(sensor.cost for sensor in s), len(s))):
        result = judged(subset)
        if _told(result, simultaneous, least):
            return AddedSensor(
                tuple(sensor.name for sensor in subset), float(sum(s.cost for s in subset)), result, alone
            )
    return AddedSensor(None, float("inf"), judged(candidates), alone)


def _told(result: Isolability, simultaneous: bool, least: float) -> bool:
    zeros = result.undetectable.any() or result.indistinguishable.any() or (simultaneous and result.masked.any())
    pairs = result.distinguishability[~np.eye(len(result.faults), dtype=bool)]
    return not zeros and bool(np.all(result.detection >= least) and np.all(pairs >= least))
