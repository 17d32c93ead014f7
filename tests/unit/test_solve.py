"""The one verb: the table's order, a given solver, a given start, and a refusal that names both sides."""

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import optsat
from optsat.errors import UnsupportedFormError
from optsat.forms import Point
from optsat.solution import Proof, Solution, Termination
from optsat.solvers import SOLVERS


@dataclass(frozen=True)
class Parabola:
    """Minimise (x - 3)^2; its form is the problem itself."""

    def lower(self) -> "Parabola":
        return self

    def interpret(self, point: Point, solver: str) -> Solution[float]:
        return Solution(float(point.x[0]), point.termination, Proof.FEASIBLE, stats={"solver": solver})


@dataclass(frozen=True)
class Newton:
    """One step, or the start itself."""

    name: str = "newton"

    def accepts(self, form: object) -> bool:
        return isinstance(form, Parabola)

    def run(self, form: object, start: Point | None = None) -> Point:
        return start or Point(np.array([3.0]), np.zeros(0), Termination.CONVERGED)


def test_a_given_solver_is_used_and_named() -> None:
    found = optsat.solve(Parabola(), Newton())
    assert (found.answer, found.stats["solver"]) == (3.0, "newton")


def test_a_given_start_reaches_the_solver() -> None:
    start = Point(np.array([5.0]), np.zeros(0), Termination.STALLED)
    found = optsat.solve(Parabola(), Newton(), start)
    assert (found.answer, found.termination) == (5.0, Termination.STALLED)


def test_without_a_solver_the_first_of_the_table_is_taken() -> None:
    problem = optsat.Wahba(np.eye(3), np.eye(3))
    first = next(solver for solver in SOLVERS if solver.accepts(problem.lower()))
    assert optsat.solve(problem).stats["solver"] == first.name == "davenport"


def test_a_form_that_nobody_takes() -> None:
    with pytest.raises(UnsupportedFormError, match="No solver of the table accepts Parabola"):
        optsat.solve(Parabola())


def test_a_solver_that_cannot() -> None:
    with pytest.raises(UnsupportedFormError, match=r"newton cannot solve this AlignmentForm.*Drop the `solver`"):
        optsat.solve(optsat.Wahba(np.eye(3), np.eye(3)), Newton())


def test_the_verb_stays_a_verb_whatever_was_loaded_before(root: Path) -> None:
    """The module optsat.solve bears the name of the verb and must not take its place in the package."""
    program = "import optsat.solve, optsat.solvers, optsat; assert callable(optsat.solve), optsat.solve"
    subprocess.run([sys.executable, "-c", program], check=True, cwd=root)


def test_public_names_are_all_there() -> None:
    for name in optsat.__all__:
        assert getattr(optsat, name) is not None
    assert set(optsat.__all__) <= set(dir(optsat))
    with pytest.raises(AttributeError, match="has no attribute 'wabha'"):
        optsat.wabha  # noqa: B018
