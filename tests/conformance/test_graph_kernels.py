"""Sparse graphs: against dense linear algebra, any order of nodes, bits of the twin, Runge-Kutta around them."""

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from kernel_source_harness import assert_twin_agrees, compiled
from scipy.sparse import csr_array

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.graph import graph
from optsat.kernels.integrate import integrate, step
from optsat.kernels.source import KernelSource
from optsat.kernels.status import Status
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


def oscillator() -> GeneratedFunction:
    """Rate of a node of two numbers, coupled to its neighbours by position, with a command of its own."""
    x, gathered, degree, command, gain = (
        ca.SX.sym("x", 2),
        ca.SX.sym("neighbours"),
        ca.SX.sym("degree"),
        ca.SX.sym("command"),
        ca.SX.sym("gain"),
    )
    slope = ca.vertcat(x[1], gain * (gathered - degree * x[0]) - 0.1 * x[1] / (1 + x[1] ** 2) + command)
    return generate(
        "oscillator",
        inputs=[
            (Port("gain", (), "-"), gain),
            (Port("neighbours", (), "-"), gathered),
            (Port("command", (), "-"), command),
            (Port("x", (2,), "-"), x),
            (Port("degree", (), "-"), degree),
        ],
        outputs=[(Port("x_rate", (2,), "-"), slope)],
    )


def position() -> GeneratedFunction:
    x = ca.SX.sym("x", 2)
    return generate("position", inputs=[(Port("x", (2,), "-"), x)], outputs=[(Port("position", (), "-"), x[0])])


def network(rng: np.random.Generator, nodes: int) -> csr_array:
    """Random, not symmetric, with isolated nodes, its entries not sorted within a row."""
    weights = np.where(rng.random((nodes, nodes)) < 3.0 / nodes, rng.random((nodes, nodes)), 0.0)
    matrix: csr_array = csr_array(weights)
    for i in range(nodes):
        row = slice(matrix.indptr[i], matrix.indptr[i + 1])
        shuffled = rng.permutation(row.stop - row.start)
        matrix.indices[row], matrix.data[row] = matrix.indices[row][shuffled], matrix.data[row][shuffled]
    return matrix


def make(matrix: csr_array, reorder: bool = True) -> KernelSource:
    return graph(
        oscillator(), matrix, ["x"], "neighbours", "degree", ["command"], position(), result="x_rate", reorder=reorder
    )


def dense(matrix: csr_array, x: Array, command: Array, gain: float) -> Array:
    weights = matrix.toarray()
    pull = gain * (weights @ x[:, 0] - weights.sum(axis=1) * x[:, 0])
    return np.column_stack([x[:, 1], pull - 0.1 * x[:, 1] / (1 + x[:, 1] ** 2) + command])


@pytest.mark.parametrize("nodes", [1, 2, 7, 8, 9, 60])
def test_it_is_the_dense_product(nodes: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(nodes)
    matrix = network(rng, nodes)
    call, single = compiled(make(matrix), tmp_path), compiled(make(matrix), tmp_path, real=np.float32)
    for _ in range(5):
        x, command, gain = rng.normal(size=(nodes, 2)), rng.normal(size=nodes), rng.normal()
        row = np.concatenate([x.ravel(), command, [gain]])
        expected = dense(matrix, x, command, gain).ravel()
        status, y = call(row)
        assert status == Status.OK
        np.testing.assert_allclose(y, expected, rtol=0, atol=1e-13)
        np.testing.assert_allclose(single(row)[1], expected, rtol=0, atol=2e-5)


def test_the_order_in_memory_changes_no_bit(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    # a ring whose nodes are numbered at random: neighbours far apart in memory
    nodes = 40
    names = rng.permutation(nodes)
    matrix = csr_array((rng.normal(size=2 * nodes), (np.tile(names, 2), np.r_[np.roll(names, 1), np.roll(names, -1)])))
    moved, plain = make(matrix), make(matrix, reorder=False)
    assert "ORDER[40] = { 0, 1, 2," in plain.body
    assert moved.body != plain.body
    x = np.concatenate([rng.normal(size=3 * nodes), [0.7]])
    np.testing.assert_array_equal(compiled(moved, tmp_path)(x)[1], compiled(plain, tmp_path)(x)[1])


def test_every_form_has_the_bits_of_the_twin(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    for nodes in (1, 12):
        matrix = network(rng, nodes)
        samples = rng.normal(size=(12, 3 * nodes + 1))
        samples[8:][rng.random((4, 3 * nodes + 1)) < 0.2] = np.nan
        samples[7, 0] = 1e300
        rate = make(matrix)
        for source, rows in (
            (rate, samples),
            (step(rate, ["x"], "midpoint"), np.column_stack([samples, np.full(12, 0.1)])),
        ):
            assert_twin_agrees(source, rows, tmp_path)


def test_runge_kutta_around_a_graph_against_scipy(tmp_path: Path) -> None:
    from scipy.integrate import solve_ivp

    rng = np.random.default_rng(3)
    nodes, steps = 10, 50
    matrix = network(rng, nodes)
    source = integrate(step(make(matrix), ["x"]), ["x"], steps, every=steps, held=True, name="network")
    x, command, gain = rng.normal(size=(nodes, 2)), 0.1 * rng.normal(size=nodes), 0.5
    status, y = compiled(source, tmp_path)(np.concatenate([x.ravel(), command, [gain, 2.0 / steps]]))
    assert (status, y[-1]) == (Status.OK, steps)

    def slope(_: float, state: Array) -> Array:
        return dense(matrix, state.reshape(nodes, 2), command, gain).ravel()

    exact = solve_ivp(slope, (0.0, 2.0), x.ravel(), rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose(y[-1 - 2 * nodes : -1], exact, rtol=0, atol=1e-6)


def test_status(tmp_path: Path) -> None:
    matrix = csr_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    call = compiled(make(matrix), tmp_path)
    x = np.zeros(7)
    assert call(x)[0] == Status.OK
    x[0] = np.nan
    assert call(x)[0] == Status.NOT_FINITE
    x[0], x[2], x[6] = 1e300, -1e300, 1e300
    assert call(x)[0] == Status.OUTPUT


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(InputError, match=r"must be a square matrix of nodes, got shape \(2, 3\)"):
        make(csr_array(np.ones((2, 3))))
    with pytest.raises(InputError, match="weights that are not finite"):
        make(csr_array(np.array([[np.nan]])))
    with pytest.raises(InputError, match="gather 2 numbers, as many as a node sends; it gives 2 and gathers 1"):
        graph(oscillator(), np.eye(2), ["x"], "neighbours")
    with pytest.raises(InputError, match=r"has no argument `neighbors`\. Did you mean `neighbours`"):
        graph(oscillator(), np.eye(2), ["x"], "neighbors")
