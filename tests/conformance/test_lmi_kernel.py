"""Semidefinite programme of fixed size: against Clarabel and closed forms, bits of the twin, and what has no answer."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kernel_source_harness import Call, assert_twin_agrees, compiled

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.forms import ConicForm, symmetric_vector
from optsat.kernels.lmi import lmi
from optsat.kernels.status import Status
from optsat.solvers.clarabel import Clarabel

OPTIMAL, INFEASIBLE, UNBOUNDED, FEASIBLE, NOTHING = range(5)
Blocks = list[Array]


def upper(m: Array) -> Array:
    """The upper triangle by columns."""
    return np.array([m[row, column] for column in range(len(m)) for row in range(column + 1)])


def packed(cost: Any, F: list[Blocks]) -> Array:
    return np.concatenate([cost, *(upper(block) for row in F for block in row)]).astype(float)


def at(F: list[Blocks], x: Array) -> Blocks:
    """The blocks of the inequality at x."""
    return [sum((xi * Fi[b] for xi, Fi in zip(x, F[1:], strict=True)), F[0][b]) for b in range(len(F[0]))]


def clarabel(cost: Array, F: list[Blocks]) -> float:
    A = np.stack([-np.concatenate([symmetric_vector(block) for block in row]) for row in F[1:]], axis=1)
    b = np.concatenate([symmetric_vector(block) for block in F[0]])
    form = ConicForm(cost, A, b, tuple(("psd_triangle", len(block)) for block in F[0]))
    return float(cost @ Clarabel().run(form).x)


def symmetric(rng: np.random.Generator, n: int) -> Array:
    square = rng.normal(size=(n, n))
    return square + square.T


def drawn(rng: np.random.Generator, m: int, sides: tuple[int, ...]) -> tuple[Array, list[Blocks]]:
    """A programme that has strictly feasible points on both sides."""
    F = [[symmetric(rng, n) for n in sides] for _ in range(m)]
    x, slack, multiplier = rng.normal(size=m), [], []
    for n in sides:
        roots = rng.normal(size=(2, n, n + 1))
        slack.append(roots[0] @ roots[0].T)
        multiplier.append(roots[1] @ roots[1].T)
    constant = [
        S - sum((xi * Fi[b] for xi, Fi in zip(x, F, strict=True)), np.zeros_like(S)) for b, S in enumerate(slack)
    ]
    cost = np.array([sum(float(np.sum(Z * block)) for Z, block in zip(multiplier, row, strict=True)) for row in F])
    return cost, [constant, *F]


def lyapunov(rng: np.random.Generator, n: int) -> tuple[Array, list[Blocks]]:
    """Minimise t, A'P + PA + I <= 0, P >= I, tI >= P for a stable A."""
    A = rng.normal(size=(n, n))
    A -= (np.linalg.eigvals(A).real.max() + 0.5) * np.eye(n)
    zero, one = np.zeros((n, n)), np.eye(n)
    F: list[Blocks] = [[-one, -one, zero]]
    for column in range(n):
        for row in range(column + 1):
            E = np.zeros((n, n))
            E[row, column] = E[column, row] = 1.0
            F.append([-(A.T @ E + E @ A), E, -E])
    F.append([zero, zero, one])
    return np.eye(len(F) - 1)[-1], F


def assert_inside(F: list[Blocks], x: Array) -> None:
    for block in at(F, x):
        assert np.linalg.eigvalsh(block)[0] > 0.0


