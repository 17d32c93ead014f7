"""Random min-max problems: convex ones whose optimum is known by construction, and nonconvex ones of two unknowns."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.problems.minimax import Minimax


@dataclass(frozen=True)
class Drawn:
    """A problem, its least factor where that is known (else NaN), and a point where it is reached."""

    problem: Minimax
    optimum: float
    x: Array


def _convex_term(rng: np.random.Generator, x: Any, centre: Array) -> Any:
    """Return a convex function of one of six kinds, smooth at the centre."""
    import casadi as ca

    n = len(centre)
    kind = rng.integers(6)
    a = rng.standard_normal(n)
    y = x - centre
    if kind == 0:
        R = rng.standard_normal((int(rng.integers(1, n + 1)), n))
        return ca.sumsqr(ca.mtimes(R, y))
    if kind == 1:
        return ca.exp(ca.dot(a, y))
    if kind == 2:
        return ca.sqrt(1 + ca.sumsqr(y))
    if kind == 3:
        return ca.dot(a, y) ** 4 + ca.dot(rng.standard_normal(n), y) ** 2
    if kind == 4:
        return ca.exp(ca.sumsqr(y) / 10)
    return ca.SX(0)


def convex_problem(rng: np.random.Generator) -> Drawn:
    """Return min max_i f_i with a chosen optimum: the gradients there balance under chosen multipliers.

    A linear row and a bound press in some draws; idle rows lie below the factor.
    """
    import casadi as ca

    n = int(rng.integers(1, 6))
    x = ca.SX.sym("x", n)
    at = rng.standard_normal(n) * 10 ** rng.uniform(-1, 1)
    factor = float(rng.standard_normal() * 10 ** rng.uniform(-2, 2)) if rng.random() < 0.8 else 0.0
    scale = 10 ** rng.uniform(-2, 2)
    pressing, idle = int(rng.integers(1, n + 2)), int(rng.integers(0, 4))
    multipliers = rng.uniform(0.1, 1, pressing)
    multipliers /= multipliers.sum()
    gradients = scale * rng.standard_normal((pressing, n))
    options: dict[str, Any] = {}
    pushed = np.zeros(n)
    if rng.random() < 0.4:
        row = rng.standard_normal(n)
        options |= {"A": row[None, :], "b": [row @ at]}
        pushed += scale * rng.uniform(0.1, 1) * row
    if rng.random() < 0.4:
        k = int(rng.integers(n))
        upper = np.full(n, np.inf)
        upper[k] = at[k]
        options["ub"] = upper
        pushed[k] += scale * rng.uniform(0.1, 1)
    gradients[-1] = -(multipliers[:-1] @ gradients[:-1] + pushed) / multipliers[-1]
    objectives = []
    for i in range(pressing + idle):
        term = scale * _convex_term(rng, x, at)
        value, slope = ca.Function("term", [x], [term, ca.jacobian(term, x)])(at)
        gradient = gradients[i] if i < pressing else scale * rng.standard_normal(n)
        level = factor if i < pressing else factor - scale * rng.uniform(0.1, 2)
        change = gradient - np.asarray(ca.DM(slope).full()).reshape(-1)
        objectives.append(term - float(value) + ca.dot(change, x - at) + level)
    start = at + rng.standard_normal(n)
    return Drawn(Minimax(x, ca.vertcat(*objectives), start=start, **options), factor, at)


def nonconvex_problem(rng: np.random.Generator) -> Drawn:
    """Return a min-max of waves, saddles and products of two unknowns within bounds."""
    import casadi as ca

    x = ca.SX.sym("x", 2)
    objectives = []
    for _ in range(int(rng.integers(1, 4))):
        a, c = rng.standard_normal(2), rng.standard_normal(2)
        kinds = (
            ca.sin(3 * ca.dot(a, x)) + ca.dot(c, x) / 3,
            a[0] * x[0] ** 2 + a[1] * x[1] ** 2 + c[0] * x[0] * x[1],
            ca.sumsqr(x - a) - c[0] * ca.sqrt(1 + ca.sumsqr(x)),
            x[0] * x[1] + ca.exp(ca.dot(a, x) / 3),
            (ca.sumsqr(x) - 1) ** 2 + ca.dot(a, x),
        )
        objectives.append(kinds[int(rng.integers(len(kinds)))])
    absolute = [0] if rng.random() < 0.3 else []
    return Drawn(
        Minimax(x, ca.vertcat(*objectives), absolute=absolute, lb=-2, ub=2, start=rng.uniform(-2, 2, 2)),
        float("nan"),
        np.full(2, np.nan),
    )
