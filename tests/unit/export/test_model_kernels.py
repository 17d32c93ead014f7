"""Model kernels: the rigid body against an adaptive integrator, field and Sun against their geometry."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.export.catalogue import build
from optsat.export.model_kernels import magnetic_field, rigid_body_step, sun
from optsat.models.earth import EQUATORIAL_RADIUS

INERTIA = np.array([[10.0, 0.5, -0.3], [0.5, 12.0, 0.8], [-0.3, 0.8, 7.0]])


def rates(_: float, x: Array, torque: Array) -> Array:
    v, s, w = x[:3], x[3], x[4:]
    spin = np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))
    return np.asarray([*(0.5 * (s * w - np.cross(w, v))), -0.5 * w @ v, *spin])


@pytest.mark.parametrize(("substeps", "atol"), [(1, 1e-4), (4, 4e-7), (16, 2e-9)])
def test_rigid_body_against_an_adaptive_integrator(substeps: int, atol: float) -> None:
    x, torque = np.array([0.1, -0.3, 0.2, np.sqrt(0.86), 0.3, -0.2, 0.5]), np.array([0.1, 0.2, -0.1])
    q, omega = rigid_body_step(INERTIA, substeps=substeps)(x[:4], x[4:], torque, 1.0)
    exact = solve_ivp(rates, (0, 1), x, args=(torque,), rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    np.testing.assert_allclose(np.concatenate((q, omega)), exact, atol=atol)
    assert np.linalg.norm(q) == pytest.approx(1, abs=1e-15)


def test_magnetic_field_is_a_dipole() -> None:
    rng = np.random.default_rng(1)
    r = rng.normal(size=(50, 3))
    r *= 7e6 / np.linalg.norm(r, axis=1, keepdims=True)
    field = magnetic_field()
    B = field.batch(1000.0, r)
    np.testing.assert_allclose(field.batch(1000.0, -r), B, rtol=1e-12)
    np.testing.assert_allclose(field.batch(1000.0, 2 * r), B / 8, rtol=1e-12)
    # B = 3 (m.u) u - m at one distance, so u.B = 2 m.u gives m
    m = np.linalg.lstsq(r / 7e6, np.einsum("ni,ni->n", B, r / 7e6) / 2, rcond=None)[0]
    u = r / 7e6
    np.testing.assert_allclose(B, 3 * (u @ m)[:, None] * u - m, atol=1e-16)
    assert np.linalg.norm(m) * (7e6 / EQUATORIAL_RADIUS) ** 3 == pytest.approx(3.12e-5, rel=1e-12)


def test_sun_at_the_equinox_and_its_shadow() -> None:
    kernel = sun("2021-03-20T09:37:00Z")
    toward, dark = kernel(0.0, [7e6, 0, 0])
    np.testing.assert_allclose(toward, [1, 0, 0], atol=3e-4)
    assert dark == 0
    assert kernel(0.0, [-7e6, 0, 0])[1] == 1
    assert kernel(0.0, [-7e6, 6.3e6, 0])[1] == 1
    assert kernel(0.0, [-7e6, 6.5e6, 0])[1] == 0


@pytest.mark.parametrize("name", ["magnetic_field", "sun"])
def test_an_epoch_that_is_no_date_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="must be an ISO 8601 date"):
        build(name, epoch="yesterday")


def test_an_impossible_inertia_is_refused() -> None:
    with pytest.raises(InputError, match="belongs to no mass distribution"):
        build("rigid_body_step", inertia_B=np.diag([1.0, 1.0, 3.0]))
