"""The min-max kernel: published optima, other solvers, the twin to the bit, and no answer that is not stationary."""

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from kernel_source_harness import assert_same_bits, assert_twin_agrees, compiled
from minmax_family import NONE, TOLERANCE, Family, Found, arguments, found, residual_of

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.minmax import minmax
from optsat.kernels.status import Status
from optsat.port import Port
from optsat.problems.reference_fitting import FITTING
from optsat.problems.reference_minimax import MINIMAX
from optsat.problems.reference_problem import ReferenceProblem

# those of the specification; the larger ones take the compiler long, and show no more
NAMES = (
    *(
        "CB2",
        "CB3",
        "DEM",
        "QL",
        "LQ",
        "Mifflin 1",
        "Crescent",
        "Polak 1",
        "Madsen",
        "Rosen-Suzuki",
        "Wong 1",
        "Wong 2",
    ),
    *(
        "Davidon 2",
        "Bard",
        "Kowalik-Osborne",
        "doc minimax",
        "doc goal",
        "doc goal, linear constraint",
        "doc minimax, absolute",
    ),
)
REFERENCE = [each for each in (*MINIMAX, *FITTING) if each.name in NAMES]
IN_FLOAT = ("CB2", "Rosen-Suzuki", "Madsen", "doc goal, linear constraint")
# from the usual start, another stationary point
OTHER_POINT = {"Bard"}
FLOAT = np.float32

Solve = Callable[[dict[str, Array]], Found]


def solver(family: Family, folder: Path, name: str = "family", real: Any = float) -> Solve:
    call = compiled(family.kernel(name), folder, level="-O1", real=real)
    return lambda problem: found(family.unknowns, call(arguments(problem)))


@pytest.mark.parametrize("reference", REFERENCE, ids=lambda reference: reference.name)
def test_published_optimum(reference: ReferenceProblem, tmp_path: Path) -> None:
    n, options = len(reference.start), reference.options
    x = ca.SX.sym("x", n)
    F = ca.vertcat(*reference.objectives(x))
    m = F.numel()
    assert not set(options) - {"absolute", "A", "b", "goals", "weights"}
    linear = np.atleast_2d(options["A"]) @ x - np.atleast_1d(options["b"]) if "A" in options else None
    source = minmax("problem", x, F, linear, absolute=range(m) if options.get("absolute") else ())
    goals, weights = (np.broadcast_to(options.get(key, value), m) for key, value in (("goals", 0.0), ("weights", 1.0)))
    bounds = np.repeat([-NONE, NONE], n)
    x_of = np.concatenate([reference.start, goals, weights, bounds])
    answer = found(n, compiled(source, tmp_path, level="-O0")(x_of))
    assert answer.status == Status.OK
    least = reference.optimum - 1e-6 * abs(reference.optimum) - 1e-7
    assert answer.gamma >= least
    if reference.name not in OTHER_POINT:
        assert answer.gamma <= reference.optimum + (1e-6 * abs(reference.optimum) or 1e-7)
    widths = [*weights, *(weights if options.get("absolute") else [])]
    assert np.dot(widths, answer.multipliers[: len(widths)]) == pytest.approx(1.0, abs=1e-6)
    if reference.name in IN_FLOAT:
        single = found(n, compiled(source, tmp_path, "clang", "-O0", FLOAT)(x_of))
        assert single.status == Status.OK
        assert single.gamma == pytest.approx(reference.optimum, rel=1e-4)


def test_every_reference_was_found() -> None:
    assert {each.name for each in REFERENCE} == set(NAMES)


