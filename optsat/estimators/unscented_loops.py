"""Unscented Kalman filter in loops: the same step as `unscented_step`, small instead of fast."""

from collections.abc import Sequence
from dataclasses import replace

from optsat.arrays import Array
from optsat.attitude.backend import Value
from optsat.estimators.attitude_filter import attitude_filter_model
from optsat.estimators.filter_model import FilterModel, Noise
from optsat.estimators.unscented import SigmaPoints
from optsat.kernels.sigma_points import sigma_point_filter
from optsat.kernels.source import KernelSource
from optsat.models.rigid_body import EXAMPLE_INERTIA
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

# two factors of covariances, each of which multiplies rounding by its condition number
_FLOAT_ULP = 16384.0


def unscented_loops(
    model: FilterModel,
    name: str = "unscented_loops",
    points: SigmaPoints | None = None,
    noise: Noise = "full",
) -> KernelSource:
    """Return the kernel of one step: (x, P, u..., z, Q, R) -> (x, P, innovation, S, log_likelihood).

    It differs from `unscented_step` by rounding, and tells by its status what that tells by `definite`. In flash seven
    states take 3 kB instead of 44 kB (Cortex-M4, float); a step takes longer.

    Raises
    ------
    InputError : there are no such sigma points, or `noise` is neither "full" nor "diagonal".
    """
    points = SigmaPoints() if points is None else points
    n, m = model.state_size, model.measurement_size
    x, z = Port("x", (n,), "SI"), Port("z", (m,), "SI")
    return sigma_point_filter(
        name,
        f=_of_state(model, "f", x, x),
        h=_of_state(model, "h", x, z),
        spread=points.spread(n),
        centre_weight=points.centre_weight(n),
        noise=noise,
        restore=_restore(model, x),
        near=_near(model, z),
    )


def unscented_filter_7_loops(
    inertia_B: Array | Sequence[Sequence[float]] = EXAMPLE_INERTIA,
    alpha: float = 1.0,
    beta: float = 2.0,
    kappa: float = 0.0,
) -> KernelSource:
    """Return `unscented_filter_7_loops`: `unscented_filter_7` in loops, for little flash.

    inertia_B : inertia matrix (3, 3) about the centre of mass [kg m^2]
    alpha : spread of the sigma points
    beta : knowledge of the distribution, 2 for a Gaussian
    kappa : second spread of the sigma points
    """
    model = attitude_filter_model(inertia_B)
    kernel = unscented_loops(model, "unscented_filter_7_loops", SigmaPoints(alpha, beta, kappa), noise="diagonal")
    return replace(kernel, float_ulp=_FLOAT_ULP)


def _of_state(model: FilterModel, which: str, x: Port, result: Port) -> GeneratedFunction:
    state, u = _symbol(x), {port.name: _symbol(port) for port in model.input_ports}
    image = (model.f if which == "f" else model.h)(u)(state)
    inputs = [(x, state), *((port, u[port.name]) for port in model.input_ports)]
    return generate(which, inputs=inputs, outputs=[(result, image)])


def _restore(model: FilterModel, x: Port) -> GeneratedFunction | None:
    state = _symbol(x)
    return generate("restore", [(x, state)], [(x, model.scaled(state))]) if model.unit_length else None


def _near(model: FilterModel, z: Port) -> GeneratedFunction | None:
    expected, measured = _symbol(z), _symbol(z)
    ports = [(Port("expected", z.shape, z.unit), expected), (z, measured)]
    return generate("near", ports, [(z, model.on_the_side_of(expected, measured))]) if model.sign_free else None


def _symbol(port: Port) -> Value:
    import casadi as ca

    return ca.SX.sym(port.name, port.rows, port.columns)
