"""Min-max: the least attainment factor of objectives against their goals, under constraints and bounds."""

from collections.abc import Mapping, Sequence
from typing import Any

from optsat.errors import InputError
from optsat.kernels.instantiate import instantiate
from optsat.kernels.lowering import lower
from optsat.kernels.program import Program
from optsat.kernels.sizes import check_size
from optsat.kernels.source import KernelSource
from optsat.kernels.twins.minmax import twin
from optsat.kernels.twins.minmax_work import Sizes
from optsat.port import Port

UNBOUNDED = 1e20
"""Bounds from this size on stand for none."""

LARGEST = 24
MOST_ROWS = 160
"""Unknowns and rows above which the work memory no longer belongs on a stack."""


def minmax(
    name: str,
    x: Any,
    objectives: Any,
    constraints: Any = None,
    parameters: Sequence[tuple[Port, Any]] = (),
    absolute: Sequence[int] = (),
    residuals: Sequence[Any] = (),
    ranges: Mapping[str, tuple[float, float]] | None = None,
) -> KernelSource:
    """Return the kernel (x0, parameters, goals, weights, lower, upper) -> (x, gamma, multipliers, bound_multipliers,
    residual, iterations) of

        min gamma  subject to  F_i(x) - goal_i <= weight_i gamma,  g(x) <= 0,  lower <= x <= upper.

    x : (n,) CasADi SX symbols, n up to 24; objectives, constraints : (m,) and (k,) expressions F and g of x and the
    parameters, twice differentiable
    parameters : port and symbols of each further argument
    absolute : indices of objectives that must also satisfy -(F_i - goal_i) <= |weight_i| gamma
    residuals : unless empty, one vector for each objective, F_i = |residual_i|^2 / 2 + linear: the curvature of F is
        then that of Gauss and Newton, of g none; exact otherwise
    ranges : least and largest entry that flight code accepts of x0, goals, weights, lower and upper, by name

    At run time a weight of 0 makes an objective a hard constraint, a negative one asks for F_i >= goal_i; minimax is
    goals 0 and weights 1. Bounds of 1e20 or more stand for none, equal ones fix a variable.
    gamma : attainment factor as re-evaluated at x; negative where all goals are exceeded
    multipliers : of the objectives, of their absolute partners, of the constraints; sum of |weight| times multiplier
        is 1 at an optimum. bound_multipliers (n,) : positive where the lower bound holds x, negative where the upper
    residual : of the optimality conditions (Karush, Kuhn, Tucker), recomputed at exit: stationarity relative to its
        largest terms, violation, and complementarity relative to 1 + |gamma|
    iterations : steps, those of the fallback included

    Status: OS_OK where the residual is at most 7.5e-9 (1.7e-4 in float): a point of stationarity, which for convex
    rows is the optimum. OS_E_NOT_CONVERGED: x is the point of least gamma among those that satisfy the constraints, or
    of least violation. OS_E_RANGE: lower > upper, or no weight differs from 0. OS_E_NOT_FINITE: an argument, or a row
    at the start, is not finite. After the last two all results but `iterations` are NaN.

    Raises
    ------
    InputError : no such sizes or indices, an expression uses a symbol that is no argument, or an operation that no
        kernel knows.
    Source: Mehrotra, SIAM J. Optim. 2 (1992); Waechter and Biegler, Math. Program. 106 (2006); Nocedal and Wright,
        Numerical Optimization, 2nd ed., ch. 19.
    """
    import casadi as ca

    F, g = ca.vec(ca.SX(objectives)), ca.SX(0, 1) if constraints is None else ca.vec(ca.SX(constraints))
    n = check_size(name, "number of unknowns", x.numel(), 1, LARGEST)
    m = check_size(name, "number of objectives", F.numel(), 1, MOST_ROWS)
    check_size(name, "number of rows", m + len(absolute) + g.numel(), 1, MOST_ROWS)
    for i in absolute:
        check_size(name, "absolute index", i, 0, m - 1)
    if residuals and len(residuals) != m:
        raise InputError(f"{name}: `residuals` must hold one vector for each of {m} objectives, got {len(residuals)}.")
    goals, weights = ca.SX.sym("goals", m), ca.SX.sym("weights", m)
    widths = ca.fabs(ca.vertcat(weights, *(weights[i] for i in absolute), ca.SX(g.numel(), 1)))
    downward = ca.if_else(weights < 0, -1, 1)
    from_goal = downward * (F - goals)
    rows = ca.vertcat(from_goal, *(-from_goal[i] for i in absolute), g)
    multipliers = ca.SX.sym("multipliers", rows.numel())
    given = [symbols for _, symbols in parameters] + [goals, weights]
    signs = downward * multipliers[:m]
    for k, i in enumerate(absolute):
        signs[i] -= downward[i] * multipliers[m + k]
    sizes = Sizes(n, rows.numel(), sum(each.numel() for each in given))
    weighted = ca.vertcat(signs, multipliers[-g.numel() :] if g.numel() else ca.SX(0, 1))
    derivatives = [
        _derivatives(rows, x, widths, curvature, sizes.padded, [x, *given, multipliers], name)
        for curvature in _curvatures(ca.vertcat(F, g), x, weighted, residuals, name)
    ]
    leaves = {
        "rows": _leaf("rows", name, [x, *given], [rows]),
        "derivatives": min(derivatives, key=lambda program: program.operation_count),
        "widths": _leaf("widths", name, given, [widths]),
    }
    return instantiate(
        "minmax",
        name,
        leaves,
        sizes=sizes.of_template(),
        constants={"UNBOUNDED": UNBOUNDED},
        inputs=(
            _port("x0", n, ranges),
            *(port for port, _ in parameters),
            *(_port(each, m, ranges) for each in ("goals", "weights")),
            *(_port(each, n, ranges) for each in ("lower", "upper")),
        ),
        outputs=(
            Port("x", (n,), "-"),
            Port("gamma", (), "-"),
            Port("multipliers", (sizes.rows,), "-"),
            Port("bound_multipliers", (n,), "-"),
            Port("residual", (), "-"),
            Port("iterations", (), "-"),
        ),
        twin=twin(sizes, leaves, UNBOUNDED),
        has_short_loops=True,
    )


