"""Attitude filters of seven states: a dense NumPy reference, filterpy, statistics, single precision."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal
from single_precision import SinglePrecision

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.estimators.attitude_filter import attitude_filter_model, extended_filter_7, unscented_filter_7
from optsat.estimators.filter_model import FilterModel
from optsat.estimators.unscented import SigmaPoints, unscented_step
from optsat.export.catalogue import build
from optsat.symbolic.generated_function import GeneratedFunction

INERTIA = np.array([[10.0, 0.5, -0.3], [0.5, 12.0, 0.8], [-0.3, 0.8, 7.0]])
Q = np.array([1e-10] * 4 + [1e-8] * 3)
R = np.array([1e-6] * 4 + [1e-5] * 3)
DT = 0.5


def rates(x: Any, torque: Array) -> Any:
    """q_dot = 1/2 [omega; 0] (x) q written out, and Euler's equation; complex numbers pass through."""
    v, s, w = x[:3], x[3], x[4:]
    q_dot = 0.5 * np.array([*(s * w - np.cross(w, v)), -np.dot(w, v)])
    return np.concatenate((q_dot, np.linalg.solve(INERTIA, torque - np.cross(w, INERTIA @ w))))


def moved(x: Any, torque: Array) -> Any:
    k1 = rates(x, torque)
    k2 = rates(x + DT / 2 * k1, torque)
    k3 = rates(x + DT / 2 * k2, torque)
    k4 = rates(x + DT * k3, torque)
    return scaled(x + DT / 6 * (k1 + 2 * k2 + 2 * k3 + k4))


def scaled(x: Any) -> Any:
    x = np.array(x)
    x[:4] = x[:4] / np.sqrt(np.sum(x[:4] * x[:4]))
    return x


def updated(x: Array, P: Array, cross: Array, S: Array, innovation: Array) -> tuple[Any, ...]:
    K = np.linalg.solve(S, cross.T).T
    likelihood = multivariate_normal.logpdf(innovation, cov=S)
    return scaled(x + K @ innovation), P - K @ S @ K.T, innovation, S, likelihood


def extended(x: Array, P: Array, torque: Array, z: Array) -> tuple[Any, ...]:
    step = 1e-30
    F = np.stack([moved(x + 1j * step * e, torque).imag / step for e in np.eye(7)], axis=1)
    x, P = moved(x, torque), F @ P @ F.T + np.diag(Q)
    return updated(x, P, P, P + np.diag(R), z - x)


def sigma_points(x: Array, P: Array, alpha: float, kappa: float) -> tuple[Array, Array, Array]:
    """Points as rows and the weights of means and covariances, beta = 2, as van der Merwe prints them."""
    n = len(x)
    lam = alpha**2 * (n + kappa) - n
    L = np.linalg.cholesky((n + lam) * P).T
    mean = np.full(2 * n + 1, 0.5 / (n + lam))
    covariance = mean.copy()
    mean[0], covariance[0] = lam / (n + lam), lam / (n + lam) + 1 - alpha**2 + 2
    return np.vstack((x, x + L, x - L)), mean, covariance


def unscented(x: Array, P: Array, torque: Array, z: Array, alpha: float = 1.0, kappa: float = 0.0) -> tuple[Any, ...]:
    points, mean, weight = sigma_points(x, P, alpha, kappa)
    images = np.stack([moved(point, torque) for point in points])
    average = mean @ images
    P = (images - average).T @ np.diag(weight) @ (images - average) + np.diag(Q)
    x = scaled(average)
    points, mean, weight = sigma_points(x, P, alpha, kappa)
    expected = mean @ points
    S = (points - expected).T @ np.diag(weight) @ (points - expected) + np.diag(R)
    cross = (points - x).T @ np.diag(weight) @ (points - expected)
    return updated(x, P, cross, S, z - expected)


def start() -> tuple[Array, Array]:
    x = np.array([0.1, -0.3, 0.2, np.sqrt(0.86), 0.05, -0.02, 0.03])
    root = np.random.default_rng(2).normal(size=(7, 9)) * np.array([1e-3] * 4 + [5e-3] * 3)[:, None]
    return x, root @ root.T


