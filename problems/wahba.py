"""Wahba's problem: the attitude of least weighted squared misfit between measured and reference directions."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, NormPolicy, direction_pairs, pair_weights
from optsat.attitude.alignment import curvature, loss, smallest_rotation
from optsat.attitude.covariance import attitude_covariance
from optsat.attitude.davenport import canonical, rotation_matrix
from optsat.attitude.status import AttitudeStatus
from optsat.errors import explain_unknown_fields
from optsat.forms import AlignmentForm, Point
from optsat.solution import Proof, Solution

# a Newton step below this many roundings of the data's own amplification counts as converged
_STATIONARY = 1e3 * 2.0**-53


@dataclass(frozen=True)
class WahbaAttitude:
    """Answer of Wahba's problem.

    q_BN (4,), dcm_BN (3, 3) : the attitude; loss : 1/2 sum a |b - A r|^2 with sum a = 1 [-]
    status : OK, or UNBOUNDED when a whole set is optimal (then q_BN is its smallest rotation)
    free_axes_B : (k, 3) axes about which a rotation costs nothing, k = 0 when OK
    weights (m,) : sum 1
    """

    q_BN: Array
    dcm_BN: Array
    loss: float
    status: AttitudeStatus
    free_axes_B: Array
    weights: Array
    b_B: Array = field(repr=False)

    def covariance_B(self, sigma_rad: ArrayLike) -> Array:
        """Return the covariance (3, 3) [rad^2] of the attitude error in B for direction noise of sigma_rad per axis
        (m,).

        Raises
        ------
        InputError : the attitude is UNBOUNDED, or sigma_rad is not positive and finite.
        """
        return attitude_covariance(self.b_B, self.weights, sigma_rad)


@explain_unknown_fields
@dataclass(frozen=True)
class Wahba:
    """Minimise 1/2 sum a_i |b_i - A(q) r_i|^2, a = weights / sum of weights, directions scaled to length 1.

    b_B, r_N : (m, 3) directions, any length > 0; weights : (m,) >= 0, equal when None

    Raises
    ------
    InputError : shapes, counts, zero vectors, weights or numbers that cannot be used; the message names the argument.
    """

    b_B: ArrayLike
    r_N: ArrayLike
    weights: ArrayLike | None = None
    norm_policy: NormPolicy = "warn"
    form: AlignmentForm = field(init=False, repr=False)

    def __post_init__(self) -> None:
        b, r = direction_pairs(self.b_B, self.r_N, self.norm_policy)
        object.__setattr__(self, "form", AlignmentForm(b, r, pair_weights("weights", self.weights, len(b))))

    def lower(self) -> AlignmentForm:
        """Return the alignment form."""
        return self.form

    def interpret(self, point: Point, solver: str) -> Solution[WahbaAttitude]:
        """Return the attitude with its distance from the optimum recomputed from the vectors.

        Proof GLOBAL: the Newton step vanishes and the Hessian is positive (a strict local minimum of Wahba's loss is
        global) or flat; STATIONARY: the step vanishes elsewhere; FEASIBLE: a rotation that is not the optimum.
        """
        b, r, w = self.form.b_B, self.form.r_N, self.form.weights
        q_BN = np.asarray(point.x)
        here = curvature(b, r, w, q_BN)
        flat = len(here.free_axes_B) > 0
        if flat:
            q_BN = smallest_rotation(q_BN, here.free_axes_B)
        q_BN = canonical(q_BN)
        distance = float(2 * np.linalg.norm(here.step)) if not flat else float("nan")
        vanishing = flat or distance <= _STATIONARY * (1 + here.amplification)
        if vanishing and (flat or here.sharpness > 1):
            proof = Proof.GLOBAL
        else:
            proof = Proof.STATIONARY if vanishing else Proof.FEASIBLE
        answer = WahbaAttitude(
            q_BN=q_BN,
            dcm_BN=rotation_matrix(q_BN),
            loss=loss(b, r, w, q_BN),
            status=AttitudeStatus.UNBOUNDED if flat else AttitudeStatus.OK,
            free_axes_B=here.free_axes_B,
            weights=w,
            b_B=b,
        )
        return Solution(
            answer=answer,
            termination=point.termination,
            proof=proof,
            residuals={"distance_to_optimum_rad": distance, "gradient": float(np.max(np.abs(here.gradient)))},
            stats={"solver": solver, "iterations": point.iterations, **point.stats},
        )
