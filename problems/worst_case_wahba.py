"""Worst-case Wahba: the attitude whose loss is least when every direction is at its worst in its box.

What it is for: the guarantee that no placement of the directions inside their boxes costs more, an acceptance figure
for a sensor specification. What it is not for: accuracy. The mean attitude error is that of the plain solution or
worse, since the method pays everywhere for the corner that it fears; for an attitude to fly take `optsat.wahba`, for a
bound on its error `optsat.certify_attitude`.

min over A of sum_i a_i max over the boxes of 1/2 |b - A r|^2. The inner maximum sits at a corner, and a corner's loss
is linear in A, so over the convex hull of the rotations, X = q q^T relaxed to X >= 0, tr X = 1, the problem is a
semidefinite programme with one row per corner, for body boxes and reference boxes alike. Its optimum is an attitude
where X has rank one, which is nearly always; the multipliers prove the bound either way.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, NormPolicy, normalise_rows, unit_rows
from optsat.attitude import quaternion
from optsat.attitude.alignment import curvature
from optsat.attitude.box_corners import BoxCorners
from optsat.attitude.davenport import canonical, davenport_matrix, dominant_quaternion, rotation_matrix
from optsat.attitude.status import AttitudeStatus
from optsat.certificates.worst_case_certificate import WorstCaseCertificate
from optsat.errors import InputError, explain_unknown_fields
from optsat.forms import ConicForm, Point, symmetric_vector
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_pairs import IntervalPairs
from optsat.solution import Proof, Solution

# of the gap between worst-case loss and lower bound, relative to the loss
GLOBAL = 1e-6
_LARGEST_SCALE = 3.0
# corners times pairs: the programme is dense
_MOST_ENTRIES = 20_000_000
_UPPER = tuple((i, j) for j in range(3) for i in range(j + 1))


@dataclass(frozen=True)
class WorstCaseAttitude:
    """Answer of the worst-case Wahba problem, every number recomputed from the boxes.

    q_BN (4,), dcm_BN (3, 3); worst_case_loss : 1/2 sum a |b - A r|^2 with every direction at its worst, sum a = 1 [-]
    lower_bound : no attitude has less; q_method_loss : worst-case loss of the plain solution of the middles
    worst_b_B, worst_r_N (m, 3) : the corners that cost most at q_BN
    status : UNBOUNDED where the middles leave a rotation free
    rank_ratio : second over first eigenvalue of the programme's X, NaN where none was solved; small = one attitude
    certificate : proves the lower bound, and how far any attitude as good can be
    """

    q_BN: Array
    dcm_BN: Array
    worst_case_loss: float
    lower_bound: float
    q_method_loss: float
    worst_b_B: Array
    worst_r_N: Array
    status: AttitudeStatus
    rank_ratio: float
    certificate: WorstCaseCertificate = field(repr=False)


@explain_unknown_fields
@dataclass(frozen=True)
class WorstCaseWahba:
    """Minimise over attitudes the largest Wahba loss over the boxes; a worst case, not an accuracy.

    b_B : ComponentBox of m rows; r_N : ComponentBox, or (m, 3) directions that are known exactly
    weights : (m,) >= 0, equal when None
    The condition |b| = |r| = 1 on what lies in the boxes is dropped: the value is an upper bound of the worst case
    over unit vectors.

    Raises
    ------
    InputError : input that cannot be used; the message names the argument.
    Source: robust Wahba specification, section 7.4; the programme over corners of both boxes is ours.
    """

    b_B: ComponentBox
    r_N: ComponentBox | ArrayLike
    weights: ArrayLike | None = None
    norm_policy: NormPolicy = "warn"
    corners: BoxCorners = field(init=False, repr=False)
    pivot_BN: Array = field(init=False, repr=False)
    scale: float = field(init=False, repr=False)

    def __post_init__(self) -> None:
        if not isinstance(self.b_B, ComponentBox):
            raise InputError(
                f"`b_B` must be a ComponentBox, got {type(self.b_B).__name__}; use ComponentBox.from_half_width."
            )
        if len(self.b_B) == 0:
            raise InputError("`b_B` holds no boxes; at least one is needed.")
        r_N = self.r_N
        if not isinstance(r_N, ComponentBox):
            r_N = ComponentBox.from_half_width(unit_rows("r_N", r_N, self.norm_policy), 0.0)
        pairs = IntervalPairs(self.b_B, r_N, self.weights)
        count = int(np.sum(2 ** np.count_nonzero(np.hstack((pairs.b_radius, pairs.r_radius)), axis=1)))
        if count * len(pairs) > _MOST_ENTRIES:
            raise InputError(
                f"`b_B` and `r_N` have {count} corners in {len(pairs)} pairs, more than the programme can hold; take "
                "fewer pairs, or boxes that are uncertain in fewer components."
            )
        corners = BoxCorners(pairs.b_mid, pairs.b_radius, pairs.r_mid, pairs.r_radius, pairs.share)
        unit = normalise_rows("b_B", pairs.b_mid), normalise_rows("r_N", pairs.r_mid)
        pivot = dominant_quaternion(davenport_matrix(*unit, pairs.share))
        object.__setattr__(self, "corners", corners)
        object.__setattr__(self, "pivot_BN", canonical(pivot))
        object.__setattr__(self, "scale", self._scale())

    def _scale(self) -> float:
        """Return tan(theta / 2) of a turn from the pivot by which the middles alone cost more than the worst case."""
        loss = self.corners.worst_case_loss(self.pivot_BN)
        middles = BoxCorners(
            self.corners.b_mid,
            np.zeros_like(self.corners.b_radius),
            self.corners.r_mid,
            np.zeros_like(self.corners.r_radius),
            self.corners.weights,
        )
        steepness = float(np.linalg.eigvalsh(middles.mixture(self.corners.weights, self.pivot_BN)[2])[0])
        return float(np.clip(np.sqrt(loss / max(steepness, 1e-30)), 1e-13, _LARGEST_SCALE))

    def lower(self) -> ConicForm:
        """Return the programme in x = (G: 6 upper-triangle entries, h: 3, t: m), all numbers of order one.

        X = D Y D^T about the pivot, Y = [[1 - s^2 tr G, h^T], [h, G]] >= 0; minimise sum a_i t_i with t_i >= loss_v(Y)
        in units of the pivot's own worst-case loss.
        """
        corners, s = self.corners, self.scale
        a, h, C = corners.quadratics(self.pivot_BN)
        unit = max(corners.worst_case_loss(self.pivot_BN), 1e-26)
        count, m = len(a), len(corners.weights)
        A, b = np.zeros((count + 10, 9 + m)), np.zeros(count + 10)
        for k, (i, j) in enumerate(_UPPER):
            A[:count, k] = s**2 * (C[:, i, i] - a if i == j else 2 * C[:, i, j]) / unit
            A[count:, k] = -symmetric_vector(_entry(i + 1, j + 1) - (s**2 * _entry(0, 0) if i == j else 0.0))
        A[:count, 6:9] = 2 * s * h / unit
        A[count:, 6:9] = -np.transpose([symmetric_vector(_entry(0, k)) for k in (1, 2, 3)])
        A[np.arange(count), 9 + corners.pair] = -1.0
        b[:count] = -a / unit
        b[count:] = symmetric_vector(_entry(0, 0))
        q = np.concatenate((np.zeros(9), corners.weights))
        return ConicForm(q, A, b, (("nonnegative", count), ("psd_triangle", 4)))

    def interpret(self, point: Point, solver: str) -> Solution[WorstCaseAttitude]:
        """Return the best attitude of the programme, its multipliers and the q-method, with what is proven of it.

        Proof GLOBAL: worst-case loss and lower bound meet to 1e-6 of the loss; else FEASIBLE, with the bound as it is.
        """
        shares = self.shares(point.dual[: len(self.corners.pair)])
        candidates = [self.pivot_BN, dominant_quaternion(davenport_matrix(self.corners.b_B, self.corners.r_N, shares))]
        rank_ratio = float("nan")
        if len(point.x) and np.all(np.isfinite(point.x)):
            q_BN, rank_ratio = self._rounded(point.x)
            candidates.append(q_BN)
        return self.judge(candidates, shares, point, solver, rank_ratio)

    def judge(
        self, candidates: list[Array], shares: Array, point: Point, solver: str, rank_ratio: float
    ) -> Solution[WorstCaseAttitude]:
        """Return the candidate (4,) of least worst-case loss with what the shares (S,) prove about it."""
        corners = self.corners
        q_BN = canonical(min(candidates, key=corners.worst_case_loss))
        certificate = WorstCaseCertificate.of(corners, shares, q_BN)
        loss = corners.worst_case_loss(q_BN)
        unit = normalise_rows("b_B", corners.b_mid), normalise_rows("r_N", corners.r_mid)
        flat = len(curvature(*unit, corners.weights, self.pivot_BN).free_axes_B) > 0
        losses = corners.losses(q_BN)
        worst = [
            first + int(np.argmax(part))
            for first, part in zip(corners.first, np.split(losses, corners.first[1:]), strict=True)
        ]
        answer = WorstCaseAttitude(
            q_BN=q_BN,
            dcm_BN=rotation_matrix(q_BN),
            worst_case_loss=loss,
            lower_bound=loss - certificate.gap,
            q_method_loss=corners.worst_case_loss(self.pivot_BN),
            worst_b_B=corners.b_B[worst],
            worst_r_N=corners.r_N[worst],
            status=AttitudeStatus.UNBOUNDED if flat else AttitudeStatus.OK,
            rank_ratio=rank_ratio,
            certificate=certificate,
        )
        return Solution(
            answer,
            point.termination,
            Proof.GLOBAL if certificate.gap <= GLOBAL * loss else Proof.FEASIBLE,
            {"gap": certificate.gap, "distance_rad": certificate.distance_rad},
            certificate,
            {"solver": solver, "iterations": point.iterations, **point.stats},
        )

    def shares(self, multipliers: Array) -> Array:
        """Return shares (S,) from multipliers of the corners: >= 0, each pair's scaled to its weight.

        A pair without any, as after a solver's failure, is put at its worst corner as seen from the pivot.
        """
        corners = self.corners
        worst = np.zeros(len(corners.pair))
        losses = corners.losses(self.pivot_BN)
        for first, part in zip(corners.first, np.split(losses, corners.first[1:]), strict=True):
            worst[first + int(np.argmax(part))] = 1.0
        given = np.zeros(len(worst))
        if len(multipliers) == len(given):
            given = np.where(np.isfinite(multipliers), np.maximum(multipliers, 0.0), 0.0)
        total = np.add.reduceat(given, corners.first)[corners.pair]
        weight = corners.weights[corners.pair]
        return np.asarray(weight * np.where(total > 0, given / np.where(total > 0, total, 1.0), worst))

    def _rounded(self, x: Array) -> tuple[Array, float]:
        """Return the attitude of the largest eigenvalue of X about the pivot, and X's second eigenvalue over it."""
        Y = np.zeros((4, 4))
        for k, (i, j) in enumerate(_UPPER):
            Y[i + 1, j + 1] = Y[j + 1, i + 1] = x[k]
        Y[0, 1:] = Y[1:, 0] = x[6:9]
        Y[0, 0] = 1.0 - self.scale**2 * np.trace(Y[1:, 1:])
        D = np.array([1.0, self.scale, self.scale, self.scale])
        values, vectors = np.linalg.eigh(D[:, None] * Y * D)
        q_BN = quaternion.compose(vectors[[1, 2, 3, 0], -1], self.pivot_BN)
        return np.asarray(q_BN / np.linalg.norm(q_BN)), float(max(values[-2], 0.0) / values[-1])


def _entry(i: int, j: int) -> Array:
    E = np.zeros((4, 4))
    E[i, j] = E[j, i] = 1.0
    return E
