"""Linear discrete models: of one axis, and of symbolic functions near an operating point."""

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from optsat.errors import InputError
from optsat.estimators.isolability import AdditiveFault, isolability
from optsat.models.linear_discrete import LinearDiscreteModel, LinearSensor, linear_model
from optsat.models.single_axis import single_axis
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate
from optsat.symbolic.integrate import rk4_step

INERTIA = np.array([300.0, 280.0, 350.0])
THETA, OMEGA = Port("theta_BN", (3,), "rad"), Port("omega_BN_B", (3,), "rad/s")
TORQUE = Port("torque_B", (3,), "N m")


def euler() -> GeneratedFunction:
    """Small rotation, rate in body components, gyroscopic coupling: the error state of the joint bank."""
    theta, omega, torque = (ca.SX.sym(port.name, 3) for port in (THETA, OMEGA, TORQUE))
    rate = (torque - ca.cross(omega, INERTIA * omega)) / INERTIA
    return generate(
        "euler",
        [(THETA, theta), (OMEGA, omega), (TORQUE, torque)],
        [
            (Port("theta_dot", (3,), "rad/s"), omega - ca.cross(omega, theta)),
            (Port("omega_dot", (3,), "rad/s^2"), rate),
        ],
    )


def sensors() -> GeneratedFunction:
    theta, omega, torque = (ca.SX.sym(port.name, 3) for port in (THETA, OMEGA, TORQUE))
    return generate(
        "sensors",
        [(OMEGA, omega), (TORQUE, torque), (THETA, theta)],
        [
            (Port("star", (3,), "rad"), theta),
            (Port("gyro", (3,), "rad/s"), omega),
            (Port("chamber", (), "N m"), torque[2]),
        ],
    )


SIGMA = {"star": [1e-3, 1.3e-3, 1.24e-3], "gyro": 0.01, "chamber": 0.5}


def spacecraft(omega: Any, **changed: Any) -> LinearDiscreteModel:
    at = {"theta_BN": np.zeros(3), "omega_BN_B": omega, "torque_B": np.zeros(3), "dt": 0.1}
    options: dict[str, Any] = {"Q": np.diag([0, 0, 0, 1e-6, 1e-6, 1e-6]), "sigma": SIGMA, "at": at} | changed
    return linear_model(
        rk4_step(euler(), ["theta_BN", "omega_BN_B"]),
        sensors(),
        states=["theta_BN", "omega_BN_B"],
        inputs=["torque_B"],
        dt=0.1,
        **options,
    )


def flow(x: Any, torque: Any) -> Any:
    """State after 0.1 s, by an integrator that chooses its own steps."""

    def rate(_t: float, state: Any) -> Any:
        theta, omega = state[:3], state[3:]
        spin = (torque - np.cross(omega, INERTIA * omega)) / INERTIA
        return np.concatenate([omega - np.cross(omega, theta), spin])

    return solve_ivp(rate, (0.0, 0.1), x, rtol=1e-12, atol=1e-13).y[:, -1]


def test_matrices_are_the_slopes_of_the_flow() -> None:
    x, h = np.array([0, 0, 0, 0.5, 0.6, 0.2]), 1e-3
    model = spacecraft(x[3:])
    A = np.array([(flow(x + h * e, np.zeros(3)) - flow(x - h * e, np.zeros(3))) / (2 * h) for e in np.eye(6)]).T
    B = np.array([(flow(x, e) - flow(x, -e)) / 2 for e in np.eye(3)]).T
    np.testing.assert_allclose(np.asarray(model.A), A, atol=1e-7)
    np.testing.assert_allclose(np.asarray(model.B), B, atol=1e-8)


def test_a_system_without_inputs() -> None:
    x = ca.SX.sym("x", 1)
    decay = generate("decay", [(Port("x", (1,), "-"), x)], [(Port("next", (1,), "-"), 0.5 * x)])
    seen = generate("seen", [(Port("x", (1,), "-"), x)], [(Port("y", (), "-"), x[0] ** 2)])
    model = linear_model(decay, seen, {"x": [3.0]}, states=["x"], inputs=[], Q=[[0.0]], sigma={"y": 2.0}, dt=1.0)
    assert (model.inputs, np.asarray(model.B).shape, model.C.tolist()) == ((), (1, 0), [[6.0]])


def test_channels_are_named_by_entry() -> None:
    model = spacecraft(np.zeros(3))
    assert model.inputs == ("torque_B[0]", "torque_B[1]", "torque_B[2]")
    names = [sensor.name for sensor in model.sensors]
    assert names == ["star[0]", "star[1]", "star[2]", "gyro[0]", "gyro[1]", "gyro[2]", "chamber"]
    np.testing.assert_array_equal(model.C, np.vstack([np.eye(6), np.zeros(6)]))
    np.testing.assert_array_equal(model.D, np.vstack([np.zeros((6, 3)), [0, 0, 1]]))
    np.testing.assert_array_equal(model.sigma, [1e-3, 1.3e-3, 1.24e-3, 0.01, 0.01, 0.01, 0.5])