def samples(family: Family, count: int) -> Array:
    """Problems, and some with a value that is none, a fixed unknown or constraints that nothing satisfies."""
    rng = np.random.default_rng(family.unknowns)
    drawn = [arguments(family.draw(rng)) for _ in range(count)]
    for k, value in enumerate((np.nan, np.inf, 1e300, 1e-310)):
        bad = drawn[k % count].copy()
        bad[rng.integers(len(bad))] = value
        drawn.append(bad)
    impossible, fixed = family.draw(rng), family.draw(rng)
    if family.constraints:
        impossible["coefficients"][-1] = 0.0
        impossible["coefficients"][-1, -2] = 1.0
    fixed["upper"][-1] = fixed["lower"][-1]
    return np.array([*drawn, arguments(impossible), arguments(fixed)])


def test_bits_of_the_twin_in_every_form(tmp_path: Path) -> None:
    family = Family(3, 2, 2, (1,))
    assert_twin_agrees(family.kernel("family"), samples(family, 8), tmp_path)


@pytest.mark.parametrize("family", [Family(1, 1), Family(2, 3), Family(4, 1, 1), Family(9, 3)], ids=str)
def test_bits_of_the_twin(family: Family, tmp_path: Path) -> None:
    source = family.kernel("family")
    call = compiled(source, tmp_path)
    assert source.twin is not None
    for x in samples(family, 4):
        assert_same_bits(call(x), source.twin(x))


def test_never_called_optimal_without_being_stationary(tmp_path: Path) -> None:
    """A thousand problems of any curvature: every OK is confirmed from outside, and few are given up."""
    given_up = 0
    for family in (Family(4, 3, 2), Family(2, 4, 1, (0,))):
        solve, functions = solver(family, tmp_path, f"family_{family.unknowns}"), family.functions()
        rng = np.random.default_rng(7)
        for _ in range(500):
            problem = family.draw(rng)
            answer = solve(problem)
            assert answer.status in (Status.OK, Status.NOT_CONVERGED)
            assert np.isfinite([*answer.x, answer.gamma, *answer.multipliers, *answer.bound_multipliers]).all()
            if answer.status == Status.OK:
                assert answer.residual <= TOLERANCE
                assert residual_of(family, functions, problem, answer) <= 3.0 * TOLERANCE
            else:
                assert answer.residual > TOLERANCE
                given_up += 1
    assert given_up <= 40


def test_feasible_problems_are_all_solved(tmp_path: Path) -> None:
    """Constraints that a known point satisfies with room: nothing is given up, whatever the curvature."""
    family = Family(4, 3)
    solve, rng = solver(family, tmp_path), np.random.default_rng(11)
    for _ in range(500):
        problem = family.draw(rng)
        problem["weights"] = np.abs(problem["weights"]) + 0.1
        assert solve(problem).status == Status.OK


def test_linear_problems_as_linprog(tmp_path: Path) -> None:
    from scipy.optimize import linprog

    family = Family(5, 4, 3)
    solve, rng = solver(family, tmp_path), np.random.default_rng(3)
    solved = 0
    for _ in range(200):
        problem = family.draw(rng)
        problem["coefficients"][:, :25] = 0.0
        problem["coefficients"][:, -1] = 0.0
        problem["weights"] = np.abs(problem["weights"])
        weights = np.concatenate([problem["weights"], np.zeros(3)])
        offsets = problem["coefficients"][:, -2] - np.concatenate([problem["goals"], np.zeros(3)])
        bounds = [*zip(problem["lower"], problem["upper"], strict=True), (None, None)]
        table = np.column_stack([problem["coefficients"][:, 25:30], -weights])
        best = linprog([0] * 5 + [1], A_ub=table, b_ub=-offsets, bounds=bounds)
        answer = solve(problem)
        assert (answer.status == Status.OK) == (best.status == 0)
        if best.status == 0:
            solved += 1
            assert answer.gamma == pytest.approx(best.fun, rel=1e-8, abs=2e-8)
    assert solved > 100


