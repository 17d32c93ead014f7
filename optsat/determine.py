"""Determine: attitude from vector observations, with a proof of the optimum or a guaranteed bound on the error."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optsat.arrays import Array, NormPolicy, finite_array, normalise_rows
from optsat.attitude.davenport import quaternion_from_dcm
from optsat.attitude.status import AttitudeStatus
from optsat.attitude.two_vector import best_weights, collinear, pair_angle, wahba_dcm
from optsat.certificates.attitude_bound import ball_of, weighted_sum
from optsat.errors import InputError, explain_unknown_options, nearest_name
from optsat.solution import Proof, Solution
from optsat.solve import solve

if TYPE_CHECKING:
    from optsat.problems.certified_attitude import CertifiedAttitude
    from optsat.problems.component_box import ComponentBox
    from optsat.problems.wahba import WahbaAttitude
    from optsat.problems.worst_case_wahba import WorstCaseAttitude

WahbaMethod = Literal["davenport", "svd", "two_vector", "triad"]
Refinement = Literal["cells", "subpaving"]

_BLOCK = 2048
_OK, _UNBOUNDED, _INCONSISTENT = range(3)


@explain_unknown_options
def wahba(
    b_B: ArrayLike,
    r_N: ArrayLike,
    weights: ArrayLike | None = None,
    *,
    method: WahbaMethod = "davenport",
    norm_policy: NormPolicy = "warn",
) -> "Solution[WahbaAttitude]":
    """Return the attitude that minimises Wahba's loss, proven optimal from the vectors for weight ratios up to 1e16.

    b_B, r_N : (m, 3) directions in B and N, any length; weights : (m,) >= 0, any scale, equal when None
    method : "davenport", "svd", "two_vector" (m = 2, closed form), "triad" (m = 2, heavier pair matched exactly)

    Raises
    ------
    InputError : input that cannot be used, or an unknown method. UnsupportedFormError : the method cannot pose this
    problem.
    NotProvenError : the method's answer is not the optimum (TRIAD on data that disagree); kept in `error.solution`.
    """
    from optsat.problems.wahba import Wahba
    from optsat.solvers import SOLVERS

    methods = {solver.name: solver for solver in SOLVERS[:4]}
    if method not in methods:
        raise InputError(f"`method` {method!r} is unknown.{nearest_name(str(method), list(methods))}")
    return solve(Wahba(b_B, r_N, weights, norm_policy), methods[method]).require(Proof.GLOBAL)


@explain_unknown_options
def certify_attitude(
    b_B: "ArrayLike | ComponentBox",
    r_N: "ArrayLike | ComponentBox",
    angle_bound_rad: ArrayLike | None = None,
    *,
    weights: ArrayLike | None = None,
    cuts: tuple[ArrayLike, ArrayLike, ArrayLike] | None = None,
    refine: Refinement | None = None,
    norm_policy: NormPolicy = "warn",
) -> "CertifiedAttitude":
    """Return an attitude and an angle that its error surely does not exceed, with a certificate.

    b_B, r_N : (m, 3) directions in B and N, any length, or a ComponentBox
    angle_bound_rad : (m,) or scalar, how far b_i may be from A r_i: body and reference bounds added, in [0, pi) [rad]
    weights : (m,) certify exactly these; None optimises them
    cuts : half-spaces u . A(q) w >= c as (u (k, 3), w (k, 3), c (k,))
    refine : "cells" or "subpaving" tighten the bound for three and more vectors (3 to 50 times the work)

    Raises
    ------
    InputError : input that cannot be used; the message names the argument and the first bad row.
    Source: robust Wahba specification, sections 6 and 7.
    """
    from optsat.problems.certified_attitude import CertifiedAttitudeProblem
    from optsat.problems.refined_enclosure import RefinedEnclosure

    refinements = ["cells", "subpaving"]
    if refine is not None and refine not in refinements:
        raise InputError(f"`refine` {refine!r} is unknown.{nearest_name(str(refine), refinements)}")
    problem = CertifiedAttitudeProblem(b_B, r_N, angle_bound_rad, cuts, norm_policy)
    solution = problem.with_weights(weights) if weights is not None else solve(problem)
    attitude = solution.answer
    if refine is None or attitude.status is not AttitudeStatus.OK or attitude.bound_rad >= 2 * np.pi / 3:
        return attitude
    from optsat.solvers.cell_cover import CellCoverSolver
    from optsat.solvers.subpaving import SubpavingSolver

    refined = solve(RefinedEnclosure(attitude), CellCoverSolver() if refine == "cells" else SubpavingSolver())
    return refined.answer


@explain_unknown_options
def worst_case_wahba(
    b_B: "ComponentBox",
    r_N: "ComponentBox | ArrayLike",
    weights: ArrayLike | None = None,
    *,
    norm_policy: NormPolicy = "warn",
) -> "Solution[WorstCaseAttitude]":
    """Return the attitude whose Wahba loss is least when every direction is at its worst in its box.

    A worst case, not an accuracy: its mean attitude error is the plain solution's or more. To determine an attitude
    take `wahba`; to bound its error, `certify_attitude`.

    b_B : ComponentBox of m measured directions; r_N : ComponentBox, or (m, 3) exactly known directions
    weights : (m,) >= 0, equal when None
    Proof GLOBAL: the worst-case loss meets its lower bound; `certificate` re-proves it without a solver, and how far an
    attitude as good may be. STATIONARY or FEASIBLE: `answer.lower_bound` still holds for every attitude.

    Raises
    ------
    InputError : input that cannot be used; the message names the argument. InfeasibleBoxError : a box holds no unit
    vector.
    Source: robust Wahba specification, section 7.4.
    """
    from optsat.problems.worst_case_epigraph import WorstCaseEpigraph
    from optsat.problems.worst_case_wahba import WorstCaseWahba
    from optsat.solvers.clarabel import Clarabel

    problem = WorstCaseWahba(b_B, r_N, weights, norm_policy)
    solution = solve(problem, Clarabel(tolerance=1e-12, prescaled=True))
    if solution.proof is Proof.GLOBAL:
        return solution
    return solve(WorstCaseEpigraph(problem, solution))


@dataclass(frozen=True)
class CertifiedBatch:
    """Attitudes and guaranteed bounds of many poses.

    q_BN (n, 4); bound_rad (n,) [rad], pi when unbounded, NaN when inconsistent; weights (n, m), sum 1
    status_index (n,) : place in `statuses`
    """

    statuses: ClassVar[tuple[AttitudeStatus, ...]] = tuple(AttitudeStatus)

    q_BN: Array
    bound_rad: Array
    weights: Array
    status_index: NDArray[np.int8]

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Which poses are determined (n,)."""
        return np.asarray(self.status_index == _OK)

    @property
    def inconsistent(self) -> NDArray[np.bool_]:
        """Which poses contradict their bounds (n,)."""
        return np.asarray(self.status_index == _INCONSISTENT)

    @property
    def unbounded(self) -> NDArray[np.bool_]:
        """Which poses leave a rotation free (n,)."""
        return np.asarray(self.status_index == _UNBOUNDED)

    def __len__(self) -> int:
        return len(self.q_BN)


