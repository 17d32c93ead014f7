"""Orbits against the equation of motion, conserved quantities and a reference integration."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.models.earth import EQUATORIAL_RADIUS, GRAVITATIONAL_PARAMETER
from optsat.models.orbit import CircularOrbit, KeplerOrbit, two_body_derivative
from optsat.symbolic.integrate import rk4_step

ORBITS = [
    CircularOrbit(8e5, math.radians(75), 0.3, 1.0),
    KeplerOrbit(7.2e6, 0.0, 1.3, 0.3, 0.2, 0.1),
    KeplerOrbit(2.6e7, 0.72, math.radians(63.4), 2.0, 4.7, -2.0),
    KeplerOrbit(3e8, 0.97, 0.4, 1.0, 1.0, 3.1),
]
EACH = pytest.mark.parametrize("orbit", ORBITS, ids=["circular", "kepler-circular", "molniya", "extreme"])


@EACH
def test_two_body_integration_gives_the_same_motion(orbit: CircularOrbit | KeplerOrbit) -> None:
    motion = orbit.motion()

    def rates(_: float, state: Array) -> Array:
        r = state[:3]
        return np.concatenate((state[3:], -GRAVITATIONAL_PARAMETER * r / np.linalg.norm(r) ** 3))

    times = np.linspace(0, orbit.period / 2, 5)
    run = solve_ivp(rates, (0, times[-1]), np.concatenate(motion(0.0)), "DOP853", times, rtol=1e-12, atol=1e-6)
    r_N, v_N = motion.batch(times)
    np.testing.assert_allclose(run.y.T[:, :3], r_N, rtol=0, atol=1e-7 * np.abs(r_N).max())
    np.testing.assert_allclose(run.y.T[:, 3:], v_N, rtol=0, atol=1e-7 * np.abs(v_N).max())


@EACH
def test_energy_momentum_and_period(orbit: CircularOrbit | KeplerOrbit) -> None:
    t = np.linspace(-1.5, 1.5, 601) * orbit.period
    r_N, v_N = orbit.motion().batch(t)
    momentum = np.cross(r_N, v_N)
    distance = np.linalg.norm(r_N, axis=-1)
    energy = np.sum(v_N**2, axis=-1) / 2 - GRAVITATIONAL_PARAMETER / distance
    np.testing.assert_allclose(momentum, np.broadcast_to(momentum[0], (601, 3)), atol=1e-13 * np.abs(momentum).max())
    np.testing.assert_allclose(energy, energy[0], rtol=2e-12)
    np.testing.assert_allclose(r_N[:401], r_N[200:], atol=1e-12 * distance.max())


@EACH
def test_velocity_is_the_derivative_of_position(orbit: CircularOrbit | KeplerOrbit) -> None:
    motion, times = orbit.motion(), np.linspace(0, orbit.period, 7)
    _, v_N = motion.batch(times)
    np.testing.assert_allclose(motion.jacobian("r_N", "t").batch(times)[..., 0], v_N, rtol=1e-10, atol=1e-6)


def test_elements_say_where_the_orbit_lies() -> None:
    r_N, v_N = KeplerOrbit(1e7, 0.3, 0.5, 0.7, 0.0, 0.0).motion()(0.0)
    np.testing.assert_allclose(r_N, 7e6 * np.array([math.cos(0.7), math.sin(0.7), 0]), rtol=1e-14, atol=1e-8)
    normal = np.cross(r_N, v_N)
    expected = [math.sin(0.5) * math.sin(0.7), -math.sin(0.5) * math.cos(0.7), math.cos(0.5)]
    np.testing.assert_allclose(normal / np.linalg.norm(normal), expected, atol=1e-15)
    r_N, v_N = CircularOrbit(8e5, 0.5).motion()(0.0)
    np.testing.assert_allclose(r_N, [EQUATORIAL_RADIUS + 8e5, 0, 0])
    assert v_N[2] > 0


def test_circular_orbit_is_kepler_without_eccentricity() -> None:
    circular = CircularOrbit(8e5, 1.3, 0.4, 0.9)
    kepler = KeplerOrbit(circular.radius, 0.0, 1.3, 0.4, 0.0, 0.9)
    times = np.linspace(0, 2e4, 11)
    for one, other in zip(circular.motion().batch(times), kepler.motion().batch(times), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-6)


@pytest.mark.parametrize("eccentricity", [0.0, 0.3, 0.9, 0.97])
def test_keplers_equation_is_solved_to_rounding(eccentricity: float) -> None:
    orbit = KeplerOrbit(1e7, eccentricity, 0.0)
    M = np.concatenate((np.linspace(-np.pi, np.pi, 4001), np.logspace(-10, 0, 200), -np.logspace(-10, 0, 200)))
    r_N, _ = orbit.motion().batch(M / orbit.mean_motion)
    cosine = r_N[:, 0] / 1e7 + eccentricity
    sine = r_N[:, 1] / (1e7 * math.sqrt(1 - eccentricity**2))
    residual = np.arctan2(sine, cosine) - eccentricity * sine - M
    np.testing.assert_allclose(residual - 2 * np.pi * np.round(residual / (2 * np.pi)), 0, atol=3e-15)


def test_two_body_derivative() -> None:
    step = rk4_step(two_body_derivative(), ["r_N", "v_N"], substeps=200)
    orbit = KeplerOrbit(7.2e6, 0.05, 1.3)
    motion = orbit.motion()
    for got, expected in zip(step(*motion(0.0), orbit.period / 3), motion(orbit.period / 3), strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-8, atol=1e-4)


def test_refusals() -> None:
    with pytest.raises(InputError, match=r"`altitude` must be >= 0 \[m\], got -1"):
        CircularOrbit(-1, 0)
    with pytest.raises(InputError, match=r"`eccentricity` must be >= 0 and <= 0.97"):
        KeplerOrbit(7e6, 1.0, 0)
    with pytest.raises(InputError, match=r"`inclination` must be >= 0 and <= 3.14159 \[rad\], got 75"):
        CircularOrbit(8e5, 75)
    with pytest.raises(InputError, match=r"`semi_major_axis` must be > 0"):
        KeplerOrbit(0.0, 0.0, 0.0)
    with pytest.raises(InputError, match=r"`raan` must be finite \[rad\]"):
        CircularOrbit(8e5, 1.0, raan=math.nan)