def flight(seed: int, steps: int) -> tuple[Array, Array, Array]:
    """Torques, true states and measurements."""
    rng = np.random.default_rng(seed)
    torque = 0.05 * rng.normal(size=(steps, 3))
    x, truth = start()[0], []
    for k in range(steps):
        x = scaled(moved(x, torque[k]) + np.sqrt(Q) * rng.normal(size=7))
        truth.append(x)
    return torque, np.array(truth), np.array(truth) + np.sqrt(R) * rng.normal(size=(steps, 7))


CASES: dict[str, tuple[Callable[[], GeneratedFunction], Callable[..., tuple[Any, ...]]]] = {
    "extended, joseph": (partial(extended_filter_7, INERTIA), extended),
    "extended, symmetric": (partial(extended_filter_7, INERTIA, form="symmetric"), extended),
    "unscented": (partial(unscented_filter_7, INERTIA), unscented),
    "unscented, alpha 0.1": (partial(unscented_filter_7, INERTIA, alpha=0.1), partial(unscented, alpha=0.1)),
    "unscented, kappa -4": (partial(unscented_filter_7, INERTIA, kappa=-4.0), partial(unscented, kappa=-4.0)),
}


@pytest.mark.parametrize("name", CASES)
def test_against_a_dense_reference(name: str) -> None:
    make, reference = CASES[name]
    step = make()
    torque, _, z = flight(1, 20)
    x, P = start()
    for k in range(20):
        expected = reference(x, P, torque[k], z[k])
        *got, definite = step(x=x, P=P, torque_B=torque[k], dt=DT, z=z[k], Q_diagonal=Q, R_diagonal=R)
        assert definite == 1
        for one, other in zip(got, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9 * np.max(np.abs(other)))
        x, P = got[0], got[1]


def test_against_filterpy() -> None:
    kalman = pytest.importorskip("filterpy.kalman", reason="filterpy is absent: pip install filterpy")
    torque, _, z = flight(3, 10)
    x, P = start()
    points = kalman.MerweScaledSigmaPoints(7, alpha=1.0, beta=2.0, kappa=0.0)
    peer = kalman.UnscentedKalmanFilter(
        7, 7, DT, hx=lambda x: x, fx=lambda x, _, torque: moved(x, torque), points=points
    )
    peer.x, peer.P, peer.Q, peer.R = x.copy(), P.copy(), np.diag(Q), np.diag(R)
    step = unscented_filter_7(INERTIA)
    for k in range(10):
        peer.predict(torque=torque[k])
        # filterpy knows no unit quaternions: scaled where ours is, and the points drawn anew
        peer.x = scaled(peer.x)
        peer.sigmas_f = points.sigma_points(peer.x, peer.P)
        peer.update(z[k])
        peer.x = scaled(peer.x)
        x, P, innovation, S, likelihood, _ = step(x, P, torque[k], DT, z[k], Q, R)
        for one, other in ((x, peer.x), (P, peer.P), (innovation, peer.y), (S, peer.S)):
            np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9 * np.max(np.abs(other)))
        assert likelihood == pytest.approx(float(peer.log_likelihood), abs=1e-6)


@pytest.mark.parametrize("make", [extended_filter_7, unscented_filter_7])
def test_the_tracker_may_report_either_sign(make: Callable[..., GeneratedFunction]) -> None:
    torque, _, z = flight(4, 1)
    x, P = start()
    step = make(INERTIA)
    other = z[0] * np.array([-1] * 4 + [1] * 3)
    for one, two in zip(step(x, P, torque[0], DT, z[0], Q, R), step(x, P, torque[0], DT, other, Q, R), strict=True):
        np.testing.assert_array_equal(one, two)


