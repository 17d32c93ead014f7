"""Translation bank model: motion, sensors and change of reference of a translation bank, symbolically."""

from functools import partial
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.backend import Value
from optsat.estimators.bank_model import BankModel, chain_over, pattern_of
from optsat.estimators.bank_samples import BankSamples, Device, Sensor, exact_density, kind_of
from optsat.estimators.translation_bank import TranslationBank
from optsat.kernels.hypothesis_bank import BankStructure, Channel
from optsat.models.accelerometer import Axes, Sensed
from optsat.models.gravity import gravity, translation_derivative
from optsat.models.parts import ACCELEROMETER, Part
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step

SAMPLES = BankSamples(
    (Device(Port("gps_N", (3,), "m"), 3, (Part.GPS,)), Device(Port("accelerometer", (3,), "m/s^2"), 1, ACCELEROMETER))
)
_REFERENCE = (Port("r_N", (3,), "m"), Port("v_N", (3,), "m/s"))
_FORCE = Port("specific_force_B", (3,), "m/s^2")
_EXAMPLE_PLACE, _EXAMPLE_VELOCITY = (6.58e6, 0.9327e6, 1.3321e6), (-1800.0, 4300.0, 6100.0)


def translation_bank_model(bank: TranslationBank) -> BankModel:
    """Return the model of a bank: error state (position, velocity) in N, moved as the reference by RK4.

    F = I + A T + (A T)^2 / 2 + (A T)^3 / 6, A by differentiation of gravity at the mean of the positions before and
    after. Known specific force in B is an input, turned by the attitude q_BN that is one too.
    """
    step = Port("dt", (), "s", lower=0.0, upper=1e3 * bank.sample_time, safe=bank.sample_time)
    inputs = (_FORCE, QUATERNION, step, *SAMPLES.input_ports)
    arguments = [(port, _symbol(port)) for port in (*_REFERENCE, *SAMPLES.carried_ports, *inputs)]
    F_pattern, predict = _predict(bank, arguments)
    H_pattern, observe = _observe(bank, arguments)
    errors = [bank.gps_error, *[bank.accelerometer_error] * 3]
    structure = BankStructure(
        states=6,
        bits=len(bank.bits),
        channels=tuple(
            Channel(3 if part is Part.GPS else 1, bank.bit_of(part), error)
            for part, error in zip(SAMPLES.channels, errors, strict=True)
        ),
        actuated=(),
        F_pattern=F_pattern,
        H_pattern=H_pattern,
    )
    return BankModel(
        structure=structure,
        predict=predict,
        observe=observe,
        shift=_shift(),
        reference=_REFERENCE,
        carried=SAMPLES.carried_ports,
        inputs=inputs,
        samples=SAMPLES,
        faults=bank.bits,
        states=(*(f"position_{each} [m]" for each in "xyz"), *(f"velocity_{each} [m/s]" for each in "xyz")),
        spread=(*[bank.position_prior] * 3, *[bank.velocity_prior] * 3),
        sample_time=bank.sample_time,
        example=partial(_example, bank),
    )


def _symbol(port: Port) -> Value:
    import casadi as ca

    return ca.SX.sym(port.name, port.rows, port.columns)


def _of(arguments: list[tuple[Port, Value]]) -> dict[str, Any]:
    return {port.name: symbol for port, symbol in arguments}


def _predict(
    bank: TranslationBank, arguments: list[tuple[Port, Value]]
) -> tuple[tuple[tuple[int, int], ...], GeneratedFunction]:
    import casadi as ca

    of = _of(arguments)
    field = gravity(bank.gravitational_parameter, bank.j2)
    force_N = quaternion.transform(quaternion.inverse(of["q_BN"]), of["specific_force_B"])
    move = rk4_step(translation_derivative(field), ("r_N", "v_N"))
    r_N, v_N = move.casadi.call([of["r_N"], of["v_N"], force_N, of["dt"]])

    at = ca.SX.sym("at", 3)
    gradient = ca.substitute(ca.jacobian(field.casadi.call([at])[0], at), at, 0.5 * (of["r_N"] + r_N))
    A = ca.SX(6, 6)
    A[0:3, 3:6] = ca.SX.eye(3)
    A[3:6, 0:3] = gradient
    AT = ca.sparsify(A) * of["dt"]
    pattern, values = pattern_of(ca.sparsify(ca.SX.eye(6) + AT + AT @ AT / 2 + AT @ AT @ AT / 6))

    steps = of["dt"] / bank.sample_time
    noise = ca.DM([0.0] * 3 + [bank.velocity_noise**2] * 3) * steps
    chances = [chance for _ in bank.bits for chance in chain_over(*bank.chance, steps)]
    result = ca.vertcat(r_N, v_N, values, noise, *chances)
    return pattern, generate("predict", arguments, [(Port("predicted", (result.numel(),), "SI"), result)])


