"""Draws of the interval-Wahba tests: the paper's vectors (9) with componentwise errors, in boxes about unit middles."""

import numpy as np

from optsat.arrays import Array
from optsat.problems.component_box import ComponentBox

R_N = np.array([[-0.54, -0.326, 0.775], [-0.673, 0.000133, 0.74]])
B_B = np.array([[-0.776, -0.46, 0.43], [-0.927, 0.01, 0.374]])


def unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def perturbed(rng: np.random.Generator, fraction: float = 0.2) -> tuple[Array, Array]:
    """Return b_B and r_N with every component wrong by up to `fraction` of itself."""
    b = B_B * (1 + fraction * rng.uniform(-1, 1, B_B.shape))
    return b, R_N * (1 + fraction * rng.uniform(-1, 1, R_N.shape))


def boxes(b_B: Array, r_N: Array, fraction: float = 0.2) -> tuple[ComponentBox, ComponentBox]:
    """Return the boxes about the normalised vectors."""
    b, r = unit(b_B), unit(r_N)
    return (
        ComponentBox.from_half_width(b, fraction * np.abs(b)),
        ComponentBox.from_half_width(r, fraction * np.abs(r)),
    )


def general_pairs(rng: np.random.Generator, count: int) -> tuple[Array, Array]:
    """Return `count` unit pairs that disagree by about 0.1 rad."""
    r = unit(rng.standard_normal((count, 3)))
    A = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    A *= np.linalg.det(A)
    return unit(r @ A.T + 0.05 * rng.standard_normal((count, 3))), r