def test_convex_problems_as_clarabel(tmp_path: Path) -> None:
    cp: Any = importlib.import_module("cvxpy")
    family = Family(4, 3, 1)
    solve, rng = solver(family, tmp_path), np.random.default_rng(5)
    for _ in range(20):
        problem = family.draw(rng, convexity=0.3)
        answer = solve(problem)
        x, gamma = cp.Variable(4), cp.Variable()
        rows = [
            cp.quad_form(x, cp.psd_wrap(row[:16].reshape(4, 4))) / 2 + row[16:20] @ x + row[-2]
            for row in problem["coefficients"]
        ]
        limits = [rows[i] - problem["goals"][i] <= problem["weights"][i] * gamma for i in range(3)]
        inside = [rows[3] <= 0, x >= problem["lower"], x <= problem["upper"]]
        programme = cp.Problem(cp.Minimize(gamma), [*limits, *inside])
        programme.solve(solver=cp.CLARABEL)
        assert (answer.status == Status.OK) == (programme.status == "optimal")
        if answer.status == Status.OK:
            assert answer.gamma == pytest.approx(programme.value, rel=1e-6, abs=1e-6)


def line(goal: float = 0.0, weight: float = 1.0, **changed: Any) -> dict[str, Array]:
    """One unknown and the objective x, in [-1, 1]."""
    problem: dict[str, Any] = {
        "x0": [0.3], "coefficients": [[0.0, 1.0, 0.0, 0.0, 0.0]], "goals": [goal], "weights": [weight],
        "lower": [-1.0], "upper": [1.0],
    }  # fmt: skip
    return {key: np.array(changed.get(key, value), float) for key, value in problem.items()}


def test_what_each_argument_means(tmp_path: Path) -> None:
    solve = solver(Family(1, 1), tmp_path)
    below = solve(line(goal=0.5))
    assert (below.status, below.x[0]) == (Status.OK, pytest.approx(-1.0, abs=1e-7))
    assert below.gamma == pytest.approx(-1.5, abs=1e-7)
    assert below.bound_multipliers[0] == pytest.approx(1.0, abs=1e-7)
    above = solve(line(goal=0.5, weight=-2.0))
    assert [above.x[0], above.gamma] == pytest.approx([1.0, -0.25], abs=1e-7)
    assert above.multipliers[0] == pytest.approx(0.5, abs=1e-7)
    held = solve(line(lower=[0.25], upper=[0.25]))
    assert (held.status, held.x[0], held.gamma) == (Status.OK, 0.25, 0.25)
    assert held.bound_multipliers[0] == pytest.approx(1.0)
    free = solve(line(lower=[-NONE], upper=[NONE], coefficients=[[2.0, -1.0, 0.0, 0.0, 0.0]]))
    assert (free.status, free.x[0]) == (Status.OK, pytest.approx(0.5, abs=1e-4))
    # the objective to be at least 3, in the row for at most, would fall without end
    capped = solve(line(goal=3.0, weight=-1.0, coefficients=[[-2.0, 2.0, 0.0, 3.0, 0.0]], lower=[-5.0], upper=[5.0]))
    assert capped.status == Status.OK
    assert capped.gamma == pytest.approx(-1.0, abs=1e-7)


def test_what_is_refused_at_run_time(tmp_path: Path) -> None:
    solve = solver(Family(1, 1), tmp_path)
    for problem, expected in (
        (line(lower=[1.0], upper=[-1.0]), Status.RANGE),
        (line(weight=0.0), Status.RANGE),
        (line(x0=[np.nan]), Status.NOT_FINITE),
        (line(upper=[np.inf]), Status.NOT_FINITE),
        (line(goal=np.nan), Status.NOT_FINITE),
        (line(coefficients=[[0.0, 1e308, 0.0, 1e308, 0.0]], x0=[1.0], upper=[3.0], lower=[0.9]), Status.NOT_FINITE),
    ):
        answer = solve(problem)
        assert answer.status == expected
        assert np.isnan([*answer.x, answer.gamma, answer.residual, *answer.multipliers]).all()
    endless = solve(line(lower=[-NONE], upper=[NONE]))
    assert endless.status == Status.NOT_CONVERGED
    assert np.isfinite([*endless.x, endless.gamma, endless.residual]).all()


