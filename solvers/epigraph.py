"""Epigraph: a min-max form as a nonlinear programme in (x, t) for the solvers that CasADi interfaces."""

import json
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.forms import MinMaxForm, Point
from optsat.smooth_map import SymbolicMap
from optsat.solution import Termination


def run_epigraph(
    form: MinMaxForm,
    plugin: str,
    options: Mapping[str, Any],
    terminations: Mapping[str, Termination],
    start: Point | None,
) -> Point:
    """Return the point at which a CasADi solver stops; the solver is kept for the next run of the same functions.

    Levels, weights and parameters are numbers of the kept solver, so goals can move along a front at no cost.
    """
    objectives, constraints = form.objectives, form.constraints
    if not isinstance(objectives, SymbolicMap) or not isinstance(constraints, SymbolicMap):
        raise TypeError("the solvers of CasADi need CasADi functions")
    solver = _solver(
        objectives.function,
        constraints.function,
        tuple(form.objective.tolist()),
        tuple(form.sign.tolist()),
        (form.A.shape, form.A.tobytes()),
        plugin,
        json.dumps(options, sort_keys=True),
    )
    x0 = form.start if start is None else start.x
    t0 = form.factor(objectives.values(x0))
    m = len(form.weight)
    arguments = {
        "x0": np.append(x0, t0),
        "p": np.concatenate((objectives.p, constraints.p, form.level, form.weight)),
        "lbx": np.append(form.lower, -np.inf),
        "ubx": np.append(form.upper, np.inf),
        "lbg": np.concatenate((np.full(m, -np.inf), form.constraint_lower, form.linear_lower)),
        "ubg": np.concatenate((np.zeros(m), form.constraint_upper, form.linear_upper)),
    }
    rows = m + constraints.size + len(form.A)
    if start is not None and len(start.dual) == rows + len(x0):
        arguments |= {"lam_g0": start.dual[:rows], "lam_x0": np.append(start.dual[rows:], 0.0)}
    try:
        result = solver(**arguments)
        stats = solver.stats()
    except RuntimeError as error:
        # CasADi raises where a function cannot be evaluated at the first point or a linear solver gives up
        reason = str(error).strip().splitlines()[-1]
        return Point(x0, np.zeros(0), Termination.NUMERICAL_ERROR, stats={"status": reason})
    status = str(stats["return_status"])
    return Point(
        x=_column(result["x"])[:-1],
        dual=np.concatenate((_column(result["lam_g"]), _column(result["lam_x"])[:-1])),
        termination=terminations.get(status, Termination.NUMERICAL_ERROR),
        iterations=int(stats.get("iter_count", 0)),
        stats={
            "status": status,
            "evaluations": int(stats.get("n_call_nlp_g", stats.get("n_call_nlp_fg", 0))),
            "jacobian_evaluations": int(stats.get("n_call_nlp_jac_g", stats.get("n_call_nlp_jac_fg", 0))),
        },
    )


def _column(value: Any) -> Array:
    return np.asarray(value.full(), dtype=np.float64).reshape(-1)


@lru_cache(maxsize=64)
def _solver(
    objectives: Any,
    constraints: Any,
    objective: tuple[int, ...],
    sign: tuple[float, ...],
    linear: tuple[tuple[int, int], bytes],
    plugin: str,
    options: str,
) -> Any:
    import casadi as ca

    kind: Any = ca.SX if objectives.is_a("SXFunction") and constraints.is_a("SXFunction") else ca.MX
    x, first = kind.sym("x", objectives.size1_in(0)), kind.sym("p", objectives.size1_in(1))
    second = kind.sym("q", constraints.size1_in(1))
    t, level, weight = kind.sym("t"), kind.sym("level", len(sign)), kind.sym("weight", len(sign))
    values = objectives(x, first)[list(objective), 0]
    A = np.frombuffer(linear[1]).reshape(linear[0])
    programme = {
        "x": ca.vertcat(x, t),
        "p": ca.vertcat(first, second, level, weight),
        "f": t,
        "g": ca.vertcat(
            ca.DM(sign) * values - level - weight * t, constraints(x, second), ca.mtimes(ca.DM(ca.sparsify(A)), x)
        ),
    }
    return ca.nlpsol("epigraph", plugin, programme, json.loads(options))
