"""Interval-Wahba front: the paper's two objectives side by side, as a genetic algorithm searches them.

The unit lengths are met by construction, not by equality constraints that random points never satisfy: q is normalised,
a direction of a box is normalised and must then still lie in its box.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array
from optsat.attitude.davenport import canonical, davenport_matrix
from optsat.errors import InputError, explain_unknown_fields
from optsat.forms import FrontForm, Point
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_pairs import IntervalPairs
from optsat.solution import Proof, Solution

# how far a normalised direction may leave its box by rounding
_INSIDE = 1e-12


@dataclass(frozen=True)
class IntervalFront:
    """Members of the front that a search found; nothing says that it is the whole or the true front.

    q_BN (k, 4); mid_loss, loss_change (k,) : L_m and DL of each, re-evaluated; absolute values where asked for
    compromise : the member whose larger objective is least, the only choice that needs no knowledge of the truth
    """

    q_BN: Array
    mid_loss: Array
    loss_change: Array
    compromise: int


@explain_unknown_fields
@dataclass(frozen=True)
class IntervalWahbaFront:
    """Trade L_m against DL over q within a fraction of the TRIAD attitude and directions within their boxes.

    b_B, r_N : ComponentBox; weights : (m,) >= 0, equal when None; absolute : |DL| in place of DL
    search_fraction : range of each component of q about the TRIAD attitude of the middles, q_k +- fraction |q_k|

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    Source: interval-robust Wahba paper, section on the simulation: NSGA-II with TRIAD seeds and a range of 10 %.
    """

    b_B: ComponentBox
    r_N: ComponentBox
    weights: ArrayLike | None = None
    absolute: bool = True
    search_fraction: float = 0.1
    pairs: IntervalPairs = field(init=False, repr=False)

    def __post_init__(self) -> None:
        fraction = self.search_fraction
        if isinstance(fraction, bool) or not isinstance(fraction, int | float) or not 0 < fraction < np.inf:
            raise InputError(f"`search_fraction` must be a number > 0, got {fraction!r}.")
        object.__setattr__(self, "pairs", IntervalPairs(self.b_B, self.r_N, self.weights))

    def lower(self) -> FrontForm:
        """Return the front form in (q, alpha, beta)."""
        seed = self.pairs.triad()
        reach, free = self.search_fraction * np.abs(seed), np.ones(6 * len(self.pairs))
        return FrontForm(
            lower=np.concatenate((seed - reach, -free)),
            upper=np.concatenate((seed + reach, free)),
            objectives=2,
            constraints=len(free),
            evaluate=self._evaluate,
        )

    def interpret(self, point: Point, solver: str) -> Solution[IntervalFront]:
        """Return the front's members; FEASIBLE where there is one, since a search by values proves no more."""
        members = np.asarray(point.stats["members"])
        objectives, outside = self._evaluate(members)
        q = members[:, :4] / np.linalg.norm(members[:, :4], axis=1, keepdims=True)
        answer = IntervalFront(
            q_BN=np.asarray(canonical(q)) if len(members) else np.zeros((0, 4)),
            mid_loss=objectives[:, 0],
            loss_change=objectives[:, 1],
            compromise=int(np.argmin(np.max(objectives, axis=1))) if len(members) else -1,
        )
        return Solution(
            answer,
            point.termination,
            Proof.FEASIBLE if len(members) else Proof.NOTHING,
            {"violation": float(np.max(outside, initial=0.0))},
            None,
            {"solver": solver, "iterations": point.iterations},
        )

    def _evaluate(self, points: Array) -> tuple[Array, Array]:
        pairs, count = self.pairs, len(self.pairs)
        q = points[:, :4] / np.linalg.norm(points[:, :4], axis=1, keepdims=True)
        alpha, beta = np.moveaxis(points[:, 4:].reshape(-1, 2, count, 3), 1, 0)
        b, r = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in pairs.directions(alpha, beta))
        K_m = pairs.mid_matrix()
        mid = 1.0 - np.einsum("ki,ij,kj->k", q, K_m, q)
        change = np.einsum("ki,kij,kj->k", q, K_m - davenport_matrix(b, r, pairs.share), q)
        outside = np.concatenate(
            (np.abs(b - pairs.b_mid) - pairs.b_radius, np.abs(r - pairs.r_mid) - pairs.r_radius), axis=1
        ).reshape(len(points), 6 * count)
        return np.column_stack((mid, np.abs(change) if self.absolute else change)), outside - _INSIDE
