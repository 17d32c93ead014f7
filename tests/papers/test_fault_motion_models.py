"""The motion models of the fault-diagnosis paper against independent integration and the figures of its derivation."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.errors import InputError
from optsat.models.attitude_motion import attitude_derivative, attitude_euler_step, attitude_step
from optsat.models.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from optsat.models.gravity import EARTH_J2, gravity, translation_derivative
from optsat.models.nine_state_orbit import nine_state_derivative, nine_state_euler_step, nine_state_step
from optsat.models.orbit import two_body_derivative
from optsat.models.orbit_shape import check_orbit, orbit_shape
from optsat.models.rigid_body import RigidBody
from optsat.models.spacecraft import SEED_GRAVITATIONAL_PARAMETER as MU
from optsat.symbolic.generated_function import GeneratedFunction
from optsat.symbolic.integrate import rk4_step

R0 = np.array([6.58e6, 0.9327e6, 1.3321e6])
V0 = np.array([-1800.0, 4300.0, 6100.0])
J = np.array([[300.0, 8.0, -3.0], [8.0, 280.0, 5.0], [-3.0, 5.0, 350.0]])


def test_the_initial_orbit_is_nearly_circular() -> None:
    shape = check_orbit(R0, V0, MU)
    assert math.degrees(shape.flight_path_angle) == pytest.approx(0.32, abs=0.05)
    assert shape.eccentricity == pytest.approx(0.006, abs=5e-4)
    assert math.degrees(shape.inclination) == pytest.approx(54.8, abs=0.1)
    assert np.linalg.norm(R0) == pytest.approx(6.778e6, rel=1e-4)


def test_the_printed_sign_leads_into_the_earth() -> None:
    v_N = V0 * [-1.0, 1.0, 1.0]
    shape = orbit_shape(R0, v_N, MU)
    assert math.degrees(shape.flight_path_angle) == pytest.approx(27.5, abs=0.1)
    assert shape.eccentricity == pytest.approx(0.46, abs=0.005)
    with pytest.raises(InputError, match=r"`v_N` leads into the Earth: flight-path angle 27.44 deg.*Check the signs"):
        check_orbit(R0, v_N, MU)


def test_gravitational_parameters_differ_by_half_a_millimetre() -> None:
    assert abs(MU / 3.985744e14 - 1) < 1e-6
    difference = abs(MU - GRAVITATIONAL_PARAMETER) / float(R0 @ R0)
    assert difference == pytest.approx(0.57e-3, abs=5e-6)


def test_jerk_is_the_rate_of_gravity_along_the_motion() -> None:
    field, rates = gravity(MU), nine_state_derivative(MU)
    h = 0.5
    along = (field(R0 + h * V0) - field(R0 - h * V0)) / (2 * h)
    r_dot, v_dot, a_dot = rates(R0, V0, np.array([1.0, 2.0, 3.0]))
    np.testing.assert_array_equal(r_dot, V0)
    np.testing.assert_array_equal(v_dot, [1.0, 2.0, 3.0])
    np.testing.assert_allclose(a_dot, along, rtol=1e-6)
    distance = np.linalg.norm(R0)
    misread = MU * (3 * np.linalg.norm(V0) * distance * R0 / distance**5 - V0 / distance**3)
    assert np.abs(misread - along).max() > 0.5 * np.abs(along).max()


def test_gravity_without_oblateness_is_the_two_body_model() -> None:
    np.testing.assert_array_equal(gravity(MU)(R0), two_body_derivative(MU)(R0, V0)[1])


def test_oblate_gravity_is_the_gradient_of_its_potential() -> None:
    def potential(r: Array) -> float:
        distance = float(np.linalg.norm(r))
        legendre = 1.5 * (r[2] / distance) ** 2 - 0.5
        return float(MU / distance * (1 - EARTH_J2 * (EQUATORIAL_RADIUS / distance) ** 2 * legendre))

    steps = 10.0 * np.eye(3)
    gradient = [(potential(R0 + step) - potential(R0 - step)) / 20.0 for step in steps]
    np.testing.assert_allclose(gravity(MU, EARTH_J2)(R0), gradient, rtol=1e-7)


@pytest.mark.parametrize("j2", [0.0, EARTH_J2])
def test_translation_against_an_adaptive_integrator(j2: float) -> None:
    field, force = gravity(MU, j2), np.array([1e-3, -2e-3, 5e-4])

    def rates(_: float, x: Array) -> Array:
        return np.concatenate((x[3:], field(x[:3]) + force))

    reference = solve_ivp(rates, (0, 60), np.concatenate((R0, V0)), "DOP853", rtol=1e-13, atol=1e-9).y[:, -1]
    r, v = R0, V0
    step = rk4_step(translation_derivative(field), ("r_N", "v_N"))
    for _ in range(60):
        r, v = step(r, v, force, 1.0)
    np.testing.assert_allclose(np.concatenate((r, v)), reference, rtol=0, atol=1e-4)


def marched(step: GeneratedFunction, dt: float) -> Array:
    r, v, a = R0, V0, gravity(MU)(R0)
    for _ in range(round(60 / dt)):
        r, v, a = step(r, v, a, dt)
    return np.concatenate((r, v, a))


def test_nine_states_by_runge_kutta_and_the_error_of_euler() -> None:
    def rates(_: float, x: Array) -> Array:
        return np.concatenate((x[3:], -MU * x[:3] / np.linalg.norm(x[:3]) ** 3))

    truth = solve_ivp(rates, (0, 60), np.concatenate((R0, V0)), "DOP853", rtol=1e-13, atol=1e-9).y[:, -1]
    fine = marched(nine_state_step(MU), 0.5)
    np.testing.assert_allclose(fine[:6], truth, rtol=0, atol=2e-5)
    np.testing.assert_allclose(fine[6:], gravity(MU)(truth[:3]), rtol=1e-10)
    coarse = marched(nine_state_euler_step(MU), 0.1)
    # about a T t / 2, beside 10 m of GPS noise
    assert np.linalg.norm(coarse[:3] - truth[:3]) == pytest.approx(26.0, abs=0.1)
    halved = marched(nine_state_euler_step(MU), 0.05)
    ratio = np.linalg.norm(coarse[:3] - truth[:3]) / np.linalg.norm(halved[:3] - truth[:3])
    assert ratio == pytest.approx(2.0, abs=0.01)


def test_attitude_rates_are_those_of_the_rigid_body() -> None:
    q, w, torque = quaternion.identity(), np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -3.0])
    mine, its = attitude_derivative()(q, w, torque, J), RigidBody(J).derivative()(q, w, torque)
    np.testing.assert_allclose(mine[0], its[0], atol=1e-16)
    np.testing.assert_allclose(mine[1], its[1], atol=1e-16)


def attitude_after(step: GeneratedFunction, dt: float, count: int) -> tuple[Array, Array]:
    q, w = quaternion.identity(), np.array([0.3, -0.2, 0.5])
    for _ in range(count):
        q, w = step(q, w, np.array([1.0, 2.0, -3.0]), J, dt)
    return q, w


def test_attitude_against_an_adaptive_integrator() -> None:
    def rates(_: float, x: Array) -> Array:
        w = x[4:]
        q = x[:4]
        vector = 0.5 * (q[3] * w - np.cross(w, q[:3]))
        spin = np.linalg.solve(J, np.array([1.0, 2.0, -3.0]) - np.cross(w, J @ w))
        return np.asarray(np.concatenate((vector, [-0.5 * w @ q[:3]], spin)), dtype=np.float64)

    start = np.concatenate((quaternion.identity(), [0.3, -0.2, 0.5]))
    reference = solve_ivp(rates, (0, 10), start, "DOP853", rtol=1e-13, atol=1e-13).y[:, -1]
    q, w = attitude_after(attitude_step(), 0.05, 200)
    np.testing.assert_allclose(w, reference[4:], atol=1e-9)
    assert quaternion.error_angle(q, reference[:4] / np.linalg.norm(reference[:4])) < 1e-8
    errors = [
        float(quaternion.error_angle(attitude_after(attitude_euler_step(), dt, count)[0], q))
        for dt, count in ((0.01, 1000), (0.005, 2000))
    ]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.05)


def test_euler_lengthens_the_quaternion() -> None:
    q, _ = attitude_after(attitude_euler_step(renormalise=False), 0.1, 1)
    speed = np.linalg.norm([0.3, -0.2, 0.5])
    assert np.linalg.norm(q) == pytest.approx(math.sqrt(1 + (speed * 0.05) ** 2), rel=1e-15)
    q, _ = attitude_after(attitude_euler_step(), 0.1, 1)
    assert np.linalg.norm(q) == pytest.approx(1.0, rel=1e-15)


def test_orbit_shape_refuses_what_is_no_orbit() -> None:
    with pytest.raises(InputError, match="`v_N` is the zero vector"):
        orbit_shape(R0, np.zeros(3))
    radial = orbit_shape(R0, R0 / 1e4)
    assert (radial.inclination, radial.perigee_radius) == (0.0, 0.0)
