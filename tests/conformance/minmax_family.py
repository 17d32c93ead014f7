"""Families of min-max problems as kernels with their coefficients as arguments, and what each answer must satisfy."""

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from optsat.arrays import Array
from optsat.kernels.minmax import minmax
from optsat.kernels.source import KernelSource
from optsat.port import Port

NONE = 1e20
TOLERANCE = 0.5 * np.sqrt(np.finfo(float).eps)


@dataclass(frozen=True)
class Family:
    """Rows x' A x / 2 + b . x + c + d / (1 + (e . x)^2): any curvature, and bits that no machine changes.

    unknowns, objectives, constraints : counts; absolute : objectives bounded on both sides
    """

    unknowns: int
    objectives: int
    constraints: int = 0
    absolute: tuple[int, ...] = ()

    @property
    def rows(self) -> int:
        return self.objectives + self.constraints

    @property
    def numbers(self) -> int:
        """Coefficients of one row."""
        return self.unknowns**2 + 2 * self.unknowns + 2

    def values(self, x: Any, coefficients: Any) -> Any:
        n = self.unknowns
        values = []
        for i in range(self.rows):
            row = coefficients[i, :].T
            A, b, e, c, d = ca.reshape(row[: n * n], n, n), row[n * n : -n - 2], row[-n - 2 : -2], row[-2], row[-1]
            values.append(ca.bilin(A, x, x) / 2 + ca.dot(b, x) + c + d / (1 + ca.dot(e, x) ** 2))
        return ca.vertcat(*values)

    def kernel(self, name: str) -> KernelSource:
        x, coefficients = ca.SX.sym("x", self.unknowns), ca.SX.sym("coefficients", self.rows, self.numbers)
        values = self.values(x, coefficients)
        return minmax(
            name,
            x,
            values[: self.objectives],
            values[self.objectives :] if self.constraints else None,
            [(Port("coefficients", (self.rows, self.numbers), "-"), coefficients)],
            self.absolute,
        )

    def draw(self, rng: np.random.Generator, convexity: float = 0.0) -> dict[str, Array]:
        """A problem by argument: curvature of either sign, plus `convexity` times the identity."""
        n = self.unknowns
        rows = []
        for i in range(self.rows):
            A = rng.normal(size=(n, n))
            A = (A + A.T) / 2 if convexity == 0 else A @ A.T * convexity
            d = rng.normal() if convexity == 0 else 0.0
            c = rng.normal() if i < self.objectives else -1.0 - rng.random()
            rows.append(np.concatenate([A.ravel(), rng.normal(size=2 * n), [c, d]]))
        weights = rng.choice([1.0, 0.5, 2.0, -1.0, 0.0], self.objectives, p=[0.5, 0.15, 0.15, 0.1, 0.1])
        weights[0] = 1.0
        lower, upper = -rng.uniform(0.5, 2.0, n), rng.uniform(0.5, 2.0, n)
        if convexity:
            weights = np.abs(weights)
        elif rng.random() < 0.1:
            upper[0] = lower[0]
        return {
            "x0": rng.uniform(-1.0, 1.0, n),
            "coefficients": np.array(rows),
            "goals": rng.normal(size=self.objectives),
            "weights": weights,
            "lower": lower,
            "upper": upper,
        }

    def functions(self) -> ca.Function:
        """Values and Jacobian by CasADi: (x, coefficients) -> (rows,), (rows, n)."""
        x, coefficients = ca.SX.sym("x", self.unknowns), ca.SX.sym("coefficients", self.rows, self.numbers)
        values = self.values(x, coefficients)
        return ca.Function("rows", [x, coefficients], [values, ca.densify(ca.jacobian(values, x))])


def arguments(problem: dict[str, Array]) -> Array:
    return np.concatenate([np.ravel(value) for value in problem.values()])


@dataclass(frozen=True)
class Found:
    """Results of a kernel by name."""

    status: int
    x: Array
    gamma: float
    multipliers: Array
    bound_multipliers: Array
    residual: float
    iterations: float


def found(n: int, called: tuple[int, Array]) -> Found:
    status, y = called
    rows = len(y) - 2 * n - 3
    x, gamma, multipliers, bounds, rest = np.split(y, [n, n + 1, n + 1 + rows, 2 * n + 1 + rows])
    return Found(status, x, float(gamma[0]), multipliers, bounds, float(rest[0]), float(rest[1]))


def residual_of(family: Family, functions: ca.Function, problem: dict[str, Array], answer: Found) -> float:
    """What is missed of the optimality conditions, from the answer and CasADi's derivatives alone."""
    m = family.objectives
    values, jacobian = (each.full() for each in functions(answer.x, problem["coefficients"]))
    weights = problem["weights"]
    sign = np.where(weights < 0, -1.0, 1.0)
    from_goal, slopes = sign * (values[:m, 0] - problem["goals"]), sign[:, None] * jacobian[:m]
    mirrored = list(family.absolute)
    rows = np.concatenate([from_goal, -from_goal[mirrored], values[m:, 0]])
    gradients = np.vstack([slopes, -slopes[mirrored], jacobian[m:]])
    widths = np.concatenate([np.abs(weights), np.abs(weights[mirrored]), np.zeros(family.constraints)])
    y, pull = answer.multipliers, answer.bound_multipliers
    soft = widths > 0
    gamma = np.max(rows[soft] / widths[soft])
    size = 1.0 + abs(gamma)
    room = np.where(pull > 0, answer.x - problem["lower"], problem["upper"] - answer.x)
    stationarity = (y @ gradients - pull) / (1.0 + np.abs(y) @ np.abs(gradients))
    parts = [
        abs(gamma - answer.gamma),
        np.max(np.abs(stationarity)),
        abs(widths @ y - 1.0),
        np.max(rows[~soft], initial=0.0),
        np.sum(np.abs(y * (widths * gamma - rows))) / size,
        np.sum(np.abs(pull * room)) / size,
        np.max(-y, initial=0.0),
        np.max(problem["lower"] - answer.x, initial=0.0),
        np.max(answer.x - problem["upper"], initial=0.0),
    ]
    return float(np.max(parts))
