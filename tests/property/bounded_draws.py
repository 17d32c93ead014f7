"""Poses with bounded direction errors, as hypothesis strategies: 1 to 8 directions, bounds of 1e-9 rad to 20 deg."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from optsat.arrays import Array
from optsat.attitude import dcm

# data are exact to one rounding only; the bound that is handed over allows for it
ROUNDING_RAD = 1e-15


@dataclass(frozen=True)
class Pose:
    """A true attitude and directions whose errors stay within their bounds.

    q_BN (4,); b_B, r_N (m, 3); angle_bound_rad (m,)
    """

    q_BN: Array
    b_B: Array
    r_N: Array
    angle_bound_rad: Array

    def __repr__(self) -> str:
        return f"Pose(m={len(self.b_B)}, angle_bound_rad={self.angle_bound_rad.tolist()})"


def directions(rng: np.random.Generator, *shape: int) -> Array:
    """Return uniform unit vectors (*shape, 3)."""
    v = rng.standard_normal((*shape, 3))
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def tilted(rng: np.random.Generator, y: Array, half_angle: Array, boundary: bool) -> Array:
    """Return unit vectors at most `half_angle` (...) from y (..., 3): on the rim of the cap, or uniform per area."""
    across = np.cross(y, directions(rng, *y.shape[:-1]))
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    share = np.ones(y.shape[:-1]) if boundary else rng.random(y.shape[:-1])
    # sin^2(a / 2) = u sin^2(eps / 2): uniform per area, without the cancellation of arccos(1 - ...)
    angle = 2 * np.arcsin(np.sqrt(share) * np.sin(half_angle / 2))
    return np.asarray(np.cos(angle)[..., None] * y + np.sin(angle)[..., None] * across)


def drawn_pose(seed: int, decades: tuple[float, ...], boundary: bool) -> Pose:
    """Return the pose of a seed, with one direction for each log10 of a bound."""
    rng = np.random.default_rng(seed)
    q_BN = rng.standard_normal(4)
    q_BN /= np.linalg.norm(q_BN)
    bound = 10.0 ** np.array(decades)
    r_N = directions(rng, len(bound))
    b_B = tilted(rng, r_N @ dcm.from_quaternion(q_BN).T, bound, boundary)
    return Pose(q_BN, b_B, r_N, bound + ROUNDING_RAD)


def poses(
    least: int = 1, most: int = 8, smallest: float = 1e-9, largest: float = np.deg2rad(20.0)
) -> st.SearchStrategy[Pose]:
    """Return a strategy of poses with `least` to `most` directions and bounds in [smallest, largest] rad."""
    decade = st.floats(np.log10(smallest), np.log10(largest))
    return st.builds(
        drawn_pose,
        st.integers(0, 2**32 - 1),
        st.lists(decade, min_size=least, max_size=most).map(tuple),
        st.booleans(),
    )
