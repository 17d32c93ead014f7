"""Worst-case epigraph: the worst-case Wahba problem near a known attitude, where its programme left a gap.

The programme over the hull of the rotations may be cheapest at a mixture of attitudes. Then the best attitude is sought
by a local search from the one that the programme suggests; the programme's lower bound stays valid.
"""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.attitude.davenport import turn
from optsat.certificates.worst_case_certificate import loss_bound
from optsat.forms import MinMaxForm, Point
from optsat.problems.minimax import Minimax
from optsat.problems.worst_case_wahba import WorstCaseAttitude, WorstCaseWahba
from optsat.solution import Proof, Solution


@dataclass(frozen=True)
class WorstCaseEpigraph:
    """Minimise sum a_i t_i, t_i >= the loss of every corner of pair i, over attitudes [g; 1] (x) q0.

    problem : the whole problem; found : its solution so far, whose attitude is q0 and whose bound is kept
    """

    problem: WorstCaseWahba
    found: Solution[WorstCaseAttitude]
    minimax: Minimax = field(init=False, repr=False)

    def __post_init__(self) -> None:
        corners, q_BN, s = self.problem.corners, self.found.answer.q_BN, self.problem.scale
        a, h, C = corners.quadratics(q_BN)
        unit = self.found.answer.worst_case_loss
        objective, constraints = _functions(tuple(np.diff(np.append(corners.first, len(a))).tolist()))
        upper = C[:, (0, 0, 0, 1, 1, 2), (0, 1, 2, 1, 2, 2)]
        values = (a / unit, s * h.ravel() / unit, s**2 * upper.ravel() / unit, corners.weights, [s**2])
        start = np.concatenate((np.zeros(3), np.maximum.reduceat(a, corners.first) / unit))
        problem = Minimax(
            start,
            objective,
            constraints=constraints,
            constraints_ub=np.zeros(len(a)),
            parameter_values=np.concatenate(values),
            start=start,
        )
        object.__setattr__(self, "minimax", problem)

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        return self.minimax.lower()

    def interpret(self, point: Point, solver: str) -> Solution[WorstCaseAttitude]:
        """Return the better of both attitudes; STATIONARY where the search proved its own, GLOBAL where a bound
        meets it.
        """
        problem, before = self.problem, self.found.answer
        general = self.minimax.interpret(point, solver)
        q_BN = turn(before.q_BN, problem.scale * general.answer.x[:3])
        mixtures = [before.certificate.shares, problem.shares(general.answer.constraint_multipliers)]
        shares = max(mixtures, key=lambda each: loss_bound(problem.corners, each, q_BN).least)
        solution = problem.judge([before.q_BN, q_BN], shares, point, solver, before.rank_ratio)
        ours = problem.corners.worst_case_loss(q_BN) <= before.worst_case_loss
        proof = solution.proof
        if proof is Proof.FEASIBLE and ours and general.proof is Proof.STATIONARY:
            proof = Proof.STATIONARY
        return replace(solution, proof=proof, residuals={**solution.residuals, "kkt": general.residuals["kkt"]})


@lru_cache(maxsize=32)
def _functions(counts: tuple[int, ...]) -> tuple[Any, Any]:
    """Return sum a_i t_i and (loss_v - t) (1 + s^2 |g|^2), which is <= 0, of x = (g in units of s, t) and numbers."""
    import casadi as ca

    size, pairs = sum(counts), len(counts)
    g, t = ca.SX.sym("g", 3), ca.SX.sym("t", pairs)
    a, h, C = ca.SX.sym("a", size), ca.SX.sym("h", 3 * size), ca.SX.sym("C", 6 * size)
    weights, square = ca.SX.sym("weights", pairs), ca.SX.sym("square")
    length = 1 + square * ca.dot(g, g)
    products = ca.vertcat(g[0] ** 2, 2 * g[0] * g[1], 2 * g[0] * g[2], g[1] ** 2, 2 * g[1] * g[2], g[2] ** 2)
    pair = np.repeat(np.arange(pairs), counts)
    rows = [
        a[v] + 2 * ca.dot(h[3 * v : 3 * v + 3], g) + ca.dot(C[6 * v : 6 * v + 6], products) - t[int(pair[v])] * length
        for v in range(size)
    ]
    x, p = ca.vertcat(g, t), ca.vertcat(a, h, C, weights, square)
    return (
        ca.Function("worst_case_loss", [x, p], [ca.dot(weights, t)]),
        ca.Function("worst_case_corners", [x, p], [ca.vertcat(*rows)]),
    )
