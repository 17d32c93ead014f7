"""Certified attitude: an attitude and the angle that its error surely does not exceed, from bounded errors."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, NormPolicy, angle_bounds, direction_pairs, pair_weights
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.attitude.alignment import curvature, smallest_rotation
from optsat.attitude.covariance import attitude_covariance
from optsat.attitude.davenport import canonical, rotation_matrix
from optsat.attitude.status import AttitudeStatus
from optsat.certificates.attitude_bound import Ball, ball_of, centred_sum, ellipsoid, sum_about
from optsat.certificates.attitude_certificate import AttitudeCertificate
from optsat.errors import InputError, explain_unknown_fields
from optsat.forms import EnclosureForm, Point
from optsat.problems.component_box import ComponentBox, box_constraints
from optsat.solution import Proof, Solution, Termination

_PROOF = {
    AttitudeStatus.OK: Proof.GLOBAL,
    AttitudeStatus.UNBOUNDED: Proof.UNDECIDED,
    AttitudeStatus.INCONSISTENT: Proof.INFEASIBLE,
}
# mismatch beyond the bounds that is granted to rounding of the input, as in the attitude problem depot
_GRANTED_RAD = 1e-12


@dataclass(frozen=True)
class CertifiedAttitude:
    """An attitude and a guaranteed bound on its error.

    q_BN (4,), dcm_BN (3, 3) : the attitude, b_B = A(q_BN) r_N; the smallest rotation of the free set when UNBOUNDED
    bound_rad : every attitude that fits the bounds is within this angle of q_BN; pi when UNBOUNDED, NaN when
    INCONSISTENT
    status : OK | UNBOUNDED | INCONSISTENT; termination, proof : why the solver stopped, what is proven
    weights (m,) : of the measurements, sum 1
    unobservable_axis_B (3,) : when UNBOUNDED, the axis of the rotation that geometry leaves free or the bounds confine
    least; None where more than one rotation is free
    inconsistent_pairs : index pairs whose mutual angle contradicts their bounds; suspects : indices that the proof
    rests on
    certificate : re-checks the claim without a solver
    """

    q_BN: Array
    dcm_BN: Array
    bound_rad: float
    status: AttitudeStatus
    termination: Termination
    proof: Proof
    weights: Array
    eigen_gap: float
    unobservable_axis_B: Array | None
    inconsistent_pairs: tuple[tuple[int, int], ...]
    suspects: tuple[int, ...]
    certificate: AttitudeCertificate
    stats: Mapping[str, Any] = field(repr=False)

    @property
    def bound_deg(self) -> float:
        """The guaranteed bound [deg]."""
        return float(np.degrees(self.bound_rad))

    def covariance_B(self, sigma_rad: ArrayLike | None = None) -> Array:
        """Return the first-order covariance (3, 3) [rad^2] in B of the attitude error.

        sigma_rad : (m,) or scalar deviation per tangent axis [rad]; None takes errors spread evenly over their
        cones, bound / 2.

        Raises
        ------
        InputError : the attitude is not OK (no covariance exists), or sigma_rad cannot be used.
        """
        if self.status is not AttitudeStatus.OK:
            raise InputError(f"The covariance does not exist. {self.message()}")
        data = self.certificate.admissible
        sigma = data.angle_bound_rad / 2 if sigma_rad is None else sigma_rad
        return attitude_covariance(data.b_B, self.weights, sigma)

    def ellipsoid_B(self) -> Array:
        """Return E (3, 3) with g^T E g <= 1 for the error g = tan(angle / 2) axis in B of every admissible attitude.

        Stated about the centre of the two-eigenvalue proof, q_BN unless the bound was refined.

        Raises
        ------
        InputError : the attitude is not OK, so no ellipsoid is finite.
        """
        if self.status is not AttitudeStatus.OK:
            raise InputError(
                f"The attitude is {self.status.value}; only an attitude that is ok has an error ellipsoid."
            )
        plain = replace(self.certificate, refinement=None)
        if self.certificate.refinement is not None:
            plain = replace(plain, q_BN=self.certificate.refinement.pivot_BN)
        return ellipsoid(sum_about(plain.admissible, plain.weights, plain.q_BN), plain.ball())

    def message(self) -> str:
        """Return the result in one sentence."""
        if self.status is AttitudeStatus.UNBOUNDED and self.unobservable_axis_B is not None:
            axis = np.array2string(self.unobservable_axis_B, precision=4, suppress_small=True)
            return (
                f"Attitude not observable: the rotation about {axis} in B is undetermined. "
                "Add a direction off that axis, or tighter bounds."
            )
        return self.certificate.claim


@explain_unknown_fields
@dataclass(frozen=True)
class CertifiedAttitudeProblem:
    """Find the smallest ball of attitudes that surely holds the truth.

    b_B, r_N : (m, 3) directions, or a ComponentBox each; angle_bound_rad : (m,) or scalar, body and reference bounds
    added, in [0, pi) [rad]; may be None when a box is given (then it is what comes on top of the boxes: 0)
    cuts : half-spaces u . A(q) w >= c as (u (k, 3), w (k, 3), c (k,))

    Raises
    ------
    InputError : an argument that cannot be used, named with its first bad row; InfeasibleBoxError : a box off the
    unit sphere.
    """

    b_B: ArrayLike | ComponentBox
    r_N: ArrayLike | ComponentBox
    angle_bound_rad: ArrayLike | None = None
    cuts: tuple[ArrayLike, ArrayLike, ArrayLike] | None = None
    norm_policy: NormPolicy = "warn"
    admissible: AdmissibleSet = field(init=False, repr=False)
    inflation_rad: float = field(init=False, default=0.0)
    contradicting: tuple[tuple[int, int], ...] = field(init=False, repr=False, default=())

    def __post_init__(self) -> None:
        b_B, r_N, bound, cut_B, cut_N, level = box_constraints(self.b_B, self.r_N, self.angle_bound_rad, self.cuts)
        b, r = direction_pairs(b_B, r_N, self.norm_policy)
        eps = angle_bounds("angle_bound_rad", bound, len(b))
        admissible = AdmissibleSet(b, r, eps, cut_B, cut_N, level)
        excess = admissible.mismatch_rad() - eps[:, None] - eps[None, :]
        largest = float(excess.max())
        object.__setattr__(self, "contradicting", admissible.inconsistent_pairs() if largest > _GRANTED_RAD else ())
        if 0.0 < largest <= _GRANTED_RAD:
            object.__setattr__(self, "inflation_rad", _GRANTED_RAD)
            admissible = AdmissibleSet(b, r, np.minimum(eps + _GRANTED_RAD, np.pi), cut_B, cut_N, level)
        object.__setattr__(self, "admissible", admissible)

    def lower(self) -> EnclosureForm:
        """Return the enclosure form."""
        return EnclosureForm(self.admissible)

    def with_weights(self, weights: ArrayLike) -> Solution[CertifiedAttitude]:
        """Return what the given weights (m,) of the cones prove; nothing is optimised."""
        cones = pair_weights("weights", weights, self.admissible.cone_count)
        padded = np.concatenate((cones, np.zeros(len(self.admissible.cut_level))))
        return self.interpret(Point(x=np.zeros(4), dual=padded, termination=Termination.CONVERGED), "given weights")

    def interpret(self, point: Point, solver: str) -> Solution[CertifiedAttitude]:
        """Return the ball that the point's weights prove, re-evaluated outward rounded.

        An earlier pass's where they prove none.
        """
        certificate, ball = self._certificate(point.dual)
        if ball.status is AttitudeStatus.UNBOUNDED or point.termination is not Termination.CONVERGED:
            others = (self._certificate(weights) for weights in point.stats.get("candidates", ()))
            certificate, ball = min(
                ((certificate, ball), *others), key=lambda pair: (not bool(pair[1].empty), float(pair[1].bound_rad))
            )
        answer = self._answer(point, certificate, ball)
        return Solution(
            answer=answer,
            termination=point.termination,
            proof=answer.proof,
            residuals={"s1": float(ball.s1), "s2": float(ball.s2)},
            certificate=answer.certificate,
            stats={**answer.stats, "solver": solver, "iterations": point.iterations},
        )

    def _certificate(self, weights: Array) -> tuple[AttitudeCertificate, Ball]:
        """Return the certificate of the weights, its bound bit for bit what `verify` will recompute."""
        weights = weights / weights.sum()
        # divided by its sum once more, as `verify` will; q and -q have the same matrix to the last bit
        total = centred_sum(self.admissible, weights / weights.sum())
        ball = ball_of(total)
        bound = 0.0 if bool(ball.empty) else float(ball.bound_rad)
        return AttitudeCertificate(self.admissible, weights, canonical(total.q_BN), bound, ball.status), ball

    def _answer(self, point: Point, certificate: AttitudeCertificate, ball: Ball) -> CertifiedAttitude:
        data = self.admissible
        cones = certificate.weights[: data.cone_count]
        axis = None
        if ball.status is AttitudeStatus.UNBOUNDED and float(cones.sum()) > 0:
            here = curvature(data.b_B, data.r_N, cones, certificate.q_BN)
            if len(here.free_axes_B):
                q_BN = canonical(smallest_rotation(certificate.q_BN, here.free_axes_B))
                certificate = replace(certificate, q_BN=q_BN)
            # the axis that geometry leaves free, or the one that the bounds confine least
            weakest = np.linalg.eigh(sum_about(data, certificate.weights, certificate.q_BN).C)[1][:, 0]
            axis = here.free_axes_B[0] if len(here.free_axes_B) == 1 else weakest
            axis = None if len(here.free_axes_B) > 1 else np.sign(axis[np.argmax(np.abs(axis))]) * axis + 0.0
        contradicting = self.contradicting
        if contradicting:
            certificate = replace(certificate, status=AttitudeStatus.INCONSISTENT, bound_rad=0.0, pair=contradicting[0])
        suspects = tuple(sorted({i for pair in contradicting for i in pair}))
        if certificate.status is AttitudeStatus.INCONSISTENT and not suspects:
            suspects = tuple(np.flatnonzero(cones > 1e-3 * cones.max()).tolist())
        return CertifiedAttitude(
            q_BN=certificate.q_BN,
            dcm_BN=rotation_matrix(certificate.q_BN),
            bound_rad=float("nan") if certificate.status is AttitudeStatus.INCONSISTENT else certificate.bound_rad,
            status=certificate.status,
            termination=point.termination,
            proof=_PROOF[certificate.status],
            weights=cones / cones.sum() if float(cones.sum()) > 0 else cones,
            eigen_gap=float(ball.s1 - ball.s2),
            unobservable_axis_B=axis,
            inconsistent_pairs=contradicting,
            suspects=suspects,
            certificate=certificate,
            stats={"inflation_rad": self.inflation_rad, "solver_status": point.stats.get("status", "")},
        )
