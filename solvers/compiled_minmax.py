"""Compiled min-max: our interior point, compiled for one problem's functions; a solution takes microseconds then."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import OptsatError
from optsat.forms import MinMaxForm, Point, required
from optsat.kernels.kernel import Kernel
from optsat.kernels.minmax import LARGEST, MOST_ROWS, UNBOUNDED, minmax
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.status import Status
from optsat.kernels.toolchain import CompilerMissingError, find_compiler
from optsat.port import Port
from optsat.smooth_map import SymbolicMap
from optsat.solution import Termination

_TERMINATION = {Status.OK: Termination.CONVERGED, Status.NOT_CONVERGED: Termination.STALLED}


@dataclass(frozen=True)
class CompiledMinMax:
    """The kernel of `optsat.kernels.minmax` made of a form's functions, where there is a C compiler.

    Making it takes a second or two once, kept on disk; goals, weights, bounds, parameters and start are its arguments.
    """

    name: str = "compiled_minmax"
    # the engines of "auto" are those whose answer does not depend on what is installed, nor on how often one calls
    by_name_only: bool = True

    def accepts(self, form: object) -> bool:
        """Return whether the form is a min-max of scalar instructions, small, without equalities, and can be compiled.

        An equality leaves no room between its two rows, which an interior point needs.
        """
        if not isinstance(form, MinMaxForm) or not form.symbolic or len(form.lower) > LARGEST:
            return False
        scalar = all(
            isinstance(each, SymbolicMap) and each.function.is_a("SXFunction")
            for each in (form.objectives, form.constraints)
        )
        return scalar and len(_rows(form).level) <= MOST_ROWS and not _has_equalities(form) and _compiler_exists()

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the point at which the kernel stops; `stats["status"]` keeps its own word."""
        form = required(form, MinMaxForm, self.name)
        objectives, constraints = form.objectives, form.constraints
        if not isinstance(objectives, SymbolicMap) or not isinstance(constraints, SymbolicMap):
            raise TypeError("the compiled interior point needs CasADi functions")
        x0 = form.start if start is None else start.x
        rows = _rows(form)
        try:
            kernel = _kernel(
                objectives.function,
                constraints.function,
                tuple(zip(form.objective.tolist(), form.sign.tolist(), strict=True)),
                tuple(zip(rows.constraint.tolist(), rows.constraint_sign.tolist(), strict=True)),
                (form.A.shape, form.A.tobytes()),
                tuple(zip(rows.linear.tolist(), rows.linear_sign.tolist(), strict=True)),
            )
        except OptsatError as error:
            return Point(x0, np.zeros(0), Termination.NUMERICAL_ERROR, stats={"status": str(error)})
        p = np.concatenate((objectives.p, constraints.p))
        bounds = [np.clip(each, -UNBOUNDED, UNBOUNDED) for each in (form.lower, form.upper)]
        x, _, multipliers, pulls, _, iterations, status = kernel(
            x0, *([p] if len(p) else []), rows.level, rows.weight, *bounds
        )
        if status not in _TERMINATION:
            return Point(x0, np.zeros(0), Termination.NUMERICAL_ERROR, int(iterations), {"status": status.name})
        return Point(
            x, rows.dual(form, multipliers, pulls), _TERMINATION[status], int(iterations), {"status": status.name}
        )


@dataclass(frozen=True)
class _Rows:
    """The kernel's rows: those of the form, then one for each finite bound of the constraints and linear rows."""

    level: Array
    weight: Array
    constraint: Any
    constraint_sign: Array
    linear: Any
    linear_sign: Array

    def dual(self, form: MinMaxForm, multipliers: Array, pulls: Array) -> Array:
        """Return the multipliers in the form's order; pulls : of the bounds, positive at a lower one."""
        own, on_constraints, on_linear = np.split(multipliers, np.cumsum([len(form.weight), len(self.constraint)]))
        constraints, linear = np.zeros(form.constraints.size), np.zeros(len(form.A))
        np.add.at(constraints, self.constraint, self.constraint_sign * on_constraints)
        np.add.at(linear, self.linear, self.linear_sign * on_linear)
        return np.concatenate((own, constraints, linear, -pulls))


def _rows(form: MinMaxForm) -> _Rows:
    levels, sides = [form.level], []
    for lower, upper in (
        (form.constraint_lower, form.constraint_upper),
        (form.linear_lower, form.linear_upper),
    ):
        above, below = np.flatnonzero(np.isfinite(upper)), np.flatnonzero(np.isfinite(lower))
        levels += [upper[above], -lower[below]]
        sides.append((np.concatenate((above, below)), np.repeat((1.0, -1.0), (len(above), len(below)))))
    level = np.concatenate(levels)
    weight = np.concatenate((form.weight, np.zeros(len(level) - len(form.weight))))
    return _Rows(level, weight, *sides[0], *sides[1])


def _has_equalities(form: MinMaxForm) -> bool:
    hard = form.weight == 0
    sides: dict[int, set[float]] = {}
    for objective, sign in zip(form.objective[hard].tolist(), form.sign[hard].tolist(), strict=True):
        sides.setdefault(objective, set()).add(sign)
    equal = np.any(form.constraint_lower == form.constraint_upper) or np.any(form.linear_lower == form.linear_upper)
    return bool(equal) or any(len(each) == 2 for each in sides.values())


def _compiler_exists() -> bool:
    try:
        find_compiler()
    except CompilerMissingError:
        return False
    return True


@lru_cache(maxsize=64)
def _kernel(
    objectives: Any,
    constraints: Any,
    objective_rows: tuple[tuple[int, float], ...],
    constraint_rows: tuple[tuple[int, float], ...],
    linear: tuple[tuple[int, int], bytes],
    linear_rows: tuple[tuple[int, float], ...],
) -> Kernel:
    import casadi as ca

    x = ca.SX.sym("x", objectives.size1_in(0))
    p = ca.SX.sym("p", objectives.size1_in(1) + constraints.size1_in(1))
    first = objectives.size1_in(1)
    parts = (
        (objectives(x, p[:first]), objective_rows),
        (constraints(x, p[first:]), constraint_rows),
        (ca.mtimes(ca.DM(np.frombuffer(linear[1]).reshape(linear[0])), x), linear_rows),
    )
    rows = [sign * values[i] for values, chosen in parts for i, sign in chosen]
    parameters = [(Port("p", (p.numel(),), "-"), p)] if p.numel() else []
    return make_kernel(minmax("min_max_of_form", x, ca.vertcat(*rows), parameters=parameters))