@pytest.mark.parametrize(("m", "sides"), [(1, (1,)), (2, (3,)), (5, (2, 4)), (11, (4, 1, 4)), (8, (7,)), (4, (12, 2))])
def test_random_programmes_as_clarabel_solves_them(m: int, sides: tuple[int, ...], tmp_path: Path) -> None:
    rng = np.random.default_rng(m)
    source = lmi(m, sides)
    call, single = compiled(source, tmp_path), compiled(source, tmp_path, "clang", "-O1", np.float32)
    solved = 0
    for _ in range(12):
        cost, F = drawn(rng, m, sides)
        status, y = call(packed(cost, F))
        assert (status, y[m + 2]) == (Status.OK, OPTIMAL)
        best = clarabel(cost, F)
        scale = 1 + abs(best)
        assert y[m] == pytest.approx(best, abs=1e-7 * scale)
        assert y[m] == pytest.approx(cost @ y[:m], abs=1e-12 * scale)
        assert y[m + 1] == pytest.approx(best, abs=1e-7 * scale)
        assert_inside(F, y[:m])
        status, y = single(packed(cost, F))
        solved += status == Status.OK
        assert (y[m + 2] == OPTIMAL) == (status == Status.OK)
        # single precision stops where rounding does; what it gives is inside all the same
        assert y[m + 2] in (OPTIMAL, FEASIBLE)
        rounded = [[block.astype(np.float32).astype(float) for block in row] for row in F]
        assert_inside(rounded, y[:m].astype(float))
        if status == Status.OK:
            assert y[m] == pytest.approx(best, abs=2e-3 * scale)
    assert solved >= 3


@pytest.mark.parametrize("n", [2, 4, 6])
def test_lyapunov_inequalities_as_clarabel_solves_them(n: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(10 + n)
    m = n * (n + 1) // 2 + 1
    call = compiled(lmi(m, (n, n, n)), tmp_path)
    for _ in range(10):
        cost, F = lyapunov(rng, n)
        status, y = call(packed(cost, F))
        assert (status, y[m + 2]) == (Status.OK, OPTIMAL)
        assert y[m] == pytest.approx(clarabel(cost, F), rel=1e-7)
        assert_inside(F, y[:m])


def test_largest_eigenvalue(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    call = compiled(lmi(1, (5,)), tmp_path)
    for scale in (1e-3, 1.0, 1e4):
        A = scale * symmetric(rng, 5)
        status, y = call(packed([1.0], [[-A], [np.eye(5)]]))
        assert status == Status.OK
        assert y[0] == pytest.approx(np.linalg.eigvalsh(A)[-1], abs=2e-8 * max(scale * 10, 1.0))
        assert y[0] >= np.linalg.eigvalsh(A)[-1]


@pytest.fixture(scope="module")
def scalar(tmp_path_factory: pytest.TempPathFactory) -> Call:
    """Two inequalities in two unknowns."""
    return compiled(lmi(2, (1, 1)), tmp_path_factory.mktemp("scalar"))


@pytest.mark.parametrize(
    ("cost", "F", "expected", "outcome"),
    [
        # x >= 1, y >= 2
        ([1.0, 1.0], [[-1, -2], [1, 0], [0, 1]], Status.OK, OPTIMAL),
        # x >= 1, x <= 0
        ([1.0, 0.0], [[-1, 0], [1, -1], [0, 0]], Status.RANGE, INFEASIBLE),
        # x >= 1, y >= 2, and x wanted large
        ([-1.0, 1.0], [[-1, -2], [1, 0], [0, 1]], Status.RANGE, UNBOUNDED),
        # x >= 1, x <= 1: it holds, but never strictly
        ([1.0, 0.0], [[-1, 1], [1, -1], [0, 0]], Status.NOT_CONVERGED, NOTHING),
    ],
)
def test_what_has_an_answer_and_what_has_none(
    scalar: Call, cost: list[float], F: list[list[float]], expected: Status, outcome: int
) -> None:
    status, y = scalar(np.concatenate([cost, np.ravel(F)]))
    assert (status, y[4]) == (expected, outcome)
    assert np.isfinite(y[:3]).all() == (outcome == OPTIMAL)
    if outcome == OPTIMAL:
        np.testing.assert_allclose(y[:2], [1.0, 2.0], atol=1e-7)
        assert np.all(y[:2] > [1.0, 2.0])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 1, 2, 7])
