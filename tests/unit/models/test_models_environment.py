"""Epoch, Earth rotation, magnetic field and Sun against published and independent values."""

import math

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.models.earth import EQUATORIAL_RADIUS, sidereal_angle
from optsat.models.epoch import Epoch
from optsat.models.magnetic_field import TiltedDipole
from optsat.models.sun import Sun

EQUINOX = Epoch(2459294.0)
POLE_E = np.array(
    [
        math.cos(math.radians(80.4)) * math.cos(math.radians(-72.7)),
        math.cos(math.radians(80.4)) * math.sin(math.radians(-72.7)),
        math.sin(math.radians(80.4)),
    ]
)


def test_epoch_from_text_and_from_julian_date() -> None:
    assert Epoch.from_utc("2021-03-20T12:00:00").days_since_j2000 == EQUINOX.days_since_j2000 == 7749
    assert Epoch.from_utc("2021-03-20T14:00:00+02:00") == Epoch.from_utc("2021-03-20T12:00:00")
    assert Epoch.from_julian_date(2459475.5) == Epoch(2459475.0, 0.5)
    assert Epoch.from_utc("2000-01-01T12:00:00").days_since_j2000 == 0
    with pytest.raises(InputError, match="ISO 8601"):
        Epoch.from_utc("yesterday")
    with pytest.raises(InputError, match="whole or half number"):
        Epoch(2459294.3)


def test_sidereal_time_of_the_textbook() -> None:
    # Meeus, Astronomical Algorithms, examples 12.a and 12.b: 1987 April 10, 0 h and 19:21:00 UT
    assert math.degrees(sidereal_angle(Epoch(2446895.5), 0.0)) % 360 == pytest.approx(197.693195, abs=1e-5)
    evening = math.degrees(sidereal_angle(Epoch.from_utc("1987-04-10T19:21:00"), 0.0)) % 360
    assert evening == pytest.approx(128.7378734, abs=1e-5)


def test_sidereal_angle_does_not_depend_on_how_the_instant_is_split() -> None:
    splits = [(Epoch(2459294.0, 0.25), 0.0), (Epoch(2459294.0), 21600.0), (Epoch(2459293.5, 0.75), 0.0)]
    angles = np.array([sidereal_angle(epoch, t) for epoch, t in splits])
    differences = np.angle(np.exp(1j * (angles - angles[0])))
    np.testing.assert_allclose(differences, 0, atol=1e-12)


def inertial(earth_fixed: Array, t: float) -> Array:
    angle = math.radians(280.46061837 + 360.98564736629 * (7749 + t / 86400))
    c, s = math.cos(angle), math.sin(angle)
    return np.asarray(np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ earth_fixed)


@pytest.mark.parametrize("t", [0.0, 1234.5, 80000.0])
def test_field_points_down_at_the_north_pole_and_north_at_the_equator(t: float) -> None:
    pole = inertial(POLE_E, t)
    dipole = TiltedDipole(EQUINOX)
    above = dipole.field()(t, EQUATORIAL_RADIUS * pole)
    np.testing.assert_allclose(above, -2 * 3.12e-5 * pole, atol=1e-13)
    across = np.cross(pole, [1, 0, 0])
    level = dipole.field()(t, 2 * EQUATORIAL_RADIUS * across / np.linalg.norm(across))
    np.testing.assert_allclose(level, 3.12e-5 / 8 * pole, atol=1e-13)


def test_direction_is_the_unit_field() -> None:
    dipole = TiltedDipole(EQUINOX)
    r_N = 7e6 * np.random.default_rng(1).normal(size=(20, 3))
    field = dipole.field().batch(100.0, r_N)
    direction = dipole.direction().batch(100.0, r_N)
    np.testing.assert_allclose(direction, field / np.linalg.norm(field, axis=-1, keepdims=True), atol=1e-15)


def test_field_is_the_gradient_of_the_dipole_potential() -> None:
    # outside the Earth div B = 0 and curl B = 0: the Jacobian is symmetric and without trace
    jacobian = TiltedDipole(EQUINOX).field().jacobian("field_N", "r_N")(50.0, [5e6, -4e6, 3e6])
    size = np.abs(jacobian).max()
    np.testing.assert_allclose(jacobian, jacobian.T, atol=1e-14 * size)
    assert abs(np.trace(jacobian)) < 1e-14 * size


def test_sun_at_equinox_solstice_and_textbook_date() -> None:
    # March equinox 2021-03-20 09:37 UTC, June solstice 2021-06-21 03:32 UTC
    assert np.linalg.norm(Sun(Epoch.from_utc("2021-03-20T09:37:00")).direction()(0.0) - [1, 0, 0]) < 3e-4
    solstice = Sun(Epoch.from_utc("2021-06-21T03:32:00")).direction()(0.0)
    obliquity = math.radians(23.4365)
    assert np.linalg.norm(solstice - [0, math.cos(obliquity), math.sin(obliquity)]) < 3e-4
    # Vallado, example 5-1: 2006 April 2, 0 h: (0.9771945, 0.1924424, 0.0834308) au
    expected = np.array([0.9771945, 0.1924424, 0.0834308])
    sun_N = Sun(Epoch.from_utc("2006-04-02T00:00:00")).direction()(0.0)
    np.testing.assert_allclose(sun_N, expected / np.linalg.norm(expected), atol=2e-6)


def test_sun_moves_about_one_degree_a_day_and_stays_unit() -> None:
    direction = Sun(EQUINOX).direction()
    days = direction.batch(86400.0 * np.arange(366))
    np.testing.assert_allclose(np.linalg.norm(days, axis=-1), 1, atol=1e-15)
    step = np.degrees(np.linalg.norm(np.diff(days, axis=0), axis=-1))
    assert 0.95 < step.min() < step.max() < 1.03
    rate = direction.jacobian("sun_N", "t")(0.0)[:, 0]
    np.testing.assert_allclose(rate, (direction(500.0) - direction(-500.0)) / 1000, atol=1e-13)


def test_shadow_is_a_cylinder_behind_the_earth() -> None:
    sun = Sun(EQUINOX)
    eclipse, sun_N = sun.eclipse(), sun.direction()(0.0)
    side = np.cross(sun_N, [0, 0, 1])
    side /= np.linalg.norm(side)
    behind = -3e7 * sun_N
    places = [behind, behind + 0.999 * EQUATORIAL_RADIUS * side, behind + 1.001 * EQUATORIAL_RADIUS * side, -behind]
    assert eclipse.batch(0.0, np.array(places)).tolist() == [1, 1, 0, 0]


def test_parameters_are_checked() -> None:
    with pytest.raises(InputError, match=r"`pole_latitude` must be >= -1.5708 and <= 1.5708 \[rad\], got 80.4"):
        TiltedDipole(EQUINOX, pole_latitude=80.4)
    with pytest.raises(InputError, match=r"`equatorial_field` must be > 0 \[T\]"):
        TiltedDipole(EQUINOX, equatorial_field=0.0)
