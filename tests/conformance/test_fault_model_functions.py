"""Every function of the fault models: Jacobians against differences, batches and compiled kernels against calls."""

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.models.accelerometer import Accelerometer, Axes, Sensed
from optsat.models.additive_sensors import PositionReceiver, PressureSensor, RateGyro, SkewedGyro
from optsat.models.attitude_motion import attitude_derivative, attitude_euler_step, attitude_step
from optsat.models.gravity import EARTH_J2, gravity, translation_derivative
from optsat.models.nine_state_orbit import nine_state_derivative, nine_state_euler_step
from optsat.models.spacecraft import SEED_GRAVITATIONAL_PARAMETER as MU
from optsat.models.star_tracker import StarTracker
from optsat.models.thrusters import ThrusterPairs
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction

FUNCTIONS = [
    attitude_derivative(),
    attitude_step(),
    attitude_euler_step(),
    gravity(MU),
    gravity(MU, EARTH_J2),
    translation_derivative(gravity(MU, EARTH_J2)),
    nine_state_derivative(MU),
    nine_state_euler_step(MU),
    Accelerometer(sensed=Sensed.SPECIFIC_FORCE, axes=Axes.BODY).measurement(),
    StarTracker().measurement(),
    RateGyro().measurement(),
    SkewedGyro().measurement(),
    PositionReceiver().measurement(),
    PressureSensor().measurement(),
    ThrusterPairs().torque(),
]
EACH = pytest.mark.parametrize("function", FUNCTIONS, ids=[f"{i}-{each.name}" for i, each in enumerate(FUNCTIONS)])
SIZES = {"r_N": 7e6, "v_N": 7e3, "noise": 0.1, "dt": 1.0}


def drawn(port: Port, rng: np.random.Generator) -> Array:
    if port.name == "inertia_B":
        return np.diag([300.0, 280.0, 350.0]) + 5.0 * (lambda a: a + a.T)(rng.normal(size=(3, 3)))
    value = SIZES.get(port.name, 1.0) * rng.normal(size=port.shape)
    if port.name == "q_BN":
        value = value / np.linalg.norm(value)
        # away from the sign rule w >= 0
        value[3] = abs(value[3]) + 0.5
        value /= np.linalg.norm(value)
    return np.abs(value) if port.lower == 0.0 else np.asarray(value)


def columns(result: object) -> tuple[Array, ...]:
    return result if isinstance(result, tuple) else (np.asarray(result),)


@EACH
def test_jacobians(function: GeneratedFunction) -> None:
    rng = np.random.default_rng(1)
    point = {port.name: drawn(port, rng) for port in function.inputs}
    for port in function.inputs:
        h = 1e-6 * max(1.0, float(np.abs(point[port.name]).max()))
        unit = np.eye(port.size).reshape(port.size, *port.shape)
        ends = [
            [columns(function(**{**point, port.name: point[port.name] + sign * h * each})) for each in unit]
            for sign in (1, -1)
        ]
        for number, output in enumerate(function.outputs):
            differences = [(a[number] - b[number]).reshape(-1) / (2 * h) for a, b in zip(*ends, strict=True)]
            jacobian = function.jacobian(output.name, port.name)(**point)
            noise = 1e-15 * float(np.abs(ends[0][0][number]).max()) / h
            np.testing.assert_allclose(
                jacobian, np.stack(differences, axis=-1), rtol=1e-6, atol=1e-7 * np.abs(jacobian).max() + 20 * noise
            )


@EACH
def test_batches_and_kernels_have_the_bits_of_calls(function: GeneratedFunction) -> None:
    rng = np.random.default_rng(2)
    points = [np.stack([drawn(port, rng) for _ in range(9)]) for port in function.inputs]
    called = [columns(function(*(values[k] for values in points))) for k in range(9)]
    for batch in (function.batch(*points), function.kernel(math="libm").batch(*points)):
        for number, values in enumerate(columns(batch)):
            np.testing.assert_array_equal(values, np.stack([each[number] for each in called]))
