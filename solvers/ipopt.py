"""IPOPT: filter interior point with exact derivatives, on the epigraph of a min-max form."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from optsat.forms import MinMaxForm, Point, required
from optsat.solution import Termination
from optsat.solvers.epigraph import run_epigraph

_TERMINATION = {
    "Solve_Succeeded": Termination.CONVERGED,
    "Solved_To_Acceptable_Level": Termination.STALLED,
    "Search_Direction_Becomes_Too_Small": Termination.STALLED,
    "Infeasible_Problem_Detected": Termination.STALLED,
    "Maximum_Iterations_Exceeded": Termination.MAX_ITERATIONS,
    "Maximum_CpuTime_Exceeded": Termination.TIME_LIMIT,
    "Maximum_WallTime_Exceeded": Termination.TIME_LIMIT,
}

# keep the given point and multipliers instead of pushing them into the interior
_WARM: Mapping[str, Any] = {
    "ipopt.warm_start_init_point": "yes",
    "ipopt.warm_start_bound_push": 1e-9,
    "ipopt.warm_start_slack_bound_push": 1e-9,
    "ipopt.warm_start_mult_bound_push": 1e-9,
    "ipopt.mu_init": 1e-5,
}


@dataclass(frozen=True)
class Ipopt:
    """Interior point of CasADi's wheel, with bounds kept as they are given.

    tolerance : of the scaled optimality error; max_iterations : iteration limit
    Source: Waechter & Biegler (2006).
    """

    tolerance: float = 1e-10
    max_iterations: int = 1000
    name: str = "ipopt"

    def accepts(self, form: object) -> bool:
        """Return whether the form is a min-max of CasADi functions."""
        return isinstance(form, MinMaxForm) and form.symbolic

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the point at which IPOPT stops; `stats["status"]` keeps its own word."""
        options: dict[str, Any] = {
            "print_time": False,
            "calc_lam_p": False,
            "show_eval_warnings": False,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.tol": self.tolerance,
            "ipopt.constr_viol_tol": self.tolerance,
            "ipopt.acceptable_iter": 0,
            "ipopt.max_iter": self.max_iterations,
            # relaxed bounds would report an optimum below the true one
            "ipopt.bound_relax_factor": 0.0,
        }
        if start is not None and len(start.dual):
            options |= _WARM
        return run_epigraph(required(form, MinMaxForm, self.name), "ipopt", options, _TERMINATION, start)