def test_an_axis_of_the_body_at_rest_is_the_single_axis() -> None:
    body = spacecraft(np.zeros(3), sigma=SIGMA | {"star": 2 * np.sqrt(3.85e-7)})
    faults = [
        AdditiveFault("torque", {"torque_B[2]": 3.0}),
        AdditiveFault("gyro", {"gyro[2]": 0.3}),
        AdditiveFault("star", {"star[2]": 0.01}),
    ]
    axis = [
        AdditiveFault(f.name, {n: s})
        for f, n, s in zip(faults, ("torque", "gyro", "star"), (3, 0.3, 0.01), strict=True)
    ]
    of_body = isolability(body, faults, 3.0)
    of_axis = isolability(single_axis(("star", "gyro", "pressure")), axis, 3.0)
    np.testing.assert_allclose(of_body.distinguishability, of_axis.distinguishability, rtol=1e-7)
    np.testing.assert_allclose(of_body.detection, of_axis.detection, rtol=1e-7)


def test_without_star_gyro_and_torque_of_an_axis_are_one_group_at_rest_and_nearly_so_when_tumbling() -> None:
    faults = [AdditiveFault(name, {name: 1.0}) for name in ("torque_B[0]", "torque_B[2]", "gyro[0]", "gyro[2]")]
    groups = (("torque_B[0]", "gyro[0]"), ("torque_B[2]", "gyro[2]"))
    assert isolability(gyros_only(np.zeros(3)), faults, 3.0).groups() == groups
    tumbling = isolability(gyros_only([0.05, 0.06, 0.02]), faults, 3.0)
    # gyroscopic coupling shows a true rate in the other gyros, far below what a decision needs
    assert not tumbling.indistinguishable.any()
    assert 0 < tumbling.distinguishability[0, 2] < 0.1


def gyros_only(omega: Any) -> LinearDiscreteModel:
    model = spacecraft(omega)
    return replace(model, sensors=tuple(sensor for sensor in model.sensors if sensor.name.startswith("gyro")))


def test_missing_values_are_named() -> None:
    with pytest.raises(InputError, match=r"`at` lacks `omega_BN_B`, `torque_B`: euler"):
        spacecraft(np.zeros(3), at={"theta_BN": np.zeros(3), "dt": 0.1})
    with pytest.raises(InputError, match=r"`sigma` lacks the output `chamber` \[N m\]"):
        spacecraft(np.zeros(3), sigma={"star": 1.0, "gyro": 1.0})
    with pytest.raises(InputError, match=r"must be a number or \(3,\) \[rad/s\], got \(2,\)"):
        spacecraft(np.zeros(3), sigma=SIGMA | {"gyro": [1.0, 1.0]})


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"A": np.eye(3)[:2]}, "`A` must have shape"),
        ({"B": np.eye(2)}, "`B` must have shape"),
        ({"Q": [[1.0, 0.1], [0.0, 1.0]]}, "`Q` must be symmetric, its halves differ by 0.1"),
        ({"Q": [[1.0, 0.0], [0.0, -1.0]]}, "positive semi-definite, its least eigenvalue is -1"),
        ({"dt": 0.0}, "`dt` must be above 0 s"),
        ({"sensors": ()}, "`sensors` is empty"),
        ({"sensors": (LinearSensor("s", [1.0], 1.0),)}, r"`s.H` must have shape"),
        ({"sensors": (LinearSensor("s", [1.0, 0.0], 1.0, [1.0, 2.0]),)}, r"`s.D` must have shape"),
        ({"sensors": (LinearSensor("u", [1.0, 0.0], 1.0),)}, "`u` names 2 inputs or sensors"),
    ],
)
def test_bad_models(changed: dict[str, Any], message: str) -> None:
    good: dict[str, Any] = {
        "A": np.eye(2),
        "B": [[0.0], [1.0]],
        "Q": np.zeros((2, 2)),
        "inputs": ("u",),
        "sensors": (LinearSensor("s", [1.0, 0.0], 1.0),),
        "dt": 1.0,
    }
    LinearDiscreteModel(**good)
    with pytest.raises(InputError, match=message):
        LinearDiscreteModel(**good | changed)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1.0], 0.0), "sensor `s`: sigma must be above 0, got 0"),
        (([1.0], 1.0, None, -1.0), "sensor `s`: cost must not be negative, got -1"),
        (([np.nan], 1.0), "`s.H` must be finite"),
    ],
)
def test_bad_sensors(arguments: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        LinearSensor("s", *arguments)


def test_bad_axes() -> None:
    with pytest.raises(InputError, match=r"one axis has no sensor `gyr`\. Did you mean `gyro`"):
        single_axis(("gyr",))
    with pytest.raises(InputError, match="`inertia` must be above 0 kg m\\^2, got -1"):
        single_axis(inertia=-1.0)