def _observe(
    bank: TranslationBank, arguments: list[tuple[Port, Value]]
) -> tuple[tuple[tuple[int, int], ...], GeneratedFunction]:
    import casadi as ca

    of = _of(arguments)
    turn = dcm.from_quaternion(of["q_BN"]) if bank.axes is Axes.BODY else ca.SX.eye(3)
    field, at = gravity(bank.gravitational_parameter, bank.j2), ca.SX.sym("at", 3)
    gradient = ca.substitute(ca.jacobian(field.casadi.call([at])[0], at), at, of["r_N"])
    gravity_N = field.casadi.call([of["r_N"]])[0]
    force_B = of["specific_force_B"]
    force = force_B if bank.axes is Axes.BODY else quaternion.transform(quaternion.inverse(of["q_BN"]), force_B)
    is_total = bank.sensed is Sensed.TOTAL
    expected = force + turn @ gravity_N if is_total else force
    H = ca.SX(6, 6)
    H[0:3, 0:3] = ca.SX.eye(3)
    if is_total:
        H[3:6, 0:3] = turn @ gradient
    pattern, values = pattern_of(ca.sparsify(H))

    # of gravity turned by a wrong attitude, a part stands across
    turned = bank.pointing_deviation if is_total and bank.axes is Axes.BODY else 0.0
    accelerometer = bank.accelerometer_deviation
    exact = [bank.exactness * bank.gps_deviation] * 3
    gps = Sensor(of["gps_N"], of["last_gps_N"], of["r_N"], [bank.gps_deviation] * 3, exact)
    axes = [
        Sensor(
            of["accelerometer"][k],
            of["last_accelerometer"][k],
            expected[k],
            [accelerometer],
            [bank.exactness * accelerometer],
        )
        for k in range(3)
    ]
    sensors = [gps, *axes]
    kinds = [kind_of(of["received"][c]) for c in range(4)]
    result = ca.vertcat(
        *kinds,
        *(exact_density(sensor, of["seen"][c]) for c, sensor in enumerate(sensors)),
        *(sensor.value - sensor.expected for sensor in sensors),
        *([bank.gps_deviation**2] * 3),
        *(accelerometer**2 + turned**2 * (ca.sumsqr(gravity_N) - (turn @ gravity_N)[k] ** 2) for k in range(3)),
        values,
        *SAMPLES.carried_on(of, kinds),
    )
    return pattern, generate("observe", arguments, [(Port("observed", (result.numel(),), "SI"), result)])


def _shift() -> GeneratedFunction:
    import casadi as ca

    r_N, v_N, error = ca.SX.sym("r_N", 3), ca.SX.sym("v_N", 3), ca.SX.sym("state", 6)
    return generate(
        "shift",
        [(_REFERENCE[0], r_N), (_REFERENCE[1], v_N), (Port("state", (6,), "SI"), error)],
        [(Port("reference", (6,), "SI"), ca.vertcat(r_N + error[0:3], v_N + error[3:6]))],
    )


def _example(bank: TranslationBank, rng: np.random.Generator) -> dict[str, Array]:
    place, q = np.array(_EXAMPLE_PLACE), quaternion.canonical(quaternion.exponential(rng.normal(size=3)))
    pull = -bank.gravitational_parameter * place / np.linalg.norm(place) ** 3
    seen = pull if bank.axes is Axes.INERTIAL else quaternion.transform(q, pull)
    noise = bank.accelerometer_deviation * rng.normal(size=3)
    return {
        "r_N": place,
        "v_N": np.array(_EXAMPLE_VELOCITY),
        "last_gps_N": place + 10.0 * rng.normal(size=3),
        "last_accelerometer": 10.0 * rng.normal(size=3),
        "seen": rng.choice([0.1, 0.9], 4),
        "specific_force_B": np.zeros(3),
        "q_BN": q,
        "dt": np.array(bank.sample_time),
        "gps_N": place + bank.gps_deviation * rng.normal(size=3),
        "accelerometer": noise + (seen if bank.sensed is Sensed.TOTAL else 0.0),
        "received": rng.choice([0.1, 0.9], 4, p=[0.2, 0.8]),
    }