def test_infeasible_constraints_give_the_least_violation(tmp_path: Path) -> None:
    family = Family(2, 1, 2)
    solve, rng = solver(family, tmp_path), np.random.default_rng(2)
    problem = family.draw(rng)
    problem["coefficients"][:] = 0.0
    problem["coefficients"][0, :4] = np.eye(2).ravel()
    problem["coefficients"][1, 4:6], problem["coefficients"][1, -2] = (1.0, 0.0), 0.6
    problem["coefficients"][2, 4:6], problem["coefficients"][2, -2] = (-1.0, 0.0), 0.4
    answer = solve(problem)
    # x1 <= -0.6 and x1 >= 0.4: the worse of the two is best at x1 = -0.1
    assert answer.status == Status.NOT_CONVERGED
    assert max(answer.x[0] + 0.6, 0.4 - answer.x[0]) == pytest.approx(0.5, abs=0.02)
    assert np.isfinite(answer.multipliers).all()


def test_ties_and_singular_jacobians(tmp_path: Path) -> None:
    family = Family(3, 4, 2)
    solve, functions, rng = solver(family, tmp_path), family.functions(), np.random.default_rng(4)
    for _ in range(50):
        problem = family.draw(rng)
        problem["weights"] = np.ones(4)
        problem["coefficients"][1] = problem["coefficients"][0]
        problem["goals"][1] = problem["goals"][0]
        problem["coefficients"][5] = problem["coefficients"][4]
        # one unknown that no row knows of
        for row in problem["coefficients"]:
            row[:9].reshape(3, 3)[2] = row[:9].reshape(3, 3)[:, 2] = row[11] = row[14] = 0.0
        # 0 satisfies the constraints
        problem["coefficients"][4:, -1] = 0.0
        problem["upper"] = np.maximum(problem["upper"], 0.5)
        answer = solve(problem)
        if answer.status == Status.OK:
            assert residual_of(family, functions, problem, answer) <= 3.0 * TOLERANCE
        assert answer.status == Status.OK


def test_gauss_newton_reaches_the_same_points(tmp_path: Path) -> None:
    x, data = ca.SX.sym("x", 3), ca.SX.sym("data", 4, 3)
    errors = [ca.vertcat(*(data[i, j] - x[j] - 0.1 * x[0] * x[j] for j in range(3))) for i in range(4)]
    losses = ca.vertcat(*(ca.dot(error, error) / 2 for error in errors))
    given = [(Port("data", (4, 3), "-"), data)]
    exact = compiled(minmax("exact", x, losses, None, given), tmp_path, level="-O1")
    approximate = compiled(minmax("approximate", x, losses, None, given, residuals=errors), tmp_path, level="-O1")
    rng = np.random.default_rng(6)
    for _ in range(50):
        rest = [rng.normal(size=12) * 0.3, np.zeros(4), np.ones(4), np.full(3, -2.0), np.full(3, 2.0)]
        sample = np.concatenate([np.zeros(3), *rest])
        a, b = found(3, exact(sample)), found(3, approximate(sample))
        assert a.status == b.status == Status.OK
        assert a.gamma == pytest.approx(b.gamma, abs=1e-7)


def test_what_the_maker_refuses() -> None:
    x, other = ca.SX.sym("x", 2), ca.SX.sym("other")
    with pytest.raises(InputError, match="problem: the rows use other, which is no argument"):
        minmax("problem", x, x[0] + other)
    with pytest.raises(InputError, match="`absolute index` must be a whole number from 0 to 1, got 2"):
        minmax("problem", x, x, absolute=[2])
    with pytest.raises(InputError, match="`number of unknowns` must be a whole number from 1 to 24, got 25"):
        minmax("problem", ca.SX.sym("x", 25), x[0])
    with pytest.raises(InputError, match="one vector for each of 2 objectives, got 1"):
        minmax("problem", x, x, residuals=[x])
