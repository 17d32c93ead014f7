"""Corners of component boxes, and Wahba's loss over them: where directions do the most harm to an attitude.

For one attitude the loss 1/2 |b - A r|^2 is convex in (b, r), so over boxes it is largest at a corner. Over all
attitudes each corner's loss is linear in A, because |A r| = |r|: the worst case is a maximum of linear functions.
"""

import itertools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.attitude.davenport import centred_blocks, rotation_matrix


@dataclass(frozen=True)
class BoxCorners:
    """Pairs b_i = b_mid + alpha * b_radius, r_i = r_mid + beta * r_radius at all alpha, beta in {-1, 1}^3.

    b_mid, b_radius, r_mid, r_radius (m, 3), radii >= 0; weights (m,) >= 0, sum 1
    b_B, r_N (S, 3) : the corners, 64 a pair, fewer where a radius is 0; pair (S,) : whose it is; first (m,) : of each
    """

    b_mid: Array
    b_radius: Array
    r_mid: Array
    r_radius: Array
    weights: Array
    b_B: Array = field(init=False, repr=False)
    r_N: Array = field(init=False, repr=False)
    pair: NDArray[np.intp] = field(init=False, repr=False)
    first: NDArray[np.intp] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        b, r, pair = [], [], []
        for i, radius in enumerate(np.hstack((self.b_radius, self.r_radius))):
            sides = [(1.0, -1.0) if half > 0 else (0.0,) for half in radius]
            signs = np.array(list(itertools.product(*sides)))
            b.append(self.b_mid[i] + signs[:, :3] * self.b_radius[i])
            r.append(self.r_mid[i] + signs[:, 3:] * self.r_radius[i])
            pair.append(np.full(len(signs), i))
        object.__setattr__(self, "b_B", np.concatenate(b))
        object.__setattr__(self, "r_N", np.concatenate(r))
        object.__setattr__(self, "pair", np.concatenate(pair))
        object.__setattr__(self, "first", np.searchsorted(self.pair, np.arange(len(self.b_mid))))

    def losses(self, q_BN: Array) -> Array:
        """Return 1/2 |b - A(q) r|^2 of every corner (S,)."""
        gap = self.b_B - self.r_N @ rotation_matrix(q_BN).T
        return np.asarray(0.5 * np.sum(gap * gap, axis=-1))

    def worst_case_loss(self, q_BN: Array) -> float:
        """Return sum_i a_i max 1/2 |b_i - A(q) r_i|^2, every direction at its worst in its box."""
        return float(self.weights @ np.maximum.reduceat(self.losses(q_BN), self.first))

    def quadratics(self, q_BN: Array) -> tuple[Array, Array, Array]:
        """Return a (S,), h (S, 3), C (S, 3, 3): loss (1 + |g|^2) = a + 2 h.g + g^T C g at [g; 1] (x) q."""
        y_B = self.r_N @ rotation_matrix(q_BN).T
        level = 0.5 * (np.sum(self.b_B**2, axis=-1) + np.sum(y_B**2, axis=-1))
        cross, block = centred_blocks(self.b_B, y_B, level)
        return self.losses(q_BN), -cross, -block

    def mixture(self, shares: Array, q_BN: Array) -> tuple[float, Array, Array]:
        """Return a, h (3,), C (3, 3) of the corners mixed with shares (S,), as in `quadratics`."""
        a, h, C = self.quadratics(q_BN)
        return float(shares @ a), shares @ h, np.tensordot(shares, C, 1)
