"""Attitude bank model: motion, sensors and change of reference of an attitude bank, symbolically."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion, rotation_vector
from optsat.attitude.backend import Value
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.bank_model import BankModel, chain_over, pattern_of
from optsat.estimators.bank_samples import BankSamples, Device, Sensor, exact_density, kind_of
from optsat.kernels.hypothesis_bank import BankStructure, Channel
from optsat.models.parts import GYRO, PRESSURE, Part
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step

_TINY = 1e-30
_BIAS = 6
_NORM_SLACK = 0.1


def attitude_bank_model(bank: AttitudeBank) -> BankModel:
    """Return the model of a bank: error state (rotation in B, rate, gyro bias if any, torque deviations).

    The reference is moved by RK4; F = I + A T + (A T)^2 / 2 + (A T)^3 / 6, A by differentiation at the mean of the
    rates before and after. The star tracker's innovation is the rotation vector of y (x) q_BN^-1, so that it holds at
    any angle.
    """
    axes = bank.thruster_axes
    symbols = _Symbols(bank)
    F_pattern, predict = _predict(bank, symbols)
    H_pattern, observe = _observe(bank, symbols)
    channels = tuple(
        Channel(
            rows=3 if part is Part.STAR else 1,
            bit=bank.bit_of(part),
            erratic_deviation={"star": bank.star_error, "pressure": bank.torque_prior}.get(
                part.device, bank.gyro_error
            ),
        )
        for part in bank.channels
    )
    structure = BankStructure(
        states=symbols.size,
        bits=len(bank.bits),
        channels=channels,
        actuated=tuple((_bit(bank, axis), bank.torque_prior**2) for axis in axes),
        F_pattern=F_pattern,
        H_pattern=H_pattern,
    )
    return BankModel(
        structure=structure,
        predict=predict,
        observe=observe,
        shift=_shift(symbols),
        reference=symbols.reference_ports,
        carried=symbols.carried_ports,
        inputs=symbols.input_ports,
        samples=symbols.samples,
        faults=bank.bits,
        states=symbols.names,
        spread=(*[bank.attitude_prior] * 3, *[bank.rate_prior] * 3, *[bank.bias_prior] * (3 * symbols.has_bias)),
        sample_time=bank.sample_time,
        example=partial(_example, bank, symbols),
    )


def _bit(bank: AttitudeBank, axis: int) -> int:
    return next(b for b, fault in enumerate(bank.bits) if any(part.is_thruster and part.axis == axis for part in fault))


class _Symbols:
    """Ports and symbols of reference, carried values and inputs, and where the error states stand."""

    def __init__(self, bank: AttitudeBank) -> None:
        import casadi as ca

        axes = bank.thruster_axes
        self.has_bias = bank.gyro_bias_noise is not None
        bias = (Port("gyro_bias_B", (3,), "rad/s"),) if self.has_bias else ()
        torque = (Port("torque_deviation_B", (len(axes),), "N m"),) if axes else ()
        self.reference_ports = (QUATERNION, Port("omega_BN_B", (3,), "rad/s"), *bias, *torque)
        self.samples = BankSamples(_devices(bank))
        command = Port("command_B", (3,), "N m")
        self.carried_ports = (*self.samples.carried_ports, Port("last_command_B", (3,), "N m"))
        step = Port("dt", (), "s", lower=0.0, upper=1e3 * bank.sample_time, safe=bank.sample_time)
        self.input_ports = (command, step, *self.samples.input_ports)
        ports = (*self.reference_ports, *self.carried_ports, *self.input_ports)
        self.of = {port.name: ca.SX.sym(port.name, port.rows, port.columns) for port in ports}
        self.axes = axes
        self.torque_at = 9 if self.has_bias else 6
        self.size = self.torque_at + len(axes)
        letters = ("x", "y", "z")
        self.names = (
            *(f"rotation_{each} [rad]" for each in letters),
            *(f"rate_{each} [rad/s]" for each in letters),
            *(f"gyro_bias_{each} [rad/s]" for each in letters if self.has_bias),
            *(f"torque_deviation_{letters[axis]} [N m]" for axis in axes),
        )

    @property
    def arguments(self) -> list[tuple[Port, Value]]:
        ports = (*self.reference_ports, *self.carried_ports, *self.input_ports)
        return [(port, self.of[port.name]) for port in ports]

    def torque(self) -> Value:
        """Return the torque deviation on all three axes."""
        import casadi as ca

        parts = [ca.SX(0)] * 3
        for k, axis in enumerate(self.axes):
            parts[axis] = self.of["torque_deviation_B"][k]
        return ca.vertcat(*parts)


def _predict(bank: AttitudeBank, s: _Symbols) -> tuple[tuple[tuple[int, int], ...], GeneratedFunction]:
    import casadi as ca

    dt, command, before = s.of["dt"], s.of["command_B"], s.of["omega_BN_B"]
    step = rk4_step(bank.body.derivative(), ("q_BN", "omega_BN_B"), unit_length=("q_BN",))
    q, omega = step.casadi.call([s.of["q_BN"], before, command + s.torque(), dt])

    rate, effect = ca.SX.sym("rate", 3), ca.SX.sym("effect", 3)
    change = bank.body.omega_dot().casadi.call([rate, effect])[0]
    by_rate = ca.substitute(ca.jacobian(change, rate), rate, 0.5 * (before + omega))
    by_torque = ca.jacobian(change, effect)
    A = ca.SX(s.size, s.size)
    A[0:3, 0:3] = -ca.skew(0.5 * (before + omega))
    A[0:3, 3:6] = ca.SX.eye(3)
    A[3:6, 3:6] = by_rate
    for k, axis in enumerate(s.axes):
        A[3:6, s.torque_at + k] = by_torque[:, axis]
    AT = ca.sparsify(A) * dt
    F = ca.SX.eye(s.size) + AT + AT @ AT / 2 + AT @ AT @ AT / 6
    pattern, values = pattern_of(ca.sparsify(F))

    steps = dt / bank.sample_time
    bias = [bank.gyro_bias_noise or 0.0] * 3 if s.has_bias else []
    noise = np.array([0.0] * 3 + [bank.rate_noise] * 3 + bias + [bank.torque_noise] * len(s.axes)) ** 2
    chances = [bank.thruster_chance if fault[0].is_thruster else bank.sensor_chance for fault in bank.bits]
    change_of_command = [(command - s.of["last_command_B"])[axis] for axis in s.axes]
    kept = [s.of[port.name] for port in s.reference_ports[2:]]
    result = ca.vertcat(
        *(q, omega, *kept, values, ca.DM(noise) * steps),
        *(chance for pair in chances for chance in chain_over(*pair, steps)),
        *(0.5 * each for each in change_of_command),
        *(each**2 / 12 for each in change_of_command),
        *(-s.of["torque_deviation_B"][k] for k in range(len(s.axes))),
    )
    return pattern, generate("predict", s.arguments, [(Port("predicted", (result.numel(),), "SI"), result)])


def _devices(bank: AttitudeBank) -> tuple[Device, ...]:
    pressure = tuple(part for part in bank.channels if part in PRESSURE)
    return (
        Device(Port("star_BN", (4,), "-", safe=(0.0, 0.0, 0.0, 1.0)), 4, (Part.STAR,)),
        Device(Port("gyro_B", (3,), "rad/s"), 1, GYRO),
        *([Device(Port("skewed_gyro", (1,), "rad/s"), 1, (Part.SKEWED_GYRO,))] if bank.skewed_axis else []),
        *([Device(Port("pressure_B", (len(pressure),), "N m"), 1, pressure)] if pressure else []),
    )


def _observe(bank: AttitudeBank, s: _Symbols) -> tuple[tuple[tuple[int, int], ...], GeneratedFunction]:
    import casadi as ca

    scalars = [_scalar(bank, s, part) for part in bank.channels[1:]]
    H = ca.SX(3 + len(scalars), s.size)
    H[0:3, 0:3] = ca.SX.eye(3)
    for k, (_, sees) in enumerate(scalars):
        for place, value in sees:
            H[3 + k, place] = value
    pattern, values = pattern_of(ca.sparsify(H))

    length = ca.sqrt(ca.sumsqr(s.of["star_BN"]))
    unit = s.of["star_BN"] / ca.fmax(length, _TINY)
    turned = rotation_vector.from_quaternion(quaternion.compose(unit, quaternion.inverse(s.of["q_BN"])))
    star, deviation = _star_change(bank, s, unit), [float(each) for each in bank.star_deviation]
    sensors = [star, *(sensor for sensor, _ in scalars)]
    received, seen = s.of["received"], s.of["seen"]
    kinds = [kind_of(received[0], ca.fabs(length - 1) <= _NORM_SLACK)]
    kinds += [kind_of(received[c]) for c in range(1, len(sensors))]
    result = ca.vertcat(
        *kinds,
        *(exact_density(sensor, seen[c]) for c, sensor in enumerate(sensors)),
        *(turned, *(sensor.value - sensor.expected for sensor, _ in scalars)),
        *(each**2 for each in deviation),
        *(each**2 for sensor, _ in scalars for each in sensor.deviation),
        values,
        *s.samples.carried_on({**s.of, "star_BN": unit}, kinds),
        s.of["command_B"],
    )
    return pattern, generate("observe", s.arguments, [(Port("observed", (result.numel(),), "SI"), result)])


def _star_change(bank: AttitudeBank, s: _Symbols, unit: Value) -> Sensor:
    """Return the star tracker as a sensor of its own change, the rotation since its last sample, which may be none."""
    import casadi as ca

    last = s.of["last_star_BN"]
    change = 2 * quaternion.compose(unit, quaternion.inverse(last))[0:3] * ca.if_else(ca.dot(unit, last) < 0, -1, 1)
    exact = [bank.exactness * float(each) for each in bank.star_deviation]
    return Sensor(change, ca.SX.zeros(3), ca.SX.zeros(3), exact, exact, can_be_dead=False)


def _scalar(bank: AttitudeBank, s: _Symbols, part: Part) -> tuple[Sensor, Sequence[tuple[int, float]]]:
    """Return a sensor of one number, and the error states that it sees."""
    import casadi as ca

    omega, exact = s.of["omega_BN_B"], max(bank.exactness * bank.gyro_deviation, bank.gyro_resolution / 12**0.5)
    if part in GYRO:
        k = GYRO.index(part)
        expected = omega[k] + (s.of["gyro_bias_B"][k] if s.has_bias else 0)
        sees = [(3 + k, 1.0), *([(_BIAS + k, 1.0)] if s.has_bias else [])]
        value, last = s.of["gyro_B"][k], s.of["last_gyro_B"][k]
        return Sensor(value, last, expected, [bank.gyro_deviation], [exact]), sees
    if part is Part.SKEWED_GYRO:
        axis = bank.skewed_axis
        sees = [(3 + k, each) for k, each in enumerate(axis) if each != 0.0]
        value, last = s.of["skewed_gyro"], s.of["last_skewed_gyro"]
        return Sensor(value, last, ca.dot(ca.DM(axis), omega), [bank.gyro_deviation], [exact]), sees
    k = [PRESSURE[axis] for axis in s.axes].index(part)
    expected = s.of["command_B"][s.axes[k]] + s.of["torque_deviation_B"][k]
    deviation = float(bank.pressure_deviation or 0.0)
    value, last = s.of["pressure_B"][k], s.of["last_pressure_B"][k]
    return Sensor(value, last, expected, [deviation], [bank.exactness * deviation]), [(s.torque_at + k, 1.0)]


def _shift(s: _Symbols) -> GeneratedFunction:
    import casadi as ca

    error = ca.SX.sym("state", s.size)
    q = quaternion.compose(quaternion.exponential(error[0:3]), s.of["q_BN"])
    moved = [quaternion.canonical(q / ca.sqrt(ca.sumsqr(q))), s.of["omega_BN_B"] + error[3:6]]
    if s.has_bias:
        moved.append(s.of["gyro_bias_B"] + error[6:9])
    if s.axes:
        moved.append(s.of["torque_deviation_B"] + error[s.torque_at :])
    ports = [(port, s.of[port.name]) for port in s.reference_ports]
    joined = ca.vertcat(*moved)
    return generate(
        "shift",
        [*ports, (Port("state", (s.size,), "SI"), error)],
        [(Port("reference", (joined.numel(),), "SI"), joined)],
    )


def _example(bank: AttitudeBank, s: _Symbols, rng: np.random.Generator) -> dict[str, Array]:
    def turned(q_BN: Array, deviation: float) -> Array:
        return np.asarray(quaternion.compose(quaternion.exponential(deviation * rng.normal(size=3)), q_BN))

    q = quaternion.canonical(quaternion.exponential(rng.normal(size=3)))
    omega = 0.05 * rng.normal(size=3)
    found = {port.name: 0.01 * rng.normal(size=port.shape) for port in (*s.reference_ports, *s.carried_ports)}
    found |= {port.name: 0.01 * rng.normal(size=port.shape) for port in s.input_ports}
    channels = len(bank.channels)
    return found | {
        "q_BN": q,
        "omega_BN_B": omega,
        "star_BN": turned(q, 3e-4),
        "last_star_BN": turned(q, 0.05),
        "gyro_B": omega + 0.01 * rng.normal(size=3),
        "dt": np.array(bank.sample_time),
        "command_B": rng.uniform(0.0, 5.0, 3),
        "last_command_B": rng.uniform(0.0, 5.0, 3),
        # off the ends, which rounding to float could pass
        "received": rng.choice([0.1, 0.9], channels, p=[0.2, 0.8]),
        "seen": rng.choice([0.1, 0.9], channels),
    }
