"""Interval-Wahba front: what a genetic algorithm is asked, and what it finds."""

import numpy as np
import pytest
from interval_draws import boxes, perturbed

import optsat
from optsat.attitude import quaternion
from optsat.errors import InputError, MissingExtraError, UnsupportedFormError
from optsat.forms import Point
from optsat.problems.interval_wahba_front import IntervalWahbaFront
from optsat.problems.wahba import Wahba
from optsat.solution import Proof, Termination
from optsat.solvers import nsga2
from optsat.solvers.nsga2 import Nsga2

needs_pymoo = pytest.mark.skipif(not nsga2.pymoo_is_installed(), reason="pymoo is not installed (extra `peers`)")


def problem(seed: int = 0, absolute: bool = True) -> IntervalWahbaFront:
    return IntervalWahbaFront(*boxes(*perturbed(np.random.default_rng(seed))), absolute=absolute)


def test_the_objectives_are_those_of_the_pairs() -> None:
    front = problem(absolute=False)
    rng = np.random.default_rng(1)
    form = front.lower()
    points = rng.uniform(form.lower, form.upper, (50, 16))
    objectives, outside = form.evaluate(points)
    pairs = front.pairs
    b, r = pairs.directions(*np.moveaxis(points[:, 4:].reshape(-1, 2, 2, 3), 1, 0))
    b, r = b / np.linalg.norm(b, axis=-1, keepdims=True), r / np.linalg.norm(r, axis=-1, keepdims=True)
    q = points[:, :4] / np.linalg.norm(points[:, :4], axis=1, keepdims=True)
    parts = pairs.losses(q, (b - pairs.b_mid) / pairs.b_radius, (r - pairs.r_mid) / pairs.r_radius)
    np.testing.assert_allclose(objectives, np.column_stack((parts.mid, parts.change)), atol=1e-14)
    inside = np.all(np.abs(b - pairs.b_mid) <= pairs.b_radius, axis=(1, 2))
    inside &= np.all(np.abs(r - pairs.r_mid) <= pairs.r_radius, axis=(1, 2))
    np.testing.assert_array_equal(np.all(outside <= 0, axis=1), inside)
    assert 0 < inside.sum() < 50


def test_absolute_changes_only_the_sign_of_the_second_objective() -> None:
    points = np.random.default_rng(2).uniform(problem().lower().lower, problem().lower().upper, (20, 16))
    np.testing.assert_array_equal(
        problem().lower().evaluate(points)[0], np.abs(problem(absolute=False).lower().evaluate(points)[0])
    )


def test_a_search_that_met_nothing_feasible_is_said_so() -> None:
    empty = problem().interpret(
        Point(np.full(16, np.nan), np.zeros(0), Termination.STALLED, 5, {"members": np.zeros((0, 16))}), "none"
    )
    assert empty.proof is Proof.NOTHING
    assert empty.answer.q_BN.shape == (0, 4)
    assert empty.answer.compromise == -1


@needs_pymoo
def test_the_front_of_absolute_objectives_closes_in_on_the_q_method() -> None:
    # the corollary: the whole front is one point, so a longer search only comes nearer to it
    front = problem(3)
    b, r = front.b_B.midpoint, front.r_N.midpoint
    best = optsat.wahba(b, r, norm_policy="silent").answer
    found = optsat.solve(front, Nsga2(population=40, generations=60))
    answer = found.require(Proof.FEASIBLE).answer
    assert found.residuals["violation"] <= 0
    assert np.all(answer.mid_loss >= best.loss - 1e-12)
    larger = np.maximum(answer.mid_loss, answer.loss_change)
    assert answer.compromise == int(np.argmin(larger))
    assert larger.min() >= best.loss - 1e-12
    assert quaternion.error_angle(answer.q_BN[answer.compromise], best.q_BN) < np.radians(20)


@needs_pymoo
def test_the_same_seed_gives_the_same_front() -> None:
    first, second = (optsat.solve(problem(4), Nsga2(20, 10, seed=7)).answer for _ in range(2))
    np.testing.assert_array_equal(first.q_BN, second.q_BN)


def test_without_pymoo_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nsga2, "pymoo_is_installed", lambda: False)
    with pytest.raises(MissingExtraError, match="optsat\\[peers\\]"):
        Nsga2().run(problem().lower())


def test_what_cannot_be_searched_is_refused() -> None:
    with pytest.raises(InputError, match="`population` must be a whole number >= 1, got 0"):
        Nsga2(population=0)
    with pytest.raises(InputError, match="`generations` must be a whole number >= 1, got 1"):
        Nsga2(generations=1.5)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`search_fraction` must be a number > 0"):
        IntervalWahbaFront(*boxes(*perturbed(np.random.default_rng(0))), search_fraction=0.0)
    with pytest.raises(UnsupportedFormError):
        Nsga2().run(Wahba(np.eye(3), np.eye(3)).lower())


def test_of_the_members_the_one_of_least_larger_objective_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    form = problem(5).lower()
    members = np.random.default_rng(5).uniform(form.lower, form.upper, (6, 16))
    monkeypatch.setattr(nsga2, "pymoo_is_installed", lambda: True)
    monkeypatch.setattr(Nsga2, "_minimise", lambda self, form: members)
    point = Nsga2(generations=3).run(form)
    larger = np.max(form.evaluate(members)[0], axis=1)
    np.testing.assert_array_equal(point.x, members[np.argmin(larger)])
    assert (point.termination, point.iterations) == (Termination.MAX_ITERATIONS, 3)
    monkeypatch.setattr(Nsga2, "_minimise", lambda self, form: None)
    empty = optsat.solve(problem(5), Nsga2())
    assert (empty.termination, empty.proof) == (Termination.STALLED, Proof.NOTHING)
