"""Scenario of the interval-Wahba paper's Table 1: its printed vectors, its error law, and the methods it compares.

Every method here takes measured data alone. What uses the true attitude stands in the leak audit and nowhere else.
"""

from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import canonical, davenport_matrix, dominant_quaternion, rotation_matrix
from optsat.errors import InfeasibleBoxError
from optsat.problems.component_box import ComponentBox
from optsat.problems.interval_wahba import IntervalWahba
from optsat.solution import Proof
from optsat.solve import Solver, solve
from optsat.solvers.ipopt import Ipopt
from optsat.solvers.sqp import Sqp

PRINTED_R_N = np.array([[-0.54, -0.326, 0.775], [-0.673, 0.000133, 0.74]])
PRINTED_B_B = np.array([[-0.776, -0.46, 0.43], [-0.927, 0.01, 0.374]])
PRINTED_Q = np.array([-0.9746, 0.0707, -0.2122, -0.0125])
"""The paper's exact quaternion: scalar first, and of the opposite sign."""

FRACTION = 0.2
"""Largest error of a component, as a share of it."""

RANGE = 0.1
"""Search range of the paper about a quaternion, as a share of each component."""

ENGINES: tuple[Solver, ...] = (Ipopt(), Ipopt(tolerance=1e-8), Sqp("daqp"), Sqp("ipqp"))
"""Tried in turn: IPOPT now and then stalls just short of its tolerance, and ends at a looser one."""

EQUAL = np.array([0.5, 0.5])


def unit(vectors: Array) -> Array:
    """Return the rows (..., 3) scaled to length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def q_method(b_B: Array, r_N: Array) -> Array:
    """Return Davenport's attitude (4,) of two directions, equal weights, lengths ignored."""
    return np.asarray(canonical(dominant_quaternion(davenport_matrix(unit(b_B), unit(r_N), EQUAL))))


def exact_attitude() -> Array:
    """Return the attitude that errors are counted from: the q-method's of the printed vectors."""
    return q_method(PRINTED_B_B, PRINTED_R_N)


def consistent_b_B() -> Array:
    """Return body directions that agree with the printed references at the exact attitude; the printed ones do not."""
    return np.asarray(unit(PRINTED_R_N) @ rotation_matrix(exact_attitude()).T)


def perturbed(rng: np.random.Generator, b_B: Array, r_N: Array) -> tuple[Array, Array]:
    """Return both with every component wrong by up to 20 % of itself, uniform and independent, lengths as they fall."""
    return (
        b_B * (1 + FRACTION * rng.uniform(-1, 1, b_B.shape)),
        r_N * (1 + FRACTION * rng.uniform(-1, 1, r_N.shape)),
    )


@dataclass(frozen=True)
class Boxes:
    """Component boxes of one draw, 20 % of each component wide to either side."""

    b_B: ComponentBox
    r_N: ComponentBox


def unit_boxes(b_B: Array, r_N: Array) -> Boxes:
    """Return the boxes about the measured directions scaled to length 1."""
    return Boxes(*(ComponentBox.from_relative(unit(v), FRACTION, "paper") for v in (b_B, r_N)))


def raw_boxes(b_B: Array, r_N: Array) -> Boxes | None:
    """Return the boxes about the measured vectors as they are, None where one of them misses the unit sphere."""
    try:
        return Boxes(*(ComponentBox.from_relative(v, FRACTION, "paper") for v in (b_B, r_N)))
    except InfeasibleBoxError:
        return None


def min_max(boxes: Boxes | None, *, absolute: bool = True, search_fraction: float | None = None) -> Array | None:
    """Return the attitude of the paper's min-max by the first engine that ends with a proof.

    None where there is no box, or no engine ends at a stationary point.
    """
    if boxes is None:
        return None
    problem = IntervalWahba(boxes.b_B, boxes.r_N, absolute=absolute, search_fraction=search_fraction)
    for engine in ENGINES:
        solution = solve(problem, engine)
        if solution.proof in (Proof.STATIONARY, Proof.GLOBAL):
            return solution.answer.q_BN
    return None
