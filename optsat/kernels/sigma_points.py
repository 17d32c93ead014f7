"""Sigma points: the unscented Kalman filter in loops around its two leaves, small in flash."""

import math
from typing import Literal

from optsat.errors import InputError
from optsat.kernels.definition import Definition, lower_in_order, lower_or
from optsat.kernels.evaluate import evaluator
from optsat.kernels.instantiate import instantiate
from optsat.kernels.slots import column, identity, of_one, second
from optsat.kernels.source import KernelSource
from optsat.kernels.twins.sigma_points import SigmaPointTwin
from optsat.port import Port


def sigma_point_filter(
    name: str,
    f: Definition,
    h: Definition,
    spread: float,
    centre_weight: float,
    noise: Literal["full", "diagonal"] = "full",
    restore: Definition | None = None,
    near: Definition | None = None,
) -> KernelSource:
    """Return one step, prediction and update: (x, P, u..., z, Q, R) -> (x, P, innovation, S, log_likelihood).

    The points of P go through f; points of the predicted covariance, Q included, through h. P is symmetric to the bit.

    f, h : (x, u...) -> x after the step, and (x, u...) -> z, with the same arguments, x the first
    spread : square of the points' distance in deviations; centre_weight : of the centre in covariances
    noise : "full", Q and R are matrices of which the lower triangle is read; "diagonal", columns of variances
    restore : x -> x after prediction and update, such as scaling a quaternion to length one
    near : (expected, z) -> z of the same meaning on the side of what is expected, such as the sign of a quaternion

    Status: OS_E_STATE where P, its prediction or S is not positive definite, OS_E_NOT_FINITE for such an argument,
    OS_E_OUTPUT where a result is not finite; all results are then NaN.

    Raises
    ------
    InputError : f and h differ in their arguments, or the spread is not positive.

    Source: van der Merwe, Sigma-Point Kalman Filters for Probabilistic Inference (2004), 3.2.
    """
    if not (math.isfinite(spread) and spread > 0.0 and math.isfinite(centre_weight)):
        raise InputError(
            f"{name}: `spread` must be positive, got {spread}, and `centre_weight` finite: {centre_weight}."
        )
    names = [port.name for port in f.inputs]
    if names != [port.name for port in h.inputs] or len(f.outputs) != 1 or len(h.outputs) != 1:
        raise InputError(f"{name}: f and h must take the same arguments and give one result each.")
    x, u_ports, (z,) = f.inputs[0], f.inputs[1:], h.outputs
    n, m, u = x.size, z.size, sum(port.size for port in u_ports)
    leaves = {
        "f": lower_in_order(f, names),
        "h": lower_in_order(h, names),
        "restore": lower_or(restore, identity("restore", n)),
        "near": lower_or(near, second("near", column(m, "expected"), column(m, "z"))),
        "log": of_one("LOG"),
    }
    constants = {
        "DISTANCE": math.sqrt(spread),
        "WEIGHT": 0.5 / spread,
        "CENTRE": centre_weight,
        "CROSS": 0.5 / math.sqrt(spread),
        "OFFSET": 0.5 * m * math.log(2.0 * math.pi),
    }
    covariance = Port("P", (n, n), "SI", positive_definite=True)
    return instantiate(
        "sigma_points",
        name,
        leaves,
        {"N": n, "M": m, "U": u, "WIDTH": max(n, m), "FULL": int(noise == "full")},
        inputs=(x, covariance, *u_ports, z, _noise("Q", n, noise), _noise("R", m, noise)),
        outputs=(
            *(x, covariance, Port("innovation", (m,), "SI"), Port("S", (m, m), "SI", positive_definite=True)),
            Port("log_likelihood", (), "-"),
        ),
        constants=constants,
        twin=SigmaPointTwin(
            {slot: evaluator(program) for slot, program in leaves.items()},
            constants,
            n=n,
            m=m,
            u=u,
            full=noise == "full",
        ),
        operations=(2 * n + 1) * (leaves["f"].operation_count + leaves["h"].operation_count + 2 * n)
        + 6 * n * n * (n + m)
        + 2 * n**3 // 3
        + m**3 // 3
        + 4 * n * m * m,
    )


def _noise(name: str, size: int, noise: str) -> Port:
    if noise == "full":
        return Port(name, (size, size), "SI")
    if noise == "diagonal":
        return Port(f"{name}_diagonal", (size,), "SI", lower=0.0)
    raise InputError(f"`noise` must be 'full' or 'diagonal', got {noise!r}.")
