"""Bank of filters: against the textbook recursion on linear models, its twin, floors, capacity and failing modes."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from kernel_source_harness import Call, compiled, sanitized
from numpy.typing import ArrayLike
from scipy.stats import multivariate_normal

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.estimators.attitude_filter import attitude_filter_model
from optsat.estimators.filter_model import FilterModel
from optsat.estimators.unscented import unscented_step
from optsat.estimators.unscented_loops import unscented_loops
from optsat.kernels.bank import bank
from optsat.kernels.source import KernelSource
from optsat.kernels.status import Status
from optsat.port import Port
from optsat.symbolic.generated_function import generate

N, M = 3, 2
RNG = np.random.default_rng(0)
A, C = np.eye(N) + 0.1 * RNG.normal(size=(N, N)), RNG.normal(size=(M, N))


def linear() -> FilterModel:
    x = ca.SX.sym("x", N)
    inputs = [(Port("x", (N,), "-"), x)]
    return FilterModel(
        generate("f", inputs, [(Port("x", (N,), "-"), ca.DM(A) @ x)]),
        generate("h", inputs, [(Port("z", (M,), "-"), ca.DM(C) @ x)]),
        ["x"],
    )


def make(modes: int, form: str = "loops") -> KernelSource:
    step = unscented_loops if form == "loops" else unscented_step
    return bank(step(linear(), "one", noise="diagonal"), modes, ["R_diagonal"])


class Bank:
    """Modes, and the textbook recursion in plain NumPy."""

    def __init__(self, rng: np.random.Generator, modes: int) -> None:
        self.x = rng.normal(size=(modes, N))
        roots = rng.normal(size=(modes, N, N + 2))
        self.P = roots @ roots.transpose(0, 2, 1)
        self.mu = rng.dirichlet(np.ones(modes))
        self.Q, self.R = rng.uniform(0.1, 1.0, N), rng.uniform(0.1, 5.0, (modes, M))
        self.transition = rng.dirichlet(np.ones(modes), modes)
        self.z = rng.normal(size=M)

    def row(self, count: int | None = None) -> Array:
        count = len(self.mu) if count is None else count
        with np.errstate(divide="ignore"):
            logs = np.log(self.mu)
        parts: list[ArrayLike] = [self.x, self.P, logs, self.z, self.Q, self.R, self.transition, [count]]
        return np.concatenate([np.ravel(part) for part in parts])

    def step(self) -> tuple[Array, Array, Array, Array, Array, float]:
        modes = range(len(self.mu))
        predicted = self.mu @ self.transition
        mixing = self.transition * self.mu[:, None] / predicted
        x, P, likelihood = np.zeros_like(self.x), np.zeros_like(self.P), np.zeros(len(self.mu))
        for j in modes:
            x0 = mixing[:, j] @ self.x
            P0 = sum(mixing[i, j] * (self.P[i] + np.outer(self.x[i] - x0, self.x[i] - x0)) for i in modes)
            x0, P0 = A @ x0, A @ P0 @ A.T + np.diag(self.Q)
            S = C @ P0 @ C.T + np.diag(self.R[j])
            K = P0 @ C.T @ np.linalg.inv(S)
            x[j], P[j] = x0 + K @ (self.z - C @ x0), P0 - K @ S @ K.T
            likelihood[j] = multivariate_normal.pdf(self.z, C @ x0, S)
        evidence = predicted @ likelihood
        mu = predicted * likelihood / evidence
        mean = mu @ x
        covariance = sum(mu[i] * (P[i] + np.outer(x[i] - mean, x[i] - mean)) for i in modes)
        return x, P, mu, mean, np.asarray(covariance), float(np.log(evidence))


def split(source: KernelSource, y: Array) -> dict[str, Array]:
    ends = np.cumsum([port.size for port in source.outputs])[:-1]
    parts = np.split(y, ends)
    return {port.name: part.reshape(port.shape) for port, part in zip(source.outputs, parts, strict=True)}


@pytest.mark.parametrize(("modes", "form"), [(2, "loops"), (3, "loops"), (5, "unrolled"), (12, "loops")])
def test_it_is_the_textbook_recursion(modes: int, form: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(modes)
    source = make(modes, form)
    call, single = compiled(source, tmp_path), compiled(source, tmp_path, real=np.float32)
    for _ in range(10):
        state = Bank(rng, modes)
        x, P, mu, mean, covariance, evidence = state.step()
        status, y = call(state.row())
        got = split(source, y)
        assert status == Status.OK
        np.testing.assert_allclose(got["x"], x, rtol=0, atol=1e-11)
        np.testing.assert_allclose(got["P"].reshape(P.shape), P, rtol=0, atol=1e-11)
        np.testing.assert_allclose(np.exp(got["log_probability"]), mu, rtol=1e-10, atol=1e-58)
        np.testing.assert_allclose(got["mean"], mean, rtol=0, atol=1e-11)
        np.testing.assert_allclose(got["covariance"], covariance, rtol=0, atol=1e-11)
        np.testing.assert_array_equal(got["covariance"], got["covariance"].T)
        assert got["log_evidence"] == pytest.approx(evidence, rel=1e-11, abs=1e-11)
        assert not got["failed"].any()
        status, y = single(state.row())
        assert status == Status.OK
        np.testing.assert_allclose(split(source, y)["mean"], mean, rtol=0, atol=2e-4 * (1.0 + np.abs(mean).max()))


def test_twin_agrees_but_for_exponentials_and_logarithms(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    source = make(4)
    assert source.twin is not None
    samples = [Bank(rng, 4).row(count) for count in (4, 4, 4, 3, 2, 1)]
    hostile = []
    for x in samples:
        for _ in range(3):
            bad = x.copy()
            bad[rng.integers(len(x))] = rng.choice([np.nan, np.inf, -1.0, 0.0, 1e200, -1e300])
            hostile.append(bad)
    samples += hostile
    expected = [source.twin(x) for x in samples]
    assert len({status for status, _ in expected}) >= 3
    calls: list[Call] = [
        compiled(source, tmp_path, *form) for form in (("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O2"))
    ]
    found = [[call(x) for x in samples] for call in calls] + [sanitized(source, np.array(samples), tmp_path)]
    for each in found:
        for (status, y), (wanted_status, wanted) in zip(each, expected, strict=True):
            assert status == wanted_status
            np.testing.assert_allclose(y, wanted, rtol=1e-12, atol=1e-12)
    for a, b in zip(found[0], found[2], strict=True):
        # whatever the exponential, every compiler has the same bits
        np.testing.assert_array_equal(a[1], b[1])


def test_unused_modes_pass_through_untouched(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    small, large = make(2), make(5)
    two, five = Bank(rng, 2), Bank(rng, 5)
    five.x[:2], five.P[:2], five.R[:2] = two.x, two.P, two.R
    five.Q, five.z = two.Q, two.z
    five.mu[:2], five.transition[:2, :2] = two.mu, two.transition
    got = split(large, compiled(large, tmp_path)(five.row(count=2))[1])
    wanted = split(small, compiled(small, tmp_path)(two.row())[1])
    for name in ("x", "P", "log_probability", "failed"):
        np.testing.assert_array_equal(got[name][:2], wanted[name])
    for name in ("mean", "covariance", "log_evidence"):
        np.testing.assert_array_equal(got[name], wanted[name])
    np.testing.assert_array_equal(got["x"][2:], five.x[2:])
    np.testing.assert_array_equal(got["log_probability"][2:], np.log(five.mu[2:]))


@pytest.mark.parametrize("real", [np.float64, np.float32])
def test_an_impossible_mode_stays_at_the_floor_without_pushing_its_state(real: type, tmp_path: Path) -> None:
    rng = np.random.default_rng(9)
    source = make(2)
    call = compiled(source, tmp_path, real=real)
    state = Bank(rng, 2)
    state.transition = np.array([[1.0, 0.0], [0.5, 0.5]])
    state.mu = np.array([1.0, 0.0])
    state.x[1] = 1e6
    x = state.row()
    x[2 * (N + N * N) + 1] = -1e4
    status, y = call(x)
    got = split(source, y)
    assert status == Status.OK
    # its likelihood is nothing; the floor holds it, and it comes back once it explains what is measured
    assert got["log_probability"][1] == pytest.approx(np.log(1e-60), rel=1e-6)
    assert got["log_probability"][0] == 0.0
    alone = Bank(rng, 1)
    alone.x, alone.P, alone.Q, alone.R, alone.z = state.x[:1], state.P[:1], state.Q, state.R[:1], state.z
    alone.transition, alone.mu = np.ones((1, 1)), np.ones(1)
    tolerance = 1e-12 if real is np.float64 else 1e-4
    np.testing.assert_allclose(got["x"][0], alone.step()[0][0], rtol=0, atol=tolerance)
    np.testing.assert_allclose(got["mean"], alone.step()[3], rtol=0, atol=tolerance)


def test_a_failing_mode_is_told_and_the_others_go_on(tmp_path: Path) -> None:
    rng = np.random.default_rng(10)
    for form in ("loops", "unrolled"):
        source = make(3, form)
        call = compiled(source, tmp_path)
        state = Bank(rng, 3)
        state.R[1] = -1e3
        status, y = call(state.row())
        got = split(source, y)
        assert status == Status.OK
        np.testing.assert_array_equal(got["failed"], [0.0, 1.0, 0.0])
        assert got["log_probability"][1] == np.log(1e-60)
        assert np.exp(got["log_probability"][[0, 2]]).sum() == pytest.approx(1.0, rel=1e-14)
        state.R[:] = -1e3
        status, y = call(state.row())
        assert status == Status.STATE
        np.testing.assert_array_equal(split(source, y)["failed"], np.ones(3))
        assert np.isnan(split(source, y)["mean"]).all()


def test_counts_and_transitions_that_are_none_are_refused(tmp_path: Path) -> None:
    source = make(3)
    call = compiled(source, tmp_path)
    for change in ("count 0", "count 4", "count 1.5", "rows", "negative", "no way in"):
        state = Bank(np.random.default_rng(11), 3)
        if change == "rows":
            state.transition[1] *= 1.01
        if change == "negative":
            state.transition[0] = [1.2, -0.2, 0.0]
        if change == "no way in":
            state.transition = np.array([[0.5, 0.5, 0.0]] * 3)
        x = state.row()
        x[-1] = float(change.split()[1]) if change.startswith("count") else 3.0
        status, y = call(x)
        assert status == Status.RANGE, change
        assert np.isnan(split(source, y)["x"]).all()


def test_quaternions_are_mixed_on_one_side(tmp_path: Path) -> None:
    model = attitude_filter_model()
    q, r = ca.SX.sym("x", 7), ca.SX.sym("reference", 7)
    port, reference = Port("x", (7,), "SI"), Port("reference", (7,), "SI")
    sign = ca.if_else(ca.dot(r[:4], q[:4]) < 0, -1, 1)
    near = generate("near", [(reference, r), (port, q)], [(port, ca.vertcat(sign * q[:4], q[4:]))])
    scaled = generate("scaled", [(port, q)], [(port, model.scaled(q))])
    one = unscented_loops(model, "one", noise="diagonal")
    source = bank(one, 2, ["R_diagonal"], restore=scaled, near=near)
    call = compiled(source, tmp_path)
    x = np.array([0.1, 0.2, 0.3, np.sqrt(0.86), 0.01, 0.0, 0.0])
    P = 1e-4 * np.eye(7).ravel()
    turned = np.concatenate([-x[:4], x[4:]])
    rest = [np.zeros(3), [0.1], x, np.full(7, 1e-6), np.full(14, 1e-4), [0.9, 0.1, 0.1, 0.9, 2.0]]
    results = []
    for second in (x, turned):
        status, y = call(np.concatenate([x, second, P, P, np.log([0.6, 0.4]), *rest]))
        assert status == Status.OK
        results.append(split(source, y))
    np.testing.assert_allclose(results[0]["mean"], results[1]["mean"], rtol=0, atol=1e-15)
    np.testing.assert_allclose(results[0]["covariance"], results[1]["covariance"], rtol=0, atol=1e-15)
    assert np.linalg.norm(results[1]["mean"][:4]) == pytest.approx(1.0, abs=1e-15)


def test_what_does_not_fit_is_refused() -> None:
    one = unscented_loops(linear(), "one", noise="diagonal")
    with pytest.raises(InputError, match=r"`floor` must be in \(0, 1e-30\], got 1e-14: with a larger one"):
        bank(one, 2, ["R_diagonal"], floor=1e-14)
    with pytest.raises(InputError, match="`per_mode` names `R`, one takes z, Q_diagonal, R_diagonal"):
        bank(one, 2, ["R"])
    with pytest.raises(InputError, match="must take x and P first"):
        bank(linear().transition, 2, [])
