"""Pareto sweep: fronts known in closed form, by every method, with what is proven of each point."""

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError, NotProvenError, UnknownOptionError
from optsat.pareto import pareto_sweep
from optsat.problems.pareto_front import ParetoFront, Verdict, judged
from optsat.solution import Proof, Termination

METHODS = ("weights", "epsilon_constraint", "normal_boundary")
X = ca.SX.sym("x", 2)
DISTANCES = [ca.sumsqr(X), ca.sumsqr(X - ca.DM([1, 1]))]


def zdt(shape: Callable[[Any], Any], count: int = 4) -> tuple[Any, list[Any], dict[str, Any]]:
    """The family of Zitzler, Deb & Thiele: front f2 = shape(f1), where all unknowns but the first are 0."""
    x = ca.SX.sym("x", count)
    g = 1 + 9 * ca.sum1(x[1:]) / (count - 1)
    return x, [x[0], g * shape(x[0] / g)], {"lb": [0.01, *[0] * (count - 1)], "ub": 1, "start": [0.5] * count}


def dtlz2() -> tuple[Any, list[Any], dict[str, Any]]:
    """The front is the part of the unit sphere in the positive octant; no weighted sum reaches its inside."""
    x = ca.SX.sym("x", 4)
    a, b, g = x[0] * ca.pi / 2, x[1] * ca.pi / 2, 1 + ca.sumsqr(x[2:] - 0.5)
    F = [g * ca.cos(a) * ca.cos(b), g * ca.cos(a) * ca.sin(b), g * ca.sin(a)]
    return x, F, {"lb": 0, "ub": 1, "start": [0.4, 0.4, 0.4, 0.4]}


def all_kept_are_non_dominated(front: ParetoFront) -> bool:
    F = front.objectives
    better = np.all(F[:, None] <= F[None], axis=-1) & np.any(F[:, None] < F[None] - 1e-6, axis=-1)
    return not better.any()


