"""Rigid body: conserved quantities, closed forms, exact Jacobians, and inertias that no body has."""

import math

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.errors import InputError
from optsat.models.earth import GRAVITATIONAL_PARAMETER
from optsat.models.rigid_body import RigidBody

INERTIA = np.array([[10.0, 0.5, -0.3], [0.5, 12.0, 0.8], [-0.3, 0.8, 7.0]])
Q = np.array([0.1, -0.3, 0.2, math.sqrt(0.86)])


def complex_step_euler(omega: Array, torque: Array, direction: Array, of_torque: bool) -> Array:
    h = 1e-40j
    w, m = (omega, torque + h * direction) if of_torque else (omega + h * direction, torque)
    return np.asarray(np.linalg.solve(INERTIA, m - np.cross(w, INERTIA @ w)).imag / 1e-40, dtype=np.float64)


def test_jacobians_of_eulers_equation_against_complex_step() -> None:
    body, omega, torque = RigidBody(INERTIA), np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -1.0])
    for wrt, of_torque in (("omega_BN_B", False), ("torque_B", True)):
        expected = np.stack([complex_step_euler(omega, torque, e, of_torque) for e in np.eye(3)], axis=1)
        exact = body.omega_dot().jacobian("omega_dot_BN_B", wrt)(omega, torque)
        np.testing.assert_allclose(exact, expected, atol=1e-15)


def test_derivative_joins_kinematics_and_dynamics() -> None:
    body, omega, torque = RigidBody(INERTIA), np.array([0.3, -0.2, 0.5]), np.array([1.0, 2.0, -1.0])
    q_dot, omega_dot = body.derivative()(Q, omega, torque)
    np.testing.assert_allclose(q_dot, quaternion.derivative(Q, omega), atol=1e-16)
    np.testing.assert_allclose(omega_dot, body.omega_dot()(omega, torque), atol=1e-16)
    np.testing.assert_allclose(INERTIA @ omega_dot + np.cross(omega, INERTIA @ omega), torque, atol=1e-14)


def test_free_motion_keeps_energy_and_inertial_momentum() -> None:
    step = RigidBody(INERTIA).step(substeps=20)
    q, omega = Q, np.array([0.3, -0.2, 0.5])
    energy = omega @ INERTIA @ omega / 2
    momentum_N = dcm.from_quaternion(q).T @ INERTIA @ omega
    for _ in range(30):
        q, omega = step(q, omega, np.zeros(3), 1.0)
    assert omega @ INERTIA @ omega / 2 == pytest.approx(energy, rel=1e-9)
    np.testing.assert_allclose(dcm.from_quaternion(q).T @ INERTIA @ omega, momentum_N, rtol=1e-8)
    assert np.linalg.norm(q) == pytest.approx(1, abs=1e-15)


def test_symmetric_body_precesses_as_the_closed_form() -> None:
    step = RigidBody(np.diag([80.0, 80.0, 4.0])).step(substeps=400)
    spin = (4 - 80) / 80 * 0.3
    _, omega = step([0, 0, 0, 1], [0.1, 0.0, 0.3], np.zeros(3), 20.0)
    angle = spin * 20
    np.testing.assert_allclose(omega, [0.1 * math.cos(angle), 0.1 * math.sin(angle), 0.3], atol=1e-8)


def test_gravity_gradient_against_the_formula_and_its_symmetries() -> None:
    torque = RigidBody(INERTIA).gravity_gradient()
    r_N = np.array([5e6, -4e6, 3e6])
    r_B = dcm.from_quaternion(Q) @ r_N
    expected = 3 * GRAVITATIONAL_PARAMETER / np.linalg.norm(r_N) ** 5 * np.cross(r_B, INERTIA @ r_B)
    np.testing.assert_allclose(torque(Q, r_N), expected, rtol=1e-12)
    np.testing.assert_allclose(torque(Q, -r_N), expected, rtol=1e-12)
    assert abs(torque(Q, r_N) @ r_B) < 1e-9 * np.linalg.norm(expected) * np.linalg.norm(r_B)
    np.testing.assert_allclose(RigidBody(5 * np.eye(3)).gravity_gradient()(Q, r_N), 0, atol=1e-20)


def test_gravity_gradient_is_the_slope_of_its_potential() -> None:
    # V = 3 mu / (2 r^3) u.J u, torque . e = -dV along a turn of B about e
    torque, r_N, h = RigidBody(INERTIA).gravity_gradient(), np.array([5e6, -4e6, 3e6]), 1e-5

    def potential(q: Array) -> float:
        u = dcm.from_quaternion(q) @ r_N / np.linalg.norm(r_N)
        return float(1.5 * GRAVITATIONAL_PARAMETER / np.linalg.norm(r_N) ** 3 * u @ INERTIA @ u)

    slopes = [
        (potential(quaternion.propagate(Q, e, h)) - potential(quaternion.propagate(Q, -e, h))) / (2 * h)
        for e in np.eye(3)
    ]
    np.testing.assert_allclose(torque(Q, r_N), -np.array(slopes), rtol=1e-8)


def test_gravity_gradient_jacobian_against_differences() -> None:
    torque, r_N = RigidBody(INERTIA).gravity_gradient(), np.array([5e6, -4e6, 3e6])
    exact = torque.jacobian("torque_B", "r_N")(Q, r_N)
    differences = [(torque(Q, r_N + 10 * e) - torque(Q, r_N - 10 * e)) / 20 for e in np.eye(3)]
    np.testing.assert_allclose(exact, np.stack(differences, axis=1), rtol=1e-6, atol=1e-20)


@pytest.mark.parametrize(
    ("inertia", "words"),
    [
        (np.ones((2, 2)), r"shape \(3, 3\) \[kg m\^2\]"),
        ([[1, 0.2, 0], [0.1, 1, 0], [0, 0, 1]], "must be symmetric"),
        (np.diag([1, 1, -1]), "positive definite .* -1"),
        (np.zeros((3, 3)), "positive definite"),
        (np.diag([1, 1, 2.1]), "no mass distribution: principal moment 2.1 exceeds the sum of the others, 1 \\+ 1"),
        (np.diag([1, 1, np.inf]), "must be finite"),
    ],
)
def test_impossible_inertia_is_refused(inertia: Array, words: str) -> None:
    with pytest.raises(InputError, match=words):
        RigidBody(inertia)


def test_a_flat_plate_is_allowed_and_the_parameter_is_kept_safe() -> None:
    plate = RigidBody(np.diag([1.0, 1.0, 2.0]))
    with pytest.raises(ValueError, match="read-only"):
        np.asarray(plate.inertia_B)[0, 0] = 3.0
