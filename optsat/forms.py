"""Forms: the few standard shapes that problems lower themselves to and solvers accept."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.attitude.admissible_set import AdmissibleSet
from optsat.errors import UnsupportedFormError
from optsat.smooth_map import SmoothMap, SymbolicMap
from optsat.solution import Termination

F = TypeVar("F")


def required(form: object, kind: type[F], solver: str) -> F:
    """Return the form when it is of the kind that a solver takes.

    Raises
    ------
    UnsupportedFormError : it is another.
    """
    if not isinstance(form, kind):
        raise UnsupportedFormError(f"{solver} solves {kind.__name__}, got {type(form).__name__}. See optsat.solvers.")
    return form


@dataclass(frozen=True)
class Point:
    """What a solver returns: a primal point, multipliers, why it stopped.

    x : primal point in the form's own coordinates
    dual : multipliers in the form's own order, empty where the form has none
    """

    x: Array
    dual: Array
    termination: Termination
    iterations: int = 0
    stats: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class AlignmentForm:
    """Minimise 1/2 sum a_i |b_i - A r_i|^2 over rotations A; `x` is q_BN, scalar last.

    b_B, r_N : (m, 3) unit rows; weights : (m,) >= 0, sum 1
    """

    b_B: Array
    r_N: Array
    weights: Array


@dataclass(frozen=True)
class EnclosureForm:
    """Find the smallest ball of attitudes that holds an admissible set.

    `x` is the centre q_BN, `dual` the weights of the constraints that prove the ball (Theorem 1), scaled to sum 1.
    """

    admissible: AdmissibleSet


ConeKind = Literal["zero", "nonnegative", "second_order", "psd_triangle"]


@dataclass(frozen=True)
class ConicForm:
    """Minimise q.x subject to A x + s = b, s in a product of cones; `dual` are the multipliers of the rows.

    A : (rows, n) dense; b : (rows,); q : (n,)
    cones : (kind, size) in row order; for "psd_triangle" size is the matrix order k and the k (k + 1) / 2 rows hold the
    upper triangle by columns, off-diagonal entries scaled by sqrt 2
    """

    q: Array
    A: Array
    b: Array
    cones: tuple[tuple[ConeKind, int], ...]


def symmetric_vector(matrices: Array) -> Array:
    """Return the "psd_triangle" rows (..., k (k + 1) / 2) of symmetric matrices (..., k, k)."""
    k = matrices.shape[-1]
    rows, columns = zip(*((i, j) for j in range(k) for i in range(j + 1)), strict=True)
    factor = np.where(np.array(rows) == np.array(columns), 1.0, np.sqrt(2.0))
    return np.asarray(matrices[..., rows, columns] * factor)


@dataclass(frozen=True)
class CoverForm:
    """Tighten a proven ball of attitudes by covering it with cells.

    admissible : the set; q_BN, weights : centre and multipliers of the proven ball; scale : tan(theta / 2) of its
    radius, finite
    What the cells are is the solver's own matter and travels in the point's `stats`.
    """

    admissible: AdmissibleSet
    q_BN: Array
    weights: Array
    scale: float


@dataclass(frozen=True, eq=False)
class MinMaxForm:
    """Minimise t over x (n,) and t subject to

        sign_i F_{objective_i}(x) - level_i <= weight_i t        for the rows i = 1..m, weight_i >= 0, one of them > 0,
        constraint_lower <= g(x) <= constraint_upper,  linear_lower <= A x <= linear_upper,  lower <= x <= upper.

    A row of weight 0 is a constraint. `x` of a point is x alone; `dual` is empty where the solver knows no multipliers,
    else those of the rows (m,) >= 0, then of g, A x and x, positive where an upper bound presses, negative where a
    lower one does.
    """

    objectives: SmoothMap
    objective: NDArray[np.intp]
    sign: Array
    level: Array
    weight: Array
    constraints: SmoothMap
    constraint_lower: Array
    constraint_upper: Array
    A: Array
    linear_lower: Array
    linear_upper: Array
    lower: Array
    upper: Array
    start: Array

    @property
    def symbolic(self) -> bool:
        """Whether all functions are CasADi's, so that exact derivatives of every order exist."""
        return isinstance(self.objectives, SymbolicMap) and isinstance(self.constraints, SymbolicMap)

    def rows(self, objectives: Array) -> Array:
        """Return sign F - level (m,) of the values F (k,)."""
        return np.asarray(self.sign * objectives[self.objective] - self.level)

    def factor(self, objectives: Array) -> float:
        """Return the least t that the rows of positive weight allow, for the values F (k,)."""
        soft = self.weight > 0
        return float(np.max(self.rows(objectives)[soft] / self.weight[soft]))


@dataclass(frozen=True, eq=False)
class FrontForm:
    """Find the points of a box none of which is worse than another in every objective, by function values alone.

    lower, upper (n,) : the box; evaluate : points (k, n) -> objectives (k, objectives) and constraints (k, constraints)
    <= 0. `x` of a point is one member, `stats["members"]` (k, n) holds all of them, none where none was feasible.
    """

    lower: Array
    upper: Array
    objectives: int
    constraints: int
    evaluate: Callable[[Array], tuple[Array, Array]]