def test_numbers_that_are_none_are_refused(scalar: Call, place: int, value: float) -> None:
    x = np.array([1.0, 1.0, -1.0, -2.0, 1.0, 0.0, 0.0, 1.0])
    x[place] = value
    status, y = scalar(x)
    assert (status, y[4]) == (Status.NOT_FINITE, NOTHING)
    assert np.isnan(y[:4]).all()


@pytest.mark.parametrize("sides", [(3,), (2, 4), (1, 3, 2)])
def test_infeasible_and_unbounded_blocks(sides: tuple[int, ...], tmp_path: Path) -> None:
    rng = np.random.default_rng(sum(sides))
    m = 4
    call = compiled(lmi(m, sides), tmp_path)
    for _ in range(10):
        cost, F = drawn(rng, m, sides)
        # a multiplier orthogonal to every F_i that F_0 contradicts, and a direction along which all slacks grow
        Z = [block @ block.T + np.eye(len(block)) for block in F[0]]
        norm = sum(float(np.sum(block * block)) for block in Z)
        for row in F:
            share = sum(float(np.sum(a * b)) for a, b in zip(Z, row, strict=True)) / norm
            for b in range(len(sides)):
                row[b] = row[b] - share * Z[b]
        F[0] = [block - 0.1 * z for block, z in zip(F[0], Z, strict=True)]
        status, y = call(packed(cost, F))
        assert (status, y[m + 2]) == (Status.RANGE, INFEASIBLE)
        cost, F = drawn(rng, m, sides)
        F[1] = [block @ block.T + np.eye(len(block)) for block in F[1]]
        cost[0] = -abs(cost[0]) - 1.0
        status, y = call(packed(cost, F))
        assert (status, y[m + 2]) == (Status.RANGE, UNBOUNDED)
        assert np.isnan(y[: m + 2]).all()


@pytest.mark.parametrize(("m", "sides"), [(2, (3,)), (4, (3, 1, 2)), (11, (4, 4, 4))])
def test_twin_agrees_to_the_bit(m: int, sides: tuple[int, ...], tmp_path: Path) -> None:
    rng = np.random.default_rng(20 + m)
    samples = []
    for _ in range(3):
        samples.append(packed(*drawn(rng, m, sides)))
        spoilt = samples[-1].copy()
        spoilt[rng.integers(len(spoilt))] = rng.choice([np.nan, np.inf, 0.0, 1e308, 1e150, 5e-324, -50.0])
        samples.append(spoilt)
        samples.append(rng.normal(size=len(spoilt)))
    assert_twin_agrees(lmi(m, sides, iterations=20), np.array(samples), tmp_path)


def test_few_iterations_give_a_point_inside(tmp_path: Path) -> None:
    rng = np.random.default_rng(30)
    seen = set()
    for iterations in (1, 4, 6):
        call = compiled(lmi(3, (4, 2), iterations=iterations, name=f"lmi_{iterations}"), tmp_path)
        for _ in range(10):
            cost, F = drawn(rng, 3, (4, 2))
            status, y = call(packed(cost, F))
            seen.add(int(y[5]))
            assert (status == Status.OK) == (y[5] == OPTIMAL)
            assert y[5] in (OPTIMAL, FEASIBLE)
            assert_inside(F, y[:3])
            assert y[3] >= clarabel(cost, F) - 1e-6
    assert FEASIBLE in seen


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"variables": 0, "sides": (2,)}, "`variables` must be a whole number from 1 to 80"),
        ({"variables": 2, "sides": (2, 13)}, "`sides` must be a whole number from 1 to 12"),
        ({"variables": 2, "sides": ()}, "`sides` must name 1 to 8 blocks, got 0"),
        ({"variables": 2, "sides": (2,), "tolerance": 0.0}, "`tolerance` must be between 0 and 1"),
        ({"variables": 2, "sides": (2,), "iterations": 500}, "`iterations` must be a whole number from 1 to 200"),
    ],
)
def test_refuses_sizes_that_it_cannot_have(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        lmi(**arguments)
