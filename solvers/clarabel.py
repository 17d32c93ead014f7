"""Clarabel back end: conic forms through its own interface, no modelling layer in between."""

import importlib
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from optsat.forms import ConicForm, Point
from optsat.solution import Termination

_TERMINATION = {
    "Solved": Termination.CONVERGED,
    "AlmostSolved": Termination.STALLED,
    "PrimalInfeasible": Termination.CONVERGED,
    "DualInfeasible": Termination.CONVERGED,
    "AlmostPrimalInfeasible": Termination.STALLED,
    "AlmostDualInfeasible": Termination.STALLED,
    "MaxIterations": Termination.MAX_ITERATIONS,
    "MaxTime": Termination.TIME_LIMIT,
    "InsufficientProgress": Termination.STALLED,
}


@cache
def _library() -> Any:
    # clarabel ships no types: the module object stays inside this adapter
    return importlib.import_module("clarabel")


@cache
def _sparse() -> Any:
    return importlib.import_module("scipy.sparse")


@dataclass(frozen=True)
class Clarabel:
    """Interior-point conic solver. `dual` is also filled when the problem is infeasible: then it is the ray of the
    proof.

    max_iterations : iteration limit; tolerance : gap and feasibility tolerance of the solver (an accuracy is proven
    elsewhere)
    Source: Goulart & Chen, Clarabel.
    """

    max_iterations: int = 100
    tolerance: float = 1e-9
    name: str = "clarabel"

    def accepts(self, form: object) -> bool:
        """Return whether the form is conic."""
        return isinstance(form, ConicForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Solve the conic form; `stats["status"]` keeps the solver's own word."""
        assert isinstance(form, ConicForm)
        library, sparse = _library(), _sparse()
        kinds = {
            "zero": library.ZeroConeT,
            "nonnegative": library.NonnegativeConeT,
            "second_order": library.SecondOrderConeT,
            "psd_triangle": library.PSDTriangleConeT,
        }
        settings = library.DefaultSettings()
        settings.verbose = False
        settings.max_iter = self.max_iterations
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = self.tolerance
        n = len(form.q)
        solver = library.DefaultSolver(
            sparse.csc_matrix((n, n)),
            form.q,
            sparse.csc_matrix(form.A),
            form.b,
            [kinds[kind](size) for kind, size in form.cones],
            settings,
        )
        result = solver.solve()
        status = str(result.status)
        return Point(
            x=np.array(result.x),
            dual=np.array(result.z),
            termination=_TERMINATION.get(status, Termination.NUMERICAL_ERROR),
            iterations=int(result.iterations),
            stats={"status": status},
        )
