"""Attitude bank sensors: innovations, noise and densities of star tracker, gyros and chamber pressures."""

from collections.abc import Sequence

from optsat.attitude import quaternion, rotation_vector
from optsat.attitude.backend import Value
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.attitude_bank_symbols import AttitudeBankSymbols
from optsat.estimators.bank_model import pattern_of
from optsat.estimators.bank_samples import Sensor, exact_density, kind_of
from optsat.models.parts import GYRO, PRESSURE, Part
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

_TINY = 1e-30
_NORM_SLACK = 0.1


def observed(bank: AttitudeBank, s: AttitudeBankSymbols) -> tuple[tuple[tuple[int, int], ...], GeneratedFunction]:
    """Return the places of the non-zeros of H, and the function `observe` of a bank; see `hypothesis_bank`."""
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


def _star_change(bank: AttitudeBank, s: AttitudeBankSymbols, unit: Value) -> Sensor:
    """Return the star tracker as a sensor of its own change, the rotation since its last sample, which may be none."""
    import casadi as ca

    last = s.of["last_star_BN"]
    change = 2 * quaternion.compose(unit, quaternion.inverse(last))[0:3] * ca.if_else(ca.dot(unit, last) < 0, -1, 1)
    exact = [bank.exactness * float(each) for each in bank.star_deviation]
    return Sensor(change, ca.SX.zeros(3), ca.SX.zeros(3), exact, exact, can_be_dead=False)


def _scalar(bank: AttitudeBank, s: AttitudeBankSymbols, part: Part) -> tuple[Sensor, Sequence[tuple[int, float]]]:
    """Return a sensor of one number, and the error states that it sees."""
    import casadi as ca

    omega, least = s.of["omega_BN_B"], bank.gyro_resolution / 12**0.5
    if part in GYRO:
        k = GYRO.index(part)
        expected = omega[k] + (s.of["gyro_bias_B"][k] if s.has_bias else 0)
        sees = [(3 + k, 1.0), *([(AttitudeBankSymbols.bias_at + k, 1.0)] if s.has_bias else [])]
        value, last, deviation = s.of["gyro_B"][k], s.of["last_gyro_B"][k], bank.gyro_deviations[k]
        return Sensor(value, last, expected, [deviation], [max(bank.exactness * deviation, least)]), sees
    if part is Part.SKEWED_GYRO:
        axis = bank.skewed_axis
        sees = [(3 + k, each) for k, each in enumerate(axis) if each != 0.0]
        value, last, deviation = s.of["skewed_gyro"], s.of["last_skewed_gyro"], bank.skewed_gyro_deviation
        expected = ca.dot(ca.DM(axis), omega)
        return Sensor(value, last, expected, [deviation], [max(bank.exactness * deviation, least)]), sees
    k = [PRESSURE[axis] for axis in s.axes].index(part)
    expected = s.of["command_B"][s.axes[k]] + s.of["torque_deviation_B"][k]
    value, last, deviation = s.of["pressure_B"][k], s.of["last_pressure_B"][k], float(bank.pressure_deviation or 0.0)
    return Sensor(value, last, expected, [deviation], [bank.exactness * deviation]), [(s.torque_at + k, 1.0)]