@pytest.mark.parametrize("method", METHODS)
def test_two_distances_have_the_segment_between_their_centres(method: Any) -> None:
    front = pareto_sweep(X, DISTANCES, method=method, points=11, start=[3, -1])
    roots = np.sqrt(front.objectives)
    np.testing.assert_allclose(roots.sum(axis=1), np.sqrt(2), atol=1e-6)
    np.testing.assert_allclose(front.x[:, 0], front.x[:, 1], atol=1e-6)
    assert len(front.points) == 11
    assert all(point.proof is Proof.GLOBAL for point in front.points)
    assert {point.termination for point in front.points} <= {Termination.CONVERGED, Termination.STALLED}
    assert np.all(np.diff(front.objectives[:, 0]) > 0)
    np.testing.assert_allclose(front.ideal, 0, atol=1e-7)
    np.testing.assert_allclose(front.nadir, 2, rtol=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_the_convex_front_of_zdt1(method: Any) -> None:
    x, F, options = zdt(lambda r: 1 - ca.sqrt(r))
    front = pareto_sweep(x, F, method=method, points=9, **options)
    np.testing.assert_allclose(front.objectives[:, 1], 1 - np.sqrt(front.objectives[:, 0]), atol=1e-5)
    # sums of weights that differ little from those of an anchor end there too
    assert len(front.points) >= (9 if method != "weights" else 6)
    assert all_kept_are_non_dominated(front)


@pytest.mark.parametrize("method", METHODS)
def test_the_front_of_zdt2_is_not_convex(method: Any) -> None:
    """No weighted sum is least between the ends; the other methods go along the whole front."""
    x, F, options = zdt(lambda r: 1 - r**2)
    front = pareto_sweep(x, F, method=method, points=9, starts=4, **options)
    np.testing.assert_allclose(front.objectives[:, 1], 1 - front.objectives[:, 0] ** 2, atol=1e-6)
    inside = (front.objectives[:, 0] > 0.05) & (front.objectives[:, 0] < 0.95)
    assert inside.sum() >= 6 if method != "weights" else not inside.any()
    assert all(point.proof in (Proof.STATIONARY, Proof.GLOBAL) for point in front.points)


@pytest.mark.parametrize("method", ["epsilon_constraint", "normal_boundary"])
def test_three_objectives_on_a_sphere(method: Any) -> None:
    x, F, options = dtlz2()
    front = pareto_sweep(x, F, method=method, points=5, starts=2, **options)
    np.testing.assert_allclose(np.linalg.norm(front.objectives, axis=1), 1, atol=1e-6)
    assert all_kept_are_non_dominated(front)
    inside = np.all(front.objectives > 0.1, axis=1)
    assert inside.sum() >= 3


def test_normal_boundary_points_lie_on_their_normals() -> None:
    """The front of three coordinates within a ball is a part of the sphere; places are spread evenly on the plane."""
    x = ca.SX.sym("x", 3)
    front = pareto_sweep(x, x, points=6, constraints=ca.sumsqr(x - 1), constraints_ub=1, start=[0.5, 0.6, 0.7])
    assert len(front.points) == 21
    assert not front.left_out
    direction = np.mean(np.array([each.objectives for each in front.anchors]) - front.ideal, axis=0)
    for point in front.points:
        assert point.proof is Proof.GLOBAL
        assert np.sum((point.objectives - 1) ** 2) == pytest.approx(1, abs=1e-6)
        if point.anchor is None:
            along = (point.objectives - point.setting) / direction
            np.testing.assert_allclose(along, along[0], atol=1e-6)
            assert point.solution.answer.factor == pytest.approx(along[0], abs=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_every_way_to_write_the_objectives_gives_one_front(method: Any) -> None:
    by_symbols = pareto_sweep(X, DISTANCES, method=method, points=5)
    by_calls = pareto_sweep([0.5, 0.5], lambda x: [x @ x, (x - 1) @ (x - 1)], method=method, points=5, engine="slsqp")
    np.testing.assert_allclose(by_calls.objectives, by_symbols.objectives, atol=2e-4)


def test_an_anchor_is_not_merely_weakly_optimal() -> None:
    """Where the first objective is least the second unknown is free: the other objective decides."""
    front = pareto_sweep(X, [X[0], X[1] ** 2 + (X[0] - 1) ** 2], lb=[0, -3], ub=3, start=[2, 2], points=3)
    np.testing.assert_allclose(front.anchors[0].x, (0, 0), atol=1e-4)
    assert front.anchors[0].anchor == 0
    np.testing.assert_allclose(front.nadir[1], 1, atol=1e-4)


def test_objectives_that_do_not_conflict_have_a_front_of_one_point() -> None:
    front = pareto_sweep(X, [ca.sumsqr(X), 3 * ca.sumsqr(X) + 1], points=4, start=[1, 1])
    assert len(front.points) == 1
    np.testing.assert_allclose(front.x, 0, atol=1e-4)
    assert {point.verdict for point in front.left_out} == {Verdict.REPEATED}


def test_bounds_out_of_reach_are_told() -> None:
    """A ball lies in the box of the anchors: its far corners hold no point."""
    x = ca.SX.sym("x", 3)
    front = pareto_sweep(
        x, x, method="epsilon_constraint", points=4, constraints=ca.sumsqr(x - 1), constraints_ub=1,
        start=[0.5, 0.6, 0.7],
    )  # fmt: skip
    verdicts = [point.verdict for point in front.left_out]
    assert Verdict.INFEASIBLE in verdicts
    assert all(p.proof is Proof.INFEASIBLE for p in front.left_out if p.verdict is Verdict.INFEASIBLE)


def test_a_warm_start_saves_iterations() -> None:
    x, F, options = zdt(lambda r: 1 - r**2)
    front = pareto_sweep(x, F, points=12, engine="ipopt", **options)
    steps = [point.solution.stats["iterations"] for point in front.points if point.anchor is None]
    cold = [pareto_sweep(x, F, points=3, engine="ipopt", **options).points[1].solution.stats["iterations"]]
    assert np.mean(steps) < cold[0]


def test_the_same_seed_gives_the_same_front() -> None:
    x, F, options = zdt(lambda r: 1 - r**2 + 0.1 * ca.sin(9 * r))
    first, again = (pareto_sweep(x, F, points=4, starts=4, seed=3, **options) for _ in range(2))
    np.testing.assert_array_equal(first.x, again.x)


def test_dominated_and_repeated_points_are_found() -> None:
    F = np.array([[0, 1], [1, 0], [0.5, 0.5], [0.6, 0.6], [0.5, 0.5 + 1e-8], [9, 9]], dtype=np.float64)
    feasible = np.array([True, True, True, True, True, False])
    kept, dominated, repeated = Verdict.KEPT, Verdict.DOMINATED, Verdict.REPEATED
    assert judged(F, feasible, np.ones(2)) == [kept, kept, kept, dominated, repeated, Verdict.INFEASIBLE]


REFUSED: dict[str, tuple[Callable[[], Any], str]] = {
    "method": (lambda: pareto_sweep(X, DISTANCES, method="weight"), "Did you mean `weights`?"),  # type: ignore[arg-type]
    "one point": (lambda: pareto_sweep(X, DISTANCES, points=1), "`points` must be a whole number >= 2"),
    "half a point": (lambda: pareto_sweep(X, DISTANCES, points=2.5), "`points` must be"),  # type: ignore[arg-type]
    "one objective": (lambda: pareto_sweep(X, X[0]), "`objectives` must be two or three for a sweep, got 1"),
    "four objectives": (lambda: pareto_sweep(X, [X[0]] * 4), "`objectives` must be two or three for a sweep, got 4"),
    "bounds": (lambda: pareto_sweep(X, DISTANCES, lb=2, ub=1), "`lb` must not exceed `ub`"),
    "starts": (lambda: pareto_sweep(X, DISTANCES, starts=0), "`starts` must be a whole number >= 1"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_a_sweep_refuses_by_name(name: str) -> None:
    call, message = REFUSED[name]
    with pytest.raises(InputError) as refused:
        call()
    assert message in str(refused.value)


def test_a_misspelt_option_of_the_sweep() -> None:
    with pytest.raises(UnknownOptionError, match="Did you mean `points`"):
        pareto_sweep(X, DISTANCES, point=3)  # type: ignore[call-arg]


def test_no_feasible_point_is_an_error_that_keeps_what_was_found() -> None:
    with pytest.raises(NotProvenError, match="Objective 0 has no anchor") as refused:
        pareto_sweep(X, DISTANCES, A=[[1, 0], [-1, 0]], b=[0, -1])
    assert refused.value.solution.proof is Proof.INFEASIBLE  # type: ignore[attr-defined]


def test_an_objective_without_a_least_value_is_told() -> None:
    with pytest.warns(UserWarning, match="Is the objective bounded below"):
        pareto_sweep(X, [X[0], X[1] ** 2], points=2)


def test_the_front_is_drawn() -> None:
    front = pareto_sweep(X, DISTANCES, points=5)
    axes = front.plot(names=["first [m]", "second [m]"])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("first [m]", "second [m]")
    drawn = {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.get_lines()}
    np.testing.assert_allclose(drawn["front"], front.objectives)
    assert len(drawn["anchor"]) == 2
    assert front.plot(axes) is axes
    with pytest.raises(InputError, match="`names` must hold 2 names"):
        front.plot(names=["one"])


def test_three_objectives_are_drawn_in_space() -> None:
    x = ca.SX.sym("x", 3)
    front = pareto_sweep(x, x, points=3, constraints=ca.sumsqr(x - 1), constraints_ub=1, start=[0.5, 0.6, 0.7])
    axes: Any = front.plot()
    assert axes.get_zlabel() == "objective 2"
    flat = pareto_sweep(X, DISTANCES, points=2).plot()
    with pytest.raises(InputError, match="three-dimensional"):
        front.plot(flat)


def test_parameters_of_the_objectives() -> None:
    a: Any = ca.SX.sym("a")
    found: list[Array] = []
    for value in (1.0, 2.0):
        front = pareto_sweep(X, [ca.sumsqr(X), ca.sumsqr(X - a)], points=3, parameters=a, parameter_values=value)
        found.append(front.nadir)
    np.testing.assert_allclose(found[1], 4 * found[0], rtol=1e-4)
