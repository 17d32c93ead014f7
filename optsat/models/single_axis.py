"""Single axis: rotation about one principal axis with star tracker, gyros and chamber pressure, linear and discrete."""

from collections.abc import Sequence

from optsat.errors import InputError, nearest_name
from optsat.models.linear_discrete import LinearDiscreteModel, LinearSensor

STAR_SIGMA_RAD = 2 * (3.85e-7) ** 0.5
GYRO_SIGMA_RAD_S = 0.01
PRESSURE_SIGMA_NM = 0.5
RATE_VARIANCE = 1e-6

# the cost of a candidate only orders them: a skewed gyro is a part more, a pressure transducer changes the propulsion
AXIS_SENSORS = {
    sensor.name: sensor
    for sensor in (
        LinearSensor("star", [1.0, 0.0], STAR_SIGMA_RAD, [0.0], cost=5.0),
        LinearSensor("gyro", [0.0, 1.0], GYRO_SIGMA_RAD_S, [0.0], cost=1.0),
        LinearSensor("second gyro", [0.0, 1.0], GYRO_SIGMA_RAD_S, [0.0], cost=1.0),
        LinearSensor("pressure", [0.0, 0.0], PRESSURE_SIGMA_NM, [1.0], cost=3.0),
    )
}


def single_axis(
    sensors: Sequence[str] = ("star", "gyro"), inertia: float = 350.0, dt: float = 0.1
) -> LinearDiscreteModel:
    """Return one axis, states [theta [rad], omega [rad/s]], input `torque` [N m] held over the sample.

    sensors : of "star" (angle), "gyro", "second gyro" (rate), "pressure" (torque seen at the chamber)
    inertia : about the axis [kg m^2]
    dt : sample time [s]

    Raises
    ------
    InputError : an unknown sensor, none at all, inertia or dt not positive.
    Source: paper on modular filter banks, its noise levels; the inertia and the sample time are ours.
    """
    if not inertia > 0.0:
        raise InputError(f"`inertia` must be above 0 kg m^2, got {inertia:g}.")
    for name in sensors:
        if name not in AXIS_SENSORS:
            raise InputError(f"one axis has no sensor `{name}`.{nearest_name(name, list(AXIS_SENSORS))}")
    A = [[1.0, dt], [0.0, 1.0]]
    B = [[dt**2 / (2 * inertia)], [dt / inertia]]
    Q = [[0.0, 0.0], [0.0, RATE_VARIANCE]]
    return LinearDiscreteModel(A, B, Q, ("torque",), tuple(AXIS_SENSORS[name] for name in sensors), dt)
