"""The suite of `compare-solvers`: the min-max problems of the literature and the three interval-Wahba forms."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import dominant_quaternion
from optsat.problems.interval_wahba import IntervalWahba, interval_wahba_forms
from optsat.problems.multi_objective import MultiObjective
from optsat.problems.reference_fitting import FITTING
from optsat.problems.reference_minimax import MINIMAX
from optsat.studies._interval_scenario import PRINTED_R_N, consistent_b_B, perturbed, unit_boxes


@dataclass(frozen=True)
class Task:
    """One problem: its optimum, whether it is convex, and how to pose it, from a start (n,) or its usual one."""

    name: str
    optimum: float
    convex: bool
    pose: Callable[[Array | None], MultiObjective]

    @property
    def tolerance(self) -> float:
        """By how much a factor may exceed the optimum: 1e-6 of it, 1e-7 where it is 0."""
        return 1e-6 * abs(self.optimum) or 1e-7


@lru_cache(maxsize=1)
def tasks() -> tuple[Task, ...]:
    """Return all problems."""
    printed = [Task(each.name, each.optimum, each.convex, each.problem) for each in (*MINIMAX, *FITTING)]
    boxes = unit_boxes(*perturbed(np.random.default_rng(0), consistent_b_B(), PRINTED_R_N))
    forms = interval_wahba_forms(boxes.b_B, boxes.r_N)
    # by the theorem of degeneracy the q-method of the middles is optimal, no direction moved
    matrix = IntervalWahba(boxes.b_B, boxes.r_N).pairs.mid_matrix()
    least = _factor_at(forms["absolute"], dominant_quaternion(matrix))
    optima = {"absolute": least, "signed": least, "two_norm": least**2}
    interval = [
        Task(f"interval Wahba, {name}", optima[name], False, partial(_from, problem)) for name, problem in forms.items()
    ]
    return (*printed, *interval)


def _factor_at(problem: MultiObjective, q_BN: Array) -> float:
    form = problem.form
    return form.factor(form.objectives.values(np.append(q_BN, np.zeros(len(form.start) - 4))))


def _from(problem: MultiObjective, start: Array | None) -> MultiObjective:
    return problem if start is None else replace(problem, start=start)
