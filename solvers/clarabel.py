"""Clarabel back end: conic forms through its own interface, no modelling layer in between."""

import importlib
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.forms import ConicForm, Point, required
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
def _cone_kinds() -> dict[str, Any]:
    library = _library()
    return {
        "zero": library.ZeroConeT,
        "nonnegative": library.NonnegativeConeT,
        "second_order": library.SecondOrderConeT,
        "psd_triangle": library.PSDTriangleConeT,
    }


class _CompressedColumns:
    """What clarabel reads of a SciPy csc_matrix.

    Building the real one takes half as long as solving a small problem.
    """

    has_sorted_indices = True
    has_canonical_format = True

    def __init__(self, dense: Array) -> None:
        columns = dense.T
        filled = columns != 0
        self.data: list[float] = columns[filled].tolist()
        self.indices: list[int] = np.nonzero(filled)[1].tolist()
        self.indptr: list[int] = [0, *np.cumsum(filled.sum(axis=1)).tolist()]
        self.shape, self.nnz = dense.shape, len(self.data)


@dataclass(frozen=True)
class Clarabel:
    """Interior-point conic solver.

    `dual` is also filled when the problem is infeasible: then it is the ray of the proof.

    max_iterations : iteration limit; tolerance : gap and feasibility tolerance of the solver (an accuracy is proven
    elsewhere); prescaled : the form's numbers are of order one, so the solver need not rescale or presolve
    Source: Goulart & Chen, Clarabel.
    """

    max_iterations: int = 100
    tolerance: float = 1e-9
    prescaled: bool = False
    name: str = "clarabel"

    def accepts(self, form: object) -> bool:
        """Return whether the form is conic."""
        return isinstance(form, ConicForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Solve the conic form; `stats["status"]` keeps the solver's own word."""
        form = required(form, ConicForm, self.name)
        library, kinds = _library(), _cone_kinds()
        settings = library.DefaultSettings()
        settings.verbose = False
        settings.max_iter = self.max_iterations
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = self.tolerance
        if self.prescaled:
            settings.equilibrate_enable = settings.presolve_enable = settings.chordal_decomposition_enable = False
        n = len(form.q)
        solver = library.DefaultSolver(
            _CompressedColumns(np.zeros((n, n))),
            form.q.tolist(),
            _CompressedColumns(form.A),
            form.b.tolist(),
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
