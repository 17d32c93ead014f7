"""SLSQP: sequential least squares on the epigraph of a min-max form, for functions known only by their values."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.forms import MinMaxForm, Point, required
from optsat.solution import Termination

_TERMINATION = {
    0: Termination.CONVERGED,
    8: Termination.STALLED,
    9: Termination.MAX_ITERATIONS,
}


class _NotFiniteError(Exception):
    """A function is not finite at a trial point; SLSQP would go on with the NaN."""


@dataclass(frozen=True)
class Slsqp:
    """SciPy's SLSQP with the derivatives that the form offers, exact or by differences.

    tolerance : of the factor's change; max_iterations : iteration limit. It returns no multipliers.
    Source: Kraft (1988).
    """

    tolerance: float = 1e-13
    max_iterations: int = 500
    name: str = "slsqp"

    def accepts(self, form: object) -> bool:
        """Return whether the form is a min-max."""
        return isinstance(form, MinMaxForm)

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the point at which SLSQP stops, or the last one at which all functions were finite."""
        from scipy import optimize

        form = required(form, MinMaxForm, self.name)
        x0 = form.start if start is None else start.x
        t0 = form.factor(form.objectives.values(x0))
        n = len(x0)
        # the stubs tell the options of the methods apart, which a table of them cannot satisfy
        minimize: Any = optimize.minimize
        last = [np.append(x0, t0)]

        def remember(xk: Array) -> None:
            last[0] = np.array(xk)

        try:
            result = minimize(
                lambda z: float(z[-1]),
                last[0],
                jac=lambda z: np.append(np.zeros(n), 1.0),
                method="SLSQP",
                bounds=optimize.Bounds(np.append(form.lower, -np.inf), np.append(form.upper, np.inf)),
                constraints=_constraints(form),
                callback=remember,
                options={"maxiter": self.max_iterations, "ftol": self.tolerance},
            )
        except _NotFiniteError as error:
            return Point(last[0][:-1], np.zeros(0), Termination.NUMERICAL_ERROR, stats={"status": str(error)})
        return Point(
            x=np.asarray(result.x, dtype=np.float64)[:-1],
            dual=np.zeros(0),
            termination=_TERMINATION.get(int(result.status), Termination.NUMERICAL_ERROR),
            iterations=int(result.nit),
            stats={
                "status": str(result.message),
                "evaluations": int(result.nfev),
                "jacobian_evaluations": int(result.njev),
            },
        )


def _constraints(form: MinMaxForm) -> list[Any]:
    """Return the rows as SLSQP's inequalities (values >= 0) and equalities, each with its derivatives."""
    weight = form.weight
    rows = [
        _constraint(
            "ineq",
            lambda z: weight * z[-1] - form.rows(form.objectives.values(z[:-1])),
            lambda z: np.column_stack((-form.sign[:, None] * form.objectives.jacobian(z[:-1])[form.objective], weight)),
            "objectives",
        )
    ]
    groups: list[tuple[str, Array, Array, Callable[[Array], Array], Callable[[Array], Array]]] = [
        (
            "constraints",
            form.constraint_lower,
            form.constraint_upper,
            lambda z: form.constraints.values(z[:-1]),
            lambda z: form.constraints.jacobian(z[:-1]),
        ),
        ("A x", form.linear_lower, form.linear_upper, lambda z: form.A @ z[:-1], lambda z: form.A),
    ]
    for name, lower, upper, values, jacobian in groups:
        equal = lower == upper
        for kind, chosen, bound, sign in (
            ("eq", equal, upper, 1.0),
            ("ineq", np.isfinite(upper) & ~equal, upper, -1.0),
            ("ineq", np.isfinite(lower) & ~equal, lower, 1.0),
        ):
            if np.any(chosen):
                rows.append(_one_side(kind, chosen, bound, sign, values, jacobian, name))
    return rows


def _one_side(
    kind: str,
    chosen: Any,
    bound: Array,
    sign: float,
    values: Callable[[Array], Array],
    jacobian: Callable[[Array], Array],
    name: str,
) -> dict[str, Any]:
    return _constraint(
        kind,
        lambda z: sign * (values(z) - bound)[chosen],
        lambda z: np.column_stack((sign * jacobian(z)[chosen], np.zeros(int(chosen.sum())))),
        name,
    )


def _constraint(
    kind: str, values: Callable[[Array], Array], jacobian: Callable[[Array], Array], name: str
) -> dict[str, Any]:
    def finite(z: Array) -> Array:
        result = values(z)
        if not np.all(np.isfinite(result)):
            raise _NotFiniteError(f"`{name}` is not finite at x = {np.array2string(z[:-1], precision=6)}")
        return result

    return {"type": kind, "fun": finite, "jac": jacobian}
