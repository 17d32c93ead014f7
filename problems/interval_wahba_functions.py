"""CasADi functions of the interval-Wahba problem, built once for each number of pairs.

x = (q_BN; alpha; beta), then one unknown per objective where a p-norm is minimised; parameters = (b^m; b^r; r^m; r^r;
size; weights; lambda; p). Functions that are built once keep their derivatives and their solvers from call to call.
"""

from functools import lru_cache
from typing import Any


@lru_cache(maxsize=32)
def interval_functions(pairs: int, shared: bool, norm: bool) -> tuple[Any, Any]:
    """Return objectives(x, p) and constraints(x, p).

    shared : one alpha and one beta for all pairs
    norm : objective sum_i s_i^p with |lambda_i f_i| <= s_i among the constraints; else objectives lambda_i f_i
    Constraints: |q|^2 - 1, and in turn (|b_i|^2 - 1) / size, (|r_i|^2 - 1) / size, all of which must vanish, then with
    `norm` four rows <= 0. size : of the boxes, so that narrow ones are no flatter than wide ones
    """
    import casadi as ca

    rows = 1 if shared else pairs
    q, alpha, beta = ca.SX.sym("q", 4), ca.SX.sym("alpha", 3 * rows), ca.SX.sym("beta", 3 * rows)
    s = ca.SX.sym("s", 2 if norm else 0)
    data = [ca.SX.sym(name, 3 * pairs) for name in ("b_mid", "b_radius", "r_mid", "r_radius")]
    size = ca.SX.sym("size", 2 * pairs)
    weights, scale, power = ca.SX.sym("weights", pairs), ca.SX.sym("scale", 2), ca.SX.sym("power")
    mid, change, unit = ca.SX(1), ca.SX(0), [ca.dot(q, q) - 1]
    for i in range(pairs):
        b, b_radius, r, r_radius = (each[3 * i : 3 * i + 3] for each in data)
        k = 0 if shared else 3 * i
        db, dr = alpha[k : k + 3] * b_radius, beta[k : k + 3] * r_radius
        mid -= weights[i] * _projection(q, b, r)
        change -= weights[i] * (_projection(q, db, r) + _projection(q, b, dr) + _projection(q, db, dr))
        unit += [(ca.dot(v, v) - 1) / size[2 * i + k] for k, v in enumerate((b + db, r + dr))]
    x, p = ca.vertcat(q, alpha, beta, s), ca.vertcat(*data, size, weights, scale, power)
    objectives = ca.vertcat(scale[0] * mid, scale[1] * change)
    if norm:
        unit += [objectives - s, -objectives - s]
        objectives = ca.sum1(s**power)
    return (
        ca.Function("interval_wahba_objectives", [x, p], [objectives]),
        ca.Function("interval_wahba_constraints", [x, p], [ca.vertcat(*unit)]),
    )


def _projection(q: Any, u: Any, w: Any) -> Any:
    """Return q^T K(u, w) q, which is u . A(q) w."""
    import casadi as ca

    v, s = q[:3], q[3]
    return (s * s - ca.dot(v, v)) * ca.dot(u, w) + 2 * ca.dot(v, u) * ca.dot(v, w) + 2 * s * ca.dot(v, ca.cross(u, w))