def _port(name: str, size: int, ranges: Mapping[str, tuple[float, float]] | None) -> Port:
    least, most = (ranges or {}).get(name, (None, None))
    return Port(name, (size,), "-", lower=least, upper=most)


def _curvatures(functions: Any, x: Any, weights: Any, residuals: Sequence[Any], name: str) -> list[Any]:
    """Return the Hessian of the weighted sum in each way worth a try: which takes the fewest operations depends on it.

    With residuals, that of Gauss and Newton.
    """
    import casadi as ca

    if not residuals:
        of_sum = ca.hessian(ca.dot(weights, functions), x)[0]
        return [of_sum, ca.jacobian(ca.jacobian(functions, x).T @ weights, x)]
    total = ca.SX(x.numel(), x.numel())
    for i, residual in enumerate(residuals):
        jacobian = ca.jacobian(ca.vec(residual), x)
        total += weights[i] * (jacobian.T @ jacobian)
    return [total]


def _derivatives(
    rows: Any, x: Any, widths: Any, curvature: Any, padded: int, arguments: list[Any], name: str
) -> Program:
    """Return values, gradients and Hessian in the layout of the template."""
    import casadi as ca

    n = x.numel()
    gradients = ca.horzcat(ca.jacobian(rows, x), -widths, ca.SX(rows.numel(), padded - n - 1))
    hessian = ca.diagcat(curvature, ca.SX(1, padded - n))
    results: list[Any] = list(ca.cse([rows, gradients, hessian]))
    return _leaf("derivatives", name, arguments, results)


def _leaf(slot: str, name: str, arguments: list[Any], results: list[Any]) -> Program:
    import casadi as ca

    function = ca.Function(slot, arguments, [ca.densify(each) for each in results], {"allow_free": True})
    if function.has_free():
        free = ", ".join(map(str, function.get_free()))
        raise InputError(f"{name}: the rows use {free}, which is no argument. Pass it among `parameters`.")
    return lower(function)
