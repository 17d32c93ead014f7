"""SQP: CasADi's sequential quadratic programming on the epigraph of a min-max form, with an open QP solver inside."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.forms import MinMaxForm, Point, required
from optsat.solution import Termination
from optsat.solvers.epigraph import run_epigraph

QuadraticSolver = Literal["daqp", "osqp", "ipqp"]

# those of the wheel that were measured to solve these programmes. Left out: qrqp returned infeasible points as solved;
# qpoases writes to standard output and remembers earlier runs; piqp prints warnings that no option silences
_QUIET: Mapping[str, Mapping[str, Any]] = {
    "daqp": {},
    "osqp": {"osqp": {"verbose": False, "eps_abs": 1e-9, "eps_rel": 1e-9, "polish": False}},
    "ipqp": {"print_header": False, "print_iter": False, "print_info": False, "linear_solver": "qr"},
}

# equal shares would often balance, as those of F <= t and -F <= t do; small ones lead to indefinite first Hessians
_FAVOUR = 0.1

_TERMINATION = {
    "Solve_Succeeded": Termination.CONVERGED,
    "Search_Direction_Becomes_Too_Small": Termination.STALLED,
    "Maximum_Iterations_Exceeded": Termination.MAX_ITERATIONS,
}


@dataclass(frozen=True)
class Sqp:
    """Exact Hessian, reflected to be positive definite, and a line search on the merit function.

    qp : "daqp", "osqp" or "ipqp"; tolerance : of the optimality conditions; max_iterations : limit
    Source: CasADi's sqpmethod; Nocedal & Wright, chapter 18.
    """

    qp: QuadraticSolver = "daqp"
    tolerance: float = 1e-10
    max_iterations: int = 200

    def __post_init__(self) -> None:
        if self.qp not in get_args(QuadraticSolver):
            raise InputError(f"`qp` must be one of {', '.join(get_args(QuadraticSolver))}, got {self.qp!r}.")

    @property
    def name(self) -> str:
        """Name under which the solver is listed."""
        return f"sqp_{self.qp}"

    def accepts(self, form: object) -> bool:
        """Return whether the form is a min-max of CasADi functions."""
        return isinstance(form, MinMaxForm) and form.symbolic

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the point at which the iteration stops; `stats["status"]` keeps its own word."""
        form = required(form, MinMaxForm, self.name)
        options = {
            "print_time": False,
            "print_header": False,
            "print_iteration": False,
            "print_status": False,
            "show_eval_warnings": False,
            "calc_lam_p": False,
            "tol_pr": self.tolerance,
            "tol_du": self.tolerance,
            "max_iter": self.max_iterations,
            "min_step_size": 1e-14,
            # t enters linearly, so the Lagrangian is never strictly convex; without a margin steps run away
            "convexify_strategy": "eigen-reflect",
            "convexify_margin": 1e-4,
            "max_iter_eig": 1000,
            "qpsol": self.qp,
            "qpsol_options": {"error_on_fail": False, "print_time": False, **_QUIET[self.qp]},
        }
        x0 = form.start if start is None else start.x
        dual = np.zeros(0) if start is None else start.dual
        started = Point(x0, dual if len(dual) else _first_multipliers(form, x0, _FAVOUR), Termination.CONVERGED)
        point = run_epigraph(form, "sqpmethod", options, _TERMINATION, started)
        if point.iterations == 0 and point.termination is Termination.CONVERGED:
            # its test of optimality leaves out complementarity, so that multipliers which balance by chance end it at
            # the start; all weight on the row that determines the factor is complementary
            started = Point(x0, _first_multipliers(form, x0, 0.0), Termination.CONVERGED)
            point = run_epigraph(form, "sqpmethod", options, _TERMINATION, started)
        return point


def _first_multipliers(form: MinMaxForm, x0: Array, others: float) -> Array:
    """Return weights that favour the row which determines the factor: with none, the first Hessian would be zero.

    others : share of the row farthest below it, about, in units of its own
    """
    rows = form.rows(form.objectives.values(x0))
    soft = form.weight > 0
    ratio = rows[soft] / form.weight[soft]
    below = np.max(ratio) - ratio
    size = others + below / max(float(np.max(below)), np.finfo(np.float64).tiny)
    share = np.divide(others, size, out=np.zeros_like(size), where=size > 0)
    share[np.argmax(ratio)] = 1.0
    dual = np.zeros(len(rows) + form.constraints.size + len(form.A) + len(form.lower))
    dual[: len(rows)][soft] = share / float(share @ form.weight[soft])
    return dual
