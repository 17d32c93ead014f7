"""Admissible set: all attitudes that satisfy finitely many inequalities u . A(q) w >= c."""

from dataclasses import dataclass, field

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import centred_blocks, rotation_matrix


def _no_vectors() -> Array:
    return np.zeros((0, 3))


def _no_levels() -> Array:
    return np.zeros(0)


@dataclass(frozen=True)
class AdmissibleSet:
    """Attitudes q with b_i . A(q) r_i >= cos(eps_i) for all cones and u_j . A(q) w_j >= c_j for all cuts.

    b_B, r_N : (m, 3) unit rows; angle_bound_rad : (m,) body and reference bound added [rad]
    cut_B, cut_N : (k, 3); cut_level : (k,)
    The cones come first wherever constraints are counted.
    """

    b_B: Array
    r_N: Array
    angle_bound_rad: Array
    cut_B: Array = field(default_factory=_no_vectors)
    cut_N: Array = field(default_factory=_no_vectors)
    cut_level: Array = field(default_factory=_no_levels)

    @property
    def cone_count(self) -> int:
        """Number of cones."""
        return len(self.b_B)

    @property
    def count(self) -> int:
        """Number of constraints, cones and cuts."""
        return len(self.b_B) + len(self.cut_level)

    @property
    def left_B(self) -> Array:
        """All left vectors u (count, 3)."""
        return np.concatenate((self.b_B, self.cut_B)) if len(self.cut_level) else self.b_B

    @property
    def right_N(self) -> Array:
        """All right vectors w (count, 3)."""
        return np.concatenate((self.r_N, self.cut_N)) if len(self.cut_level) else self.r_N

    @property
    def level(self) -> Array:
        """All levels c (count,), cos(eps) for the cones."""
        cones = np.cos(self.angle_bound_rad)
        return np.concatenate((cones, self.cut_level)) if len(self.cut_level) else cones

    @property
    def cone_versine(self) -> Array:
        """1 - cos(eps) of the cones (m,), without cancellation."""
        return np.asarray(2 * np.sin(self.angle_bound_rad / 2) ** 2)

    @property
    def magnitude(self) -> Array:
        """|u| |w| + |c| of each constraint (count,): the scale of its rounding error."""
        return np.asarray(
            np.linalg.norm(self.left_B, axis=-1) * np.linalg.norm(self.right_N, axis=-1) + np.abs(self.level)
        )

    def centred(self, q_BN: Array) -> tuple[Array, Array, Array]:
        """Return all constraints as f(g) = a + 2 h.g + g^T G g about q_BN, f >= 0 inside; no cancellation for cones.

        Returns a (count,), h (count, 3), G (count, 3, 3), for attitudes [g; 1] (x) q_BN.
        """
        y_B = self.right_N @ rotation_matrix(q_BN).T
        linear, block = centred_blocks(self.left_B, y_B, self.level)
        m = self.cone_count
        gap = self.b_B - y_B[:m]
        value = self.cone_versine - 0.5 * np.sum(gap * gap, axis=-1)
        if len(self.cut_level):
            value = np.concatenate((value, np.sum(self.cut_B * y_B[m:], axis=-1) - self.cut_level))
        return value, linear, block

    def values(self, q_BN: Array) -> Array:
        """Return the slack of every constraint (..., count) at attitudes q_BN (..., 4); >= 0 inside."""
        y_B = np.einsum("...ij,mj->...mi", rotation_matrix(q_BN), self.right_N)
        m = self.cone_count
        gap = self.b_B - y_B[..., :m, :]
        cones = self.cone_versine - 0.5 * np.sum(gap * gap, axis=-1)
        if not len(self.cut_level):
            return np.asarray(cones)
        cuts = np.sum(self.cut_B * y_B[..., m:, :], axis=-1) - self.cut_level
        return np.concatenate((cones, cuts), axis=-1)

    def mismatch_rad(self) -> Array:
        """Return |angle(b_i, b_j) - angle(r_i, r_j)| (m, m) [rad], in the atan2 form."""
        return np.asarray(np.abs(separation(self.b_B) - separation(self.r_N)))

    def inconsistent_pairs(self, slack_rad: float = 1e-12) -> tuple[tuple[int, int], ...]:
        """Return the pairs (i, j), i < j, of cones whose mismatch exceeds eps_i + eps_j + slack.

        A proof that no attitude fits.
        """
        allowed = self.angle_bound_rad[:, None] + self.angle_bound_rad[None, :] + slack_rad
        i, j = np.nonzero(np.triu(self.mismatch_rad() > allowed, 1))
        return tuple(zip(i.tolist(), j.tolist(), strict=True))

    def without(self, cones: tuple[int, ...]) -> "AdmissibleSet":
        """Return the set without the named cones (their cuts, if any, must be left out by the caller)."""
        keep = np.setdiff1d(np.arange(self.cone_count), np.array(cones, dtype=int))
        return AdmissibleSet(
            self.b_B[keep], self.r_N[keep], self.angle_bound_rad[keep], self.cut_B, self.cut_N, self.cut_level
        )


def separation(unit: Array) -> Array:
    """Return the angles (m, m) [rad] between unit rows, accurate from 0 to pi."""
    total = np.linalg.norm(unit[:, None] + unit[None, :], axis=-1)
    difference = np.linalg.norm(unit[:, None] - unit[None, :], axis=-1)
    return np.asarray(2 * np.arctan2(difference, total))
