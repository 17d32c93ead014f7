"""NSGA-II through pymoo: the genetic algorithm of the interval-Wahba paper, kept as a reference to be compared with.

Not in the table of solvers: `solve` never prefers it, and it proves nothing. pymoo comes with the extra `peers`.
"""

import importlib
import importlib.util
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError, MissingExtraError
from optsat.forms import FrontForm, Point, required
from optsat.solution import Termination


def pymoo_is_installed() -> bool:
    """Return whether pymoo can be imported."""
    return importlib.util.find_spec("pymoo") is not None


@dataclass(frozen=True)
class Nsga2:
    """Non-dominated sorting genetic algorithm with pymoo's own operators.

    population, generations : size of the search, both at least 1; seed : of its random numbers
    Source: Deb, Pratap, Agarwal & Meyarivan (2002); Blank & Deb, pymoo (2020).
    """

    population: int = 100
    generations: int = 150
    seed: int = 0
    name: str = "nsga2"

    def __post_init__(self) -> None:
        for name in ("population", "generations"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise InputError(f"`{name}` must be a whole number >= 1, got {value!r}.")

    def accepts(self, form: object) -> bool:
        """Return whether the form asks for a front."""
        return isinstance(form, FrontForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the member whose largest objective is least, after all generations; STALLED where none is feasible.

        Raises
        ------
        MissingExtraError : pymoo is not installed.
        """
        form = required(form, FrontForm, self.name)
        if not pymoo_is_installed():
            raise MissingExtraError("NSGA-II needs pymoo: pip install 'optsat[peers]'.")
        found = self._minimise(form)
        members = np.zeros((0, len(form.lower))) if found is None else np.atleast_2d(found)
        x, termination = np.full(len(form.lower), np.nan), Termination.STALLED
        if len(members):
            x = members[int(np.argmin(np.max(form.evaluate(members)[0], axis=1)))]
            termination = Termination.MAX_ITERATIONS
        return Point(x, np.zeros(0), termination, self.generations, {"members": members})

    def _minimise(self, form: FrontForm) -> Array | None:
        # typed in parts only: the module objects stay inside this adapter
        library: Any = importlib.import_module("pymoo.core.problem")
        algorithm: Any = importlib.import_module("pymoo.algorithms.moo.nsga2")
        optimise: Any = importlib.import_module("pymoo.optimize")

        def evaluate(problem: Any, points: Array, out: dict[str, Array], *_: Any, **__: Any) -> None:
            out["F"], out["G"] = form.evaluate(points)

        kind = type("Front", (library.Problem,), {"_evaluate": evaluate})
        problem = kind(
            n_var=len(form.lower),
            n_obj=form.objectives,
            n_ieq_constr=form.constraints,
            xl=form.lower,
            xu=form.upper,
        )
        result = optimise.minimize(
            problem, algorithm.NSGA2(pop_size=self.population), ("n_gen", self.generations), seed=self.seed
        )
        return None if result.X is None else np.asarray(result.X, dtype=np.float64)
