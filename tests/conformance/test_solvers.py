"""One suite for every solver of the table: it refuses what it cannot solve, and is right about the rest."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pytest
from conic_problems import INFEASIBLE, SOLVABLE, UNBOUNDED, ConicProblem, outside

import optsat
from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.alignment import curvature
from optsat.attitude.davenport import rotation_matrix
from optsat.attitude.status import AttitudeStatus
from optsat.errors import InputError, UnsupportedFormError
from optsat.forms import Point
from optsat.problems.attainment import Attainment
from optsat.problems.certified_attitude import CertifiedAttitude, CertifiedAttitudeProblem
from optsat.problems.goal_attainment import GoalAttainment
from optsat.problems.refined_enclosure import RefinedEnclosure
from optsat.problems.wahba import Wahba, WahbaAttitude
from optsat.solution import Proof, Solution, Termination
from optsat.solve import Problem, Solver
from optsat.solvers import SOLVERS
from optsat.solvers.alignment_point import alignment_point
from optsat.solvers.cell_cover import CellCoverSolver
from optsat.solvers.clarabel import Clarabel
from optsat.solvers.scaled_semidefinite import ScaledSemidefinite
from optsat.solvers.two_vector import Triad

Q = np.array([0.5, -0.5, 0.1, np.sqrt(0.49)])
HALF_TURN = np.array([0.6, 0.8, 0.0, 0.0])
AXES = np.eye(3)
PAIR = np.array([(1.0, 0.0, 0.0), (0.6, 0.8, 0.0)])


@dataclass(frozen=True)
class Case:
    """A problem with a known optimum, and the check of a solution that any solver gave."""

    name: str
    problem: Problem[Any]
    judge: Callable[[Solution[Any]], None]


def body(r_N: Array, q_BN: Array = Q) -> Array:
    return np.asarray(r_N @ rotation_matrix(q_BN).T)


def wahba_case(name: str, problem: Wahba, q_BN: Array, tolerance: float, least_loss: float = 0.0) -> Case:
    def judge(solution: Solution[WahbaAttitude]) -> None:
        answer = solution.answer
        assert solution.termination is Termination.CONVERGED
        np.testing.assert_allclose(rotation_matrix(answer.q_BN), answer.dcm_BN, atol=0)
        if solution.proof is Proof.GLOBAL:
            assert answer.status is AttitudeStatus.OK
            assert quaternion.error_angle(answer.q_BN, q_BN) <= tolerance
            assert answer.loss == pytest.approx(least_loss, rel=1e-9, abs=1e-28)
            assert solution.residuals["distance_to_optimum_rad"] <= tolerance
        else:
            # a closed form that is not the optimum must say so itself, and cannot be better
            assert solution.proof is Proof.FEASIBLE
            assert solution.stats["solver"] == "triad"
            assert answer.loss > least_loss
            assert solution.residuals["distance_to_optimum_rad"] > tolerance

    return Case(f"wahba: {name}", problem, judge)


def free_rotation_case(name: str, problem: Wahba, free: int) -> Case:
    def judge(solution: Solution[WahbaAttitude]) -> None:
        answer, form = solution.answer, problem.lower()
        assert answer.status is AttitudeStatus.UNBOUNDED
        assert solution.proof is Proof.GLOBAL
        assert len(answer.free_axes_B) == free
        loss = 0.5 * form.weights @ np.sum((form.b_B - form.r_N @ answer.dcm_BN.T) ** 2, axis=1)
        assert answer.loss == pytest.approx(loss, abs=1e-30)

    return Case(f"wahba: {name}", problem, judge)


def enclosure_case(name: str, problem: CertifiedAttitudeProblem, bound_rad: float, q_BN: Array, rel: float) -> Case:
    def judge(solution: Solution[CertifiedAttitude]) -> None:
        answer = solution.answer
        assert (answer.status, solution.proof) == (AttitudeStatus.OK, Proof.GLOBAL)
        assert bound_rad * (1 - 1e-10) <= answer.bound_rad <= bound_rad * (1 + rel)
        assert quaternion.error_angle(answer.q_BN, q_BN) <= answer.bound_rad
        assert solution.residuals["s1"] >= 0 > solution.residuals["s2"]
        assert answer.certificate.verify()

    return Case(f"enclosure: {name}", problem, judge)


def verdict_case(name: str, problem: CertifiedAttitudeProblem, status: AttitudeStatus, proof: Proof) -> Case:
    def judge(solution: Solution[CertifiedAttitude]) -> None:
        assert (solution.answer.status, solution.proof) == (status, proof)
        assert solution.answer.certificate.verify()
        assert np.all(np.isfinite(solution.answer.q_BN))

    return Case(f"enclosure: {name}", problem, judge)


def cover_case(name: str, b_B: Array, r_N: Array, bound: Array, least_rad: float) -> Case:
    first = optsat.certify_attitude(b_B, r_N, bound)

    def judge(solution: Solution[CertifiedAttitude]) -> None:
        answer = solution.answer
        assert solution.proof is Proof.GLOBAL
        assert least_rad * (1 - 1e-9) <= answer.bound_rad <= first.bound_rad
        assert solution.residuals["certificate_margin"] >= -1e-10 * answer.bound_rad
        assert answer.certificate.verify()
        assert answer.stats["order_1_bound_rad"] == first.bound_rad

    return Case(f"cover: {name}", RefinedEnclosure(first), judge)


def conic_case(name: str, problem: ConicProblem, least: float) -> Case:
    def judge(solution: Solution[Point]) -> None:
        assert solution.termination is Termination.CONVERGED
        assert problem.form.q @ solution.answer.x == pytest.approx(least, rel=1e-6)
        assert max(solution.residuals.values()) <= 1e-6

    return Case(f"conic: {name}", problem, judge)


def min_max_case(name: str, problem: GoalAttainment, factor: float, x: tuple[float, ...]) -> Case:
    def judge(solution: Solution[Attainment]) -> None:
        assert solution.proof in (Proof.STATIONARY, Proof.GLOBAL)
        assert solution.answer.factor == pytest.approx(factor, rel=1e-6, abs=1e-7)
        np.testing.assert_allclose(solution.answer.x, x, atol=1e-6)
        assert solution.residuals["kkt"] <= 1e-6

    return Case(f"min-max: {name}", problem, judge)


def infeasible(solution: Solution[Point]) -> None:
    form, ray = INFEASIBLE.form, solution.answer.dual
    assert form.b @ ray < 0
    np.testing.assert_allclose(form.A.T @ ray, 0, atol=1e-7 * np.abs(ray).max())
    assert outside(form, ray, dual=True) <= 1e-7 * np.abs(ray).max()


def unbounded(solution: Solution[Point]) -> None:
    form, ray = UNBOUNDED.form, solution.answer.x
    assert form.q @ ray < 0
    assert outside(form, -form.A @ ray) <= 1e-7 * np.abs(ray).max()


def two_errors() -> Wahba:
    """Return a pair whose mutual angle is off by 0.02: with weights 3 : 1 the optimum shares it 1 : 3."""
    turned = np.array([(1.0, 0.0, 0.0), (np.cos(np.arctan2(0.8, 0.6) + 0.02), np.sin(np.arctan2(0.8, 0.6) + 0.02), 0)])
    return Wahba(body(turned), PAIR, (3.0, 1.0))


def shared_error() -> tuple[Array, float]:
    """Return attitude and loss of `two_errors`: a turn t about z that minimises 3 (1 - cos t) + 1 - cos(0.02 - t)."""
    t = np.arctan2(np.sin(0.02), 3 + np.cos(0.02))
    loss = (3 * 2 * np.sin(t / 2) ** 2 + 2 * np.sin((0.02 - t) / 2) ** 2) / 4
    return quaternion.compose(Q, (0, 0, -np.sin(t / 2), np.cos(t / 2))), float(loss)


LINE = ca.SX.sym("x")
EXACT_PAIR_EPS = np.array([5e-6, 0.05])
THREE_EPS = np.full(3, 0.1)
EQUAL_AXES_BOUND = float(2 * np.arcsin(np.sqrt(0.75 * 2 * np.sin(0.05) ** 2)))

CASES = [
    wahba_case("two vectors", Wahba(body(PAIR), PAIR), Q, 1e-14),
    wahba_case("three axes", Wahba(body(AXES), AXES), Q, 1e-14),
    wahba_case("half-turn", Wahba(body(PAIR, HALF_TURN), PAIR), HALF_TURN, 1e-14),
    wahba_case("weights 1e14 : 1", Wahba(body(PAIR), PAIR, (1e14, 1.0)), Q, 1e-13),
    wahba_case("lengths 1e-150 and 1e150", Wahba(body(PAIR) * [[1e-150], [1e150]], PAIR, None, "silent"), Q, 1e-14),
    wahba_case("pair that disagrees", two_errors(), shared_error()[0], 1e-13, shared_error()[1]),
    free_rotation_case("one vector", Wahba(body(AXES[:1]), AXES[:1]), 1),
    free_rotation_case("opposite vectors", Wahba(body(AXES[[0, 0]]) * [[1], [-1]], AXES[[0, 0]] * [[1], [-1]]), 1),
    free_rotation_case("all axes reversed", Wahba(-body(AXES), AXES), 2),
    enclosure_case(
        "three axes of one bound", CertifiedAttitudeProblem(body(AXES), AXES, 0.1), EQUAL_AXES_BOUND, Q, 1e-6
    ),
    enclosure_case(
        "three axes at 1e-8 rad", CertifiedAttitudeProblem(body(AXES), AXES, 1e-8), np.sqrt(1.5) * 1e-8, Q, 1e-5
    ),
    enclosure_case(
        "two vectors four decades apart",
        CertifiedAttitudeProblem(body(AXES[:2]), AXES[:2], EXACT_PAIR_EPS),
        0.05000000025,
        Q,
        1e-6,
    ),
    enclosure_case(
        "cuts that say nothing",
        CertifiedAttitudeProblem(body(AXES), AXES, 0.1, (AXES[:1], AXES[:1], (-2.0,))),
        EQUAL_AXES_BOUND,
        Q,
        1e-6,
    ),
    verdict_case(
        "one cone", CertifiedAttitudeProblem(body(AXES[:1]), AXES[:1], 0.1), AttitudeStatus.UNBOUNDED, Proof.UNDECIDED
    ),
    verdict_case(
        "cones of 2 rad", CertifiedAttitudeProblem(AXES, AXES, 2.0), AttitudeStatus.UNBOUNDED, Proof.UNDECIDED
    ),
    verdict_case(
        "two that contradict",
        CertifiedAttitudeProblem(PAIR, AXES[:2], 0.1),
        AttitudeStatus.INCONSISTENT,
        Proof.INFEASIBLE,
    ),
    verdict_case(
        "reflected axes",
        CertifiedAttitudeProblem(-body(AXES), AXES, 0.1),
        AttitudeStatus.INCONSISTENT,
        Proof.INFEASIBLE,
    ),
    cover_case("three axes", body(AXES), AXES, THREE_EPS, EQUAL_AXES_BOUND * (1 - 1e-3)),
    cover_case(
        "accurate pair and a coarse vector", body(AXES), AXES, np.array([0.01, 0.01, 0.3]), 0.01 * np.sqrt(2) * 0.999
    ),
    min_max_case("parabola and line, x <= 1", GoalAttainment(LINE, [LINE**2, 2 - LINE], 0.0, ub=1.0), 1.0, (1.0,)),
    *(conic_case(name, problem, least) for name, (problem, least) in SOLVABLE.items()),
    Case("conic: infeasible", INFEASIBLE, infeasible),
    Case("conic: unbounded", UNBOUNDED, unbounded),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_solver_is_right_or_refuses(solver: Solver, case: Case) -> None:
    form = case.problem.lower()
    if solver.accepts(form):
        case.judge(optsat.solve(case.problem, solver))
    else:
        with pytest.raises(UnsupportedFormError, match=f"{solver.name} cannot solve this {type(form).__name__}"):
            optsat.solve(case.problem, solver)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_table_chooses_a_solver_for_every_problem(case: Case) -> None:
    case.judge(optsat.solve(case.problem))


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_every_solver_meets_a_problem_and_a_stranger(solver: Solver) -> None:
    assert any(solver.accepts(case.problem.lower()) for case in CASES)
    assert not solver.accepts(object())


def test_names_are_unique() -> None:
    assert len({solver.name for solver in SOLVERS}) == len(SOLVERS)


@pytest.mark.parametrize("solver", SOLVERS, ids=lambda solver: solver.name)
def test_solvers_keep_no_state(solver: Solver) -> None:
    case = next(case for case in CASES if solver.accepts(case.problem.lower()))
    first, second = (solver.run(case.problem.lower()) for _ in range(2))
    np.testing.assert_array_equal(first.x, second.x)
    np.testing.assert_array_equal(first.dual, second.dual)
    assert first.termination is second.termination


def test_clarabel_says_why_it_stopped() -> None:
    assert Clarabel().run(INFEASIBLE.form).stats["status"] == "PrimalInfeasible"
    assert Clarabel().run(UNBOUNDED.form).stats["status"] == "DualInfeasible"
    hurried = Clarabel(max_iterations=1).run(SOLVABLE["semidefinite"][0].form)
    assert hurried.termination is Termination.MAX_ITERATIONS


def test_a_saddle_is_told_from_a_minimum() -> None:
    """At an exact saddle the Newton steps rest, and the solver says STALLED instead of CONVERGED."""
    problem = Wahba(AXES, AXES, (3.0, 2.0, 1.0))
    q_BN = np.array([1.0, 0.0, 0.0, 0.0])
    form = problem.lower()
    point = alignment_point(form, q_BN, curvature(form.b_B, form.r_N, form.weights, q_BN))
    assert point.termination is Termination.STALLED
    assert problem.interpret(point, "by hand").proof is Proof.STATIONARY


def test_triad_trusts_the_named_pair() -> None:
    problem = two_errors()
    for primary in (0, 1):
        answer = optsat.solve(problem, Triad(primary)).answer
        form = problem.lower()
        np.testing.assert_allclose(answer.dcm_BN @ form.r_N[primary], form.b_B[primary], atol=1e-15)
    with pytest.raises(InputError, match="`primary` must be 0, 1 or None, got 2"):
        Triad(2)


def test_an_enclosure_is_valid_whatever_the_conic_solver_did() -> None:
    """A conic solver stopped at its first iteration still yields weights, and any weights give a valid ball."""
    problem = CertifiedAttitudeProblem(body(AXES), AXES, 0.1)
    hurried = optsat.solve(problem, ScaledSemidefinite(conic=Clarabel(max_iterations=1)))
    assert hurried.termination is Termination.MAX_ITERATIONS
    assert hurried.answer.bound_rad >= EQUAL_AXES_BOUND * (1 - 1e-10)
    assert hurried.answer.certificate.verify()


def test_an_enclosure_can_start_from_given_weights() -> None:
    problem = CertifiedAttitudeProblem(body(AXES), AXES, (0.05, 0.1, 0.2))
    start = Point(x=Q, dual=np.array([0.2, 0.3, 0.5]), termination=Termination.CONVERGED)
    warm, cold = optsat.solve(problem, ScaledSemidefinite(), start), optsat.solve(problem)
    assert warm.answer.bound_rad == pytest.approx(cold.answer.bound_rad, rel=1e-6)


def test_cells_stop_at_their_limit_and_stay_valid() -> None:
    rng = np.random.default_rng(3)
    r_N = rng.standard_normal((4, 3))
    r_N /= np.linalg.norm(r_N, axis=1, keepdims=True)
    first = optsat.certify_attitude(body(r_N), r_N, (0.05, 0.02, 0.1, 0.2))
    few = optsat.solve(RefinedEnclosure(first), CellCoverSolver(cells=1, gap=0.0))
    many = optsat.solve(RefinedEnclosure(first), CellCoverSolver(cells=30, gap=0.0))
    assert few.termination is many.termination is Termination.MAX_ITERATIONS
    assert many.answer.bound_rad <= few.answer.bound_rad <= first.bound_rad
    assert many.answer.certificate.verify()


def test_a_failed_conic_solver_leaves_the_first_bound() -> None:
    first = optsat.certify_attitude(body(AXES), AXES, 0.1)
    solution = optsat.solve(RefinedEnclosure(first), CellCoverSolver(conic=Clarabel(max_iterations=1)))
    assert solution.answer.bound_rad <= first.bound_rad
    assert solution.answer.certificate.verify()


def test_weights_of_a_symmetric_set_are_equal() -> None:
    form = CertifiedAttitudeProblem(body(AXES), AXES, 0.1).lower()
    np.testing.assert_allclose(ScaledSemidefinite().run(form).dual, 1 / 3, atol=1e-6)
