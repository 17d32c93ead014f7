"""Attitude bank model: motion, sensors and change of reference of an attitude bank, symbolically."""

from functools import partial

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.attitude_bank_sensors import observed
from optsat.estimators.attitude_bank_symbols import AttitudeBankSymbols
from optsat.estimators.bank_model import BankModel, chain_over, pattern_of
from optsat.kernels.hypothesis_bank import BankStructure, Channel
from optsat.models.parts import Part
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step


def attitude_bank_model(bank: AttitudeBank) -> BankModel:
    """Return the model of a bank: error state (rotation in B, rate, gyro bias if any, torque deviations).

    The reference is moved by RK4; F = I + A T + (A T)^2 / 2 + (A T)^3 / 6, A by differentiation at the mean of the
    rates before and after. The star tracker's innovation is the rotation vector of y (x) q_BN^-1, so that it holds at
    any angle.
    """
    axes = bank.thruster_axes
    symbols = AttitudeBankSymbols(bank)
    F_pattern, predict = _predict(bank, symbols)
    H_pattern, observe = observed(bank, symbols)
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


def _predict(bank: AttitudeBank, s: AttitudeBankSymbols) -> tuple[tuple[tuple[int, int], ...], GeneratedFunction]:
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


def _shift(s: AttitudeBankSymbols) -> GeneratedFunction:
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


def _example(bank: AttitudeBank, s: AttitudeBankSymbols, rng: np.random.Generator) -> dict[str, Array]:
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
