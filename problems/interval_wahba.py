"""Interval Wahba: the paper's two objectives over all attitudes and all directions in their boxes, by goal attainment.

Minimised together are L_m = 1 - q^T K_m q, the loss of the boxes' middles, and DL = -q^T (K_Db + K_Dr + K_DbDr) q, its
change when the directions move inside their boxes, over q_BN, alpha and beta with |q| = |b_i| = |r_i| = 1.

Theorem (degeneracy). Let all middles be unit vectors. Then every minimiser of max(lambda_1 L_m, lambda_2 DL), signed or
absolute and for all lambda_1 > 0, lambda_2 >= 0, and of every p-norm of the two, has L_m = 1 - lambda_max(K_m): its
attitude is that of the plain q-method of the middles, unique where lambda_max is simple.
Proof. By the definition of the largest eigenvalue L_m >= 1 - lambda_max(K_m) for every unit q, so no point has a factor
below lambda_1 (1 - lambda_max); this is >= 0, since q^T K_m q = sum a_i b_i . A r_i <= 1 for unit vectors. The point
(q-method, alpha = beta = 0) satisfies every constraint because the middles are unit vectors, and has DL = 0, so its
factor is lambda_1 (1 - lambda_max): it is a minimiser. At any minimiser lambda_1 L_m <= factor = lambda_1
(1 - lambda_max), hence L_m = 1 - lambda_max and q is an eigenvector of lambda_max. For a p-norm replace the maximum by
the norm, which is no less than lambda_1 |L_m|. QED.
Corollary. With |DL| as second objective both reach their least values in that one point, which is the whole Pareto
front: there is nothing to trade. A trade exists only for signed DL or for middles that are not unit vectors.

So the formulation, taken at its word, returns the q-method: the optimiser may move the directions as it likes, and
moves them nowhere. What guards against the worst direction in the boxes must maximise over them: `WorstCaseWahba`.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.attitude.davenport import canonical, rotation_matrix
from optsat.attitude.status import AttitudeStatus
from optsat.errors import InputError, explain_unknown_fields
from optsat.forms import MinMaxForm, Point
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_pairs import IntervalPairs
from optsat.problems.interval_wahba_functions import interval_functions
from optsat.problems.minimax import Minimax
from optsat.solution import Proof, Solution

# of the factor against its lower bound, in the unit of the objectives; and what rounding of a loss near 0 may be
_GLOBAL, _ROUNDING = 1e-8, 1e-15
# least and largest unit of the objectives
_UNITS = (1e-4, 1.0)
# gap of the two largest eigenvalues of K_m below which a whole set of attitudes is optimal
_SIMPLE = 1e-9


@dataclass(frozen=True)
class IntervalAttitude:
    """Answer of the interval-Wahba problem; every number is re-evaluated at the point.

    q_BN (4,), dcm_BN (3, 3); b_B, r_N (m, 3) : the directions that the optimiser picked in their boxes
    mid_loss, loss_change : L_m and DL there
    factor : the goal that was minimised, max(lambda_i f_i), or the p-norm; lower_bound : no point has less
    status : UNBOUNDED where the middles leave a rotation free, so that the attitude is one of many
    """

    q_BN: Array
    dcm_BN: Array
    b_B: Array
    r_N: Array
    mid_loss: float
    loss_change: float
    factor: float
    lower_bound: float
    status: AttitudeStatus


@explain_unknown_fields
@dataclass(frozen=True)
class IntervalWahba:
    """Minimise max(lambda_1 L_m, lambda_2 DL), or another norm of the two, over q_BN and the directions in their boxes.

    With unit middles the answer is the q-method's (theorem above). Kept as the paper's method, to be compared.

    b_B, r_N : ComponentBox; weights : (m,) >= 0, equal when None
    absolute : |L_m| and |DL|, as the paper's infinity norm says; False: signed, as min-max solvers have it
    goal_norm : p >= 1 of (sum_i (lambda_i |f_i|)^p)^(1/p); infinity is the paper's choice
    goal_weights : lambda (2,) >= 0
    shared : one alpha and one beta for all pairs, as the paper's matrix form writes it
    search_fraction : each component of q within q_k +- fraction |q_k| of the TRIAD attitude of the middles; None = free
    minimax : the problem in (q, alpha, beta) as solvers see it, objectives in units of the least L_m (1e-4 to 1)

    Raises
    ------
    InputError : an argument that cannot be used; the message names it.
    Source: interval-robust Wahba paper, eqs. (7), (8) and the goal-attainment form after them.
    """

    b_B: ComponentBox
    r_N: ComponentBox
    weights: ArrayLike | None = None
    absolute: bool = True
    goal_norm: float = float("inf")
    goal_weights: ArrayLike = (1.0, 1.0)
    shared: bool = False
    search_fraction: float | None = None
    pairs: IntervalPairs = field(init=False, repr=False)
    unit: float = field(init=False, repr=False)
    minimax: Minimax = field(init=False, repr=False)

    def __post_init__(self) -> None:
        scale = self._checked_goal_weights()
        object.__setattr__(self, "pairs", IntervalPairs(self.b_B, self.r_N, self.weights))
        least = abs(1.0 - float(np.linalg.eigvalsh(self.pairs.mid_matrix())[-1]))
        # a solver's tolerance is absolute, and the loss of data that agree to arcminutes is tiny
        object.__setattr__(self, "unit", float(np.clip(least, *_UNITS)))
        object.__setattr__(self, "minimax", self._minimax(scale / self.unit))

    def _checked_goal_weights(self) -> Array:
        scale = finite_array("goal_weights", self.goal_weights, (2,))
        if np.any(scale < 0) or not np.any(scale > 0):
            raise InputError(f"`goal_weights` must be >= 0 and not all zero, got {scale}.")
        norm = self.goal_norm
        if isinstance(norm, bool) or not isinstance(norm, int | float) or not norm >= 1:
            raise InputError(f"`goal_norm` must be a number p >= 1 or infinity, got {norm!r}.")
        if np.isfinite(norm) and not self.absolute:
            raise InputError("`goal_norm` below infinity is a norm of absolute values; signed needs infinity.")
        if not self.absolute and not np.all(scale > 0):
            raise InputError(f"`goal_weights` must both be positive where objectives are signed, got {scale}.")
        fraction = self.search_fraction
        if fraction is not None and (
            isinstance(fraction, bool) or not isinstance(fraction, int | float) or not 0 <= fraction < np.inf
        ):
            raise InputError(f"`search_fraction` must be a number >= 0 or None, got {fraction!r}.")
        return scale

    def _minimax(self, scale: Array) -> Minimax:
        pairs, norm = self.pairs, bool(np.isfinite(self.goal_norm))
        objectives, constraints = interval_functions(len(pairs), self.shared, norm)
        seed = pairs.triad()
        free = 6 * (1 if self.shared else len(pairs))
        reach = np.full(4, 1.0) if self.search_fraction is None else self.search_fraction * np.abs(seed)
        middle = np.zeros(4) if self.search_fraction is None else seed
        lower = np.concatenate((middle - reach, np.full(free, -1.0), np.zeros(2 * norm)))
        upper = np.concatenate((middle + reach, np.ones(free), np.full(2 * norm, np.inf)))
        start = np.concatenate((seed, np.zeros(free)))
        if norm:
            parts = pairs.losses(seed, np.zeros((len(pairs), 3)), np.zeros((len(pairs), 3)))
            start = np.append(start, scale * np.abs((parts.mid, parts.change)))
        # a direction of no uncertainty has its length already; a row that nothing can move would only hinder solvers
        size = np.max(np.stack((pairs.b_radius, pairs.r_radius), axis=1), axis=2).ravel()
        slack = np.where(np.append(1.0, size) == 0.0, np.inf, 0.0)
        return Minimax(
            start,
            objectives,
            absolute=self.absolute and not norm,
            lb=lower,
            ub=upper,
            constraints=constraints,
            constraints_lb=np.concatenate((-slack, np.full(4 * norm, -np.inf))),
            constraints_ub=np.concatenate((slack, np.zeros(4 * norm))),
            parameter_values=np.concatenate(
                (
                    *(each.ravel() for each in (pairs.b_mid, pairs.b_radius, pairs.r_mid, pairs.r_radius)),
                    np.where(size > 0, size, 1.0),
                    pairs.share,
                    scale,
                    [self.goal_norm if norm else 1.0],
                )
            ),
            start=start,
        )

    def lower(self) -> MinMaxForm:
        """Return the min-max form."""
        return self.minimax.lower()

    def interpret(self, point: Point, solver: str) -> Solution[IntervalAttitude]:
        """Return the attitude, GLOBAL where the factor meets the theorem's lower bound, else as minimax found it."""
        general = self.minimax.interpret(point, solver)
        x = general.answer.x
        rows = 1 if self.shared else len(self.pairs)
        alpha, beta = x[4 : 4 + 6 * rows].reshape(2, rows, 3)
        q_BN = canonical(x[:4] / np.linalg.norm(x[:4]))
        b_B, r_N = self.pairs.directions(alpha, beta)
        full = np.ones((len(self.pairs), 3))
        parts = self.pairs.losses(q_BN, alpha * full, beta * full)
        factor, bound = self._factor(float(parts.mid), float(parts.change)), self._lower_bound()
        values = np.linalg.eigvalsh(self.pairs.mid_matrix())
        proof = general.proof
        feasible = proof in (Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL)
        if feasible and factor - bound <= _GLOBAL * self.unit + _ROUNDING:
            proof = Proof.GLOBAL
        answer = IntervalAttitude(
            q_BN=q_BN,
            dcm_BN=rotation_matrix(q_BN),
            b_B=b_B,
            r_N=r_N,
            mid_loss=float(parts.mid),
            loss_change=float(parts.change),
            factor=factor,
            lower_bound=bound,
            status=AttitudeStatus.OK if values[-1] - values[-2] > _SIMPLE else AttitudeStatus.UNBOUNDED,
        )
        return Solution(
            answer,
            general.termination,
            proof,
            {**general.residuals, "gap": factor - bound},
            None,
            general.stats,
        )

    def _factor(self, mid: float, change: float) -> float:
        goals = finite_array("goal_weights", self.goal_weights) * np.array([mid, change])
        if not self.absolute:
            return float(np.max(goals))
        return float(np.linalg.norm(goals, ord=self.goal_norm))

    def _lower_bound(self) -> float:
        scale = finite_array("goal_weights", self.goal_weights)
        least = float(scale[0] * (1.0 - np.linalg.eigvalsh(self.pairs.mid_matrix())[-1]))
        return max(0.0, least) if self.absolute else least


def interval_wahba_forms(b_B: ComponentBox, r_N: ComponentBox) -> dict[str, Minimax]:
    """Return the paper's problem in its three forms, as ordinary min-max problems by name; factors as in `minimax`.

    "absolute" : max(|L_m|, |DL|); "signed" : max(L_m, DL); "two_norm" : the sum of the squares
    """
    options: dict[str, dict[str, Any]] = {"absolute": {}, "signed": {"absolute": False}, "two_norm": {"goal_norm": 2.0}}
    return {name: IntervalWahba(b_B, r_N, **choice).minimax for name, choice in options.items()}
