"""Every filter against the exact Kalman filter on linear models: states, covariances and likelihoods."""

from collections.abc import Callable
from functools import partial

import casadi as ca
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from optsat.arrays import Array
from optsat.estimators.extended import extended_step
from optsat.estimators.filter_model import FilterModel
from optsat.estimators.unscented import SigmaPoints, unscented_step
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

Make = Callable[[FilterModel], GeneratedFunction]

FILTERS: dict[str, Make] = {
    "extended, joseph": extended_step,
    "extended, symmetric": partial(extended_step, form="symmetric"),
    "unscented": unscented_step,
    "unscented, alpha 0.1": partial(unscented_step, points=SigmaPoints(alpha=0.1)),
    "unscented, kappa 1": partial(unscented_step, points=SigmaPoints(alpha=0.7, beta=0.0, kappa=1.0)),
}


class Linear:
    """x_next = A x + B u + w, z = C x + D u + v, and its exact filter."""

    def __init__(self, seed: int, n: int, m: int) -> None:
        rng = np.random.default_rng(seed)
        self.A, self.B = rng.normal(size=(n, n)) / np.sqrt(n), rng.normal(size=(n, 2))
        self.C, self.D = rng.normal(size=(m, n)), rng.normal(size=(m, 2))
        self.Q, self.R = (self._covariance(rng, k) for k in (n, m))
        self.x, self.P = rng.normal(size=n), self._covariance(rng, n)
        self.u, self.z = rng.normal(size=(5, 2)), 3 * rng.normal(size=(5, m))

    @staticmethod
    def _covariance(rng: np.random.Generator, n: int) -> Array:
        root = rng.normal(size=(n, n + 2))
        return np.asarray(root @ root.T)

    def model(self) -> FilterModel:
        """The state in two parts where it has two."""
        n, m = len(self.A), len(self.C)
        parts = [Port("first", (1,), "-"), Port("rest", (n - 1,), "-")] if n > 1 else [Port("first", (1,), "-")]
        symbols = [ca.SX.sym(port.name, port.size) for port in parts]
        u, x = ca.SX.sym("u", 2), ca.vertcat(*symbols)
        x_next = ca.DM(self.A) @ x + ca.DM(self.B) @ u
        inputs = [*zip(parts, symbols, strict=True), (Port("u", (2,), "-"), u)]
        moved = [(parts[0], x_next[0]), *([(parts[1], x_next[1:])] if n > 1 else [])]
        return FilterModel(
            generate("f", inputs, moved),
            generate("h", inputs, [(Port("z", (m,), "-"), ca.DM(self.C) @ x + ca.DM(self.D) @ u)]),
            [port.name for port in parts],
        )

    def exact(self, x: Array, P: Array, u: Array, z: Array) -> tuple[Array, Array, Array, Array, Array]:
        x, P = self.A @ x + self.B @ u, self.A @ P @ self.A.T + self.Q
        innovation = z - self.C @ x - self.D @ u
        S = self.C @ P @ self.C.T + self.R
        K = np.linalg.solve(S, self.C @ P).T
        likelihood = np.asarray(multivariate_normal.logpdf(innovation, cov=S))
        return x + K @ innovation, P - K @ S @ K.T, innovation, S, likelihood


@pytest.mark.parametrize("name", FILTERS)
@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 1), (2, 3), (4, 2), (6, 4)])
def test_linear_model(name: str, n: int, m: int) -> None:
    system = Linear(10 * n + m, n, m)
    step = FILTERS[name](system.model())
    x, P = system.x, system.P
    for u, z in zip(system.u, system.z, strict=True):
        expected = system.exact(x, P, u, z)
        *got, definite = step(x=x, P=P, u=u, z=z, Q=system.Q, R=system.R)
        for one, other in zip(got, expected, strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-10 * np.max(np.abs(other)))
        assert definite == 1
        x, P = got[0], got[1]
        np.testing.assert_array_equal(P, P.T)
        np.testing.assert_array_equal(got[3], got[3].T)


@pytest.mark.parametrize("make", [extended_step, unscented_step])
def test_diagonal_noise_is_the_full_matrix_of_it(make: Callable[..., GeneratedFunction]) -> None:
    system = Linear(3, 3, 2)
    q, r = np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.7])
    common = {"x": system.x, "P": system.P, "u": system.u[0], "z": system.z[0]}
    full = make(system.model())(**common, Q=np.diag(q), R=np.diag(r))
    short = make(system.model(), noise="diagonal")(**common, Q_diagonal=q, R_diagonal=r)
    for one, other in zip(full, short, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("make", [extended_step, unscented_step])
def test_only_the_lower_triangle_is_read(make: Callable[..., GeneratedFunction]) -> None:
    system = Linear(4, 3, 2)
    common = {"x": system.x, "u": system.u[0], "z": system.z[0]}
    step = make(system.model())
    usual = step(**common, P=system.P, Q=system.Q, R=system.R)
    lower = step(**common, P=np.tril(system.P), Q=np.tril(system.Q), R=np.tril(system.R))
    for one, other in zip(usual, lower, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("make", [extended_step, unscented_step])
def test_a_covariance_that_is_none_is_told(make: Callable[..., GeneratedFunction]) -> None:
    system = Linear(5, 3, 2)
    step = make(system.model())
    common = {"x": system.x, "u": system.u[0], "z": system.z[0], "Q": 0 * system.Q}
    *results, definite = step(**common, P=-system.P, R=0 * system.R)
    assert definite == 0
    assert all(np.all(np.isfinite(result)) for result in results)
    *_, definite = step(**common, P=system.P, R=-100 * np.eye(2) @ np.abs(system.R))
    assert definite == 0