@pytest.mark.parametrize("make", [extended_filter_7, unscented_filter_7])
def test_innovations_are_as_large_as_their_covariance_says(make: Callable[..., GeneratedFunction]) -> None:
    runs, steps = 200, 10
    flights = [flight(100 + k, steps) for k in range(runs)]
    torque, truth, z = (np.stack(parts) for parts in zip(*flights, strict=True))
    first, P0 = start()
    L = np.linalg.cholesky(P0)
    x = np.stack([scaled(first + L @ np.random.default_rng(k).normal(size=7)) for k in range(runs)])
    P = np.repeat(P0[None], runs, axis=0)
    step = make(INERTIA)
    whitened = []
    for k in range(steps):
        x, P, innovation, S, _, definite = step.batch(x, P, torque[:, k], np.full(runs, DT), z[:, k], Q, R)
        assert np.all(definite == 1)
        whitened.append(np.einsum("ni,ni->n", innovation, np.linalg.solve(S, innovation[..., None])[..., 0]))
    # the start of all runs differs from the truth by a draw of P0, so the squares are chi-square of 7 at every step;
    # along the quaternion itself the measurement is looser than its error
    total = float(np.sum(whitened[3:]))
    assert 1e-6 < chi2.cdf(total, 7 * runs * (steps - 3)) < 1 - 1e-6
    attitude = np.minimum(np.sum((x[:, :4] - truth[:, -1, :4]) ** 2, 1), np.sum((x[:, :4] + truth[:, -1, :4]) ** 2, 1))
    assert np.sqrt(np.mean(attitude)) < 1e-3


@pytest.mark.parametrize("name", ["extended_filter_7", "unscented_filter_7"])
def test_covariance_stays_definite_in_single_precision(name: str) -> None:
    runs, steps = 16, 40
    torque, truth, z = (np.stack(parts) for parts in zip(*(flight(k, steps) for k in range(runs)), strict=True))
    kernel = build(name, "float", inertia_B=INERTIA)
    assert isinstance(kernel, GeneratedFunction)
    step = SinglePrecision(kernel)
    x, P = (np.repeat(part[None], runs, axis=0) for part in start())
    for k in range(steps):
        x, P, _, _, likelihood, definite = step.batch(x, P, torque[:, k], DT, z[:, k], Q, R)
        assert np.all(definite == 1)
        assert np.all(np.isfinite(likelihood))
    assert np.min(np.linalg.eigvalsh(P)) > 0
    np.testing.assert_allclose(x, truth[:, -1], atol=5e-3)


def test_float_and_double_agree_over_one_step() -> None:
    torque, _, z = flight(6, 1)
    x, P = start()
    for name in ("extended_filter_7", "unscented_filter_7"):
        double, single = build(name, inertia_B=INERTIA), build(name, "float", inertia_B=INERTIA)
        assert isinstance(double, GeneratedFunction)
        assert isinstance(single, GeneratedFunction)
        exact = double(x, P, torque[0], DT, z[0], Q, R)
        rounded = SinglePrecision(single).batch(x[None], P[None], torque[0], DT, z[0], Q, R)
        np.testing.assert_allclose(rounded[0][0], exact[0], atol=3e-6)
        np.testing.assert_allclose(rounded[1][0], exact[1], atol=1e-3 * np.max(exact[1]))


def test_what_cannot_be_a_filter_is_refused() -> None:
    model = attitude_filter_model(INERTIA)
    with pytest.raises(InputError, match=r"must be the states .* after the step"):
        FilterModel(model.transition, model.measurement, ["omega_BN_B"])
    with pytest.raises(InputError, match="no port `q`"):
        FilterModel(model.transition, model.measurement, ["q", "omega_BN_B"])
    with pytest.raises(InputError, match=r"no port `q_measured`.*Did you mean `q_measured_BN`"):
        FilterModel(model.transition, model.measurement, model.states, sign_free=["q_measured"])
    with pytest.raises(InputError, match="no sigma points of 7 states"):
        unscented_step(model, points=SigmaPoints(kappa=-7.0))
    with pytest.raises(InputError, match="`noise` must be 'full' or 'diagonal', got 'none'"):
        unscented_step(model, noise="none")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`form` must be 'joseph' or 'symmetric'"):
        extended_filter_7(INERTIA, form="cholesky")  # type: ignore[arg-type]