@explain_unknown_options
def certify_attitude_batch(
    b_B: ArrayLike, r_N: ArrayLike, angle_bound_rad: ArrayLike, *, norm_policy: NormPolicy = "silent"
) -> CertifiedBatch:
    """Return attitudes and guaranteed bounds of n poses of m vectors each, as arrays.

    b_B, r_N : (n, m, 3); angle_bound_rad : scalar, (m,) or (n, m) [rad]. Two vectors run as whole arrays, more pose
    by pose.

    Raises
    ------
    InputError : input that cannot be used; the first bad pose and row are named.
    """
    b, r = (finite_array(name, value, (None, None, 3)) for name, value in (("b_B", b_B), ("r_N", r_N)))
    if b.shape != r.shape:
        raise InputError(f"`b_B` and `r_N` must have the same shape (n, m, 3), got {b.shape} and {r.shape}.")
    if b.shape[1] < 1:
        raise InputError("`b_B` holds no vectors; at least one a pose is needed.")
    b, r = normalise_rows("b_B", b, norm_policy), normalise_rows("r_N", r, norm_policy)
    eps = _batch_bounds(angle_bound_rad, b.shape[:2])
    n, m = eps.shape
    q_BN, bound, weights = np.empty((n, 4)), np.empty(n), np.empty((n, m))
    status = np.empty(n, dtype=np.int8)
    special = np.ones(n, dtype=bool)
    if m == 2:
        special = np.empty(n, dtype=bool)
        for first in range(0, n, _BLOCK):
            part = slice(first, first + _BLOCK)
            q_BN[part], bound[part], weights[part], status[part], special[part] = _two_vectors(
                b[part], r[part], eps[part]
            )
    for k in np.flatnonzero(special):
        one = certify_attitude(b[k], r[k], eps[k], norm_policy="silent")
        q_BN[k], bound[k], weights[k] = one.q_BN, one.bound_rad, one.weights
        status[k] = CertifiedBatch.statuses.index(one.status)
    return CertifiedBatch(q_BN, bound, weights, status)


def _batch_bounds(value: ArrayLike, shape: tuple[int, ...]) -> Array:
    eps = finite_array("angle_bound_rad", value, unit="rad")
    if eps.ndim > 2 or (eps.ndim == 2 and eps.shape != shape) or (eps.ndim == 1 and eps.shape != shape[1:]):
        raise InputError(
            f"`angle_bound_rad` must be a scalar, ({shape[1]},) or {tuple(shape)} [rad], got shape {eps.shape}."
        )
    if np.any(eps < 0) or np.any(eps >= np.pi):
        index = tuple(int(i) for i in np.argwhere((eps < 0) | (eps >= np.pi))[0])
        hint = " This looks like degrees; use numpy.deg2rad." if eps[index] >= np.pi else ""
        where = f"index {index[0] if len(index) == 1 else index}" if index else "the value"
        raise InputError(f"`angle_bound_rad` must be in [0, pi) [rad]: {where} is {eps[index]:g}.{hint}")
    return np.array(np.broadcast_to(eps, shape))


def _two_vectors(b: Array, r: Array, eps: Array) -> tuple[Array, Array, Array, NDArray[np.int8], NDArray[np.bool_]]:
    """Return q, bound, weights, status of n two-vector poses, and which ones the closed form does not cover."""
    excess = np.abs(pair_angle(b) - pair_angle(r)) - eps.sum(axis=1)
    flat = collinear(b, r)
    safe_b, safe_r = np.where(flat[:, None, None], np.eye(3)[:2], b), np.where(flat[:, None, None], np.eye(3)[:2], r)
    weights = best_weights(safe_b, safe_r, eps)
    q_BN = quaternion_from_dcm(wahba_dcm(safe_b, safe_r, weights))
    ball = ball_of(weighted_sum(safe_b, safe_r, 2 * np.sin(eps / 2) ** 2, weights, q_BN))
    inconsistent = (excess > 1e-12) | ball.empty
    status = np.where(inconsistent, _INCONSISTENT, np.where(ball.bound_rad < np.pi, _OK, _UNBOUNDED))
    bound = np.where(inconsistent, np.nan, ball.bound_rad)
    return q_BN, bound, weights, status.astype(np.int8), flat | ((excess > 0) & (excess <= 1e-12))
