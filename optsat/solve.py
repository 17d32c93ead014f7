"""The one verb: lower a problem to a form, run the first solver that accepts it, interpret the point."""

from typing import TYPE_CHECKING, Protocol, TypeVar

from optsat.errors import UnsupportedFormError, explain_unknown_options

if TYPE_CHECKING:
    # the verb is a public name, so importing optsat imports this module: it must not bring NumPy along
    from optsat.forms import Point
    from optsat.solution import Solution

A = TypeVar("A")


class Problem(Protocol[A]):
    """Frozen data that lowers itself to a form and reads the answer back."""

    def lower(self) -> object:
        """Return one of the forms of `optsat.forms`."""
        ...

    def interpret(self, point: "Point", solver: str) -> "Solution[A]":
        """Turn a solver's point into an answer, with residuals recomputed from the problem."""
        ...


class Solver(Protocol):
    """A back end: options are its own fields, it keeps no state between runs."""

    @property
    def name(self) -> str:
        """Name under which the solver is listed."""
        ...

    def accepts(self, form: object) -> bool:
        """Return whether `run` can take this form."""
        ...

    def run(self, form: object, start: "Point | None" = None) -> "Point":
        """Solve the form."""
        ...


@explain_unknown_options
def solve(problem: Problem[A], solver: Solver | None = None, start: "Point | None" = None) -> "Solution[A]":
    """Return the solution of `problem` by `solver`, or by the first solver of the ordered table that accepts its form.

    Raises
    ------
    UnsupportedFormError : no solver, or not the given one, accepts the form.
    """
    form = problem.lower()
    if solver is None:
        # the one sanctioned upward edge: the table is looked up only when no solver was given
        from optsat.solvers import SOLVERS

        solver = next((candidate for candidate in SOLVERS if candidate.accepts(form)), None)
        if solver is None:
            raise UnsupportedFormError(f"No solver of the table accepts {type(form).__name__}.")
    elif not solver.accepts(form):
        raise UnsupportedFormError(
            f"{solver.name} cannot solve this {type(form).__name__}. Drop the `solver` argument to let optsat choose."
        )
    return problem.interpret(solver.run(form, start), solver.name)
