"""Generated functions: calls, batches, exact Jacobians, and what a refusal says."""

import pickle

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError, UnknownOptionError
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


def example() -> GeneratedFunction:
    x, J, t = ca.SX.sym("x", 3), ca.SX.sym("J", 3, 2), ca.SX.sym("t")
    return generate(
        "example",
        inputs=[(Port("x", (3,), "m", "B"), x), (Port("J", (3, 2), "-"), J), (Port("t", (), "s"), t)],
        outputs=[
            (Port("y", (2,), "m"), J.T @ x * ca.sin(t)),
            (Port("K", (3, 3), "-"), J @ J.T * t),
            (Port("constant", (2,), "-"), ca.SX([1, 0])),
        ],
    )


def numbers(count: int) -> tuple[Array, Array, Array]:
    rng = np.random.default_rng(7)
    return rng.normal(size=(count, 3)), rng.normal(size=(count, 3, 2)), rng.normal(size=count)


def test_call_by_position_and_by_name() -> None:
    x, J, t = (array[0] for array in numbers(1))
    y, K, constant = example()(x, J, t=t)
    np.testing.assert_allclose(y, J.T @ x * np.sin(t), rtol=1e-15)
    np.testing.assert_allclose(K, J @ J.T * t, rtol=1e-14)
    assert constant.tolist() == [1, 0]


def test_a_single_output_comes_unpacked() -> None:
    x = ca.SX.sym("x", 3)
    double = generate("double", [(Port("x", (3,), "-"), x)], [(Port("y", (3,), "-"), 2 * x)])
    assert double([1, 2, 3]).tolist() == [2, 4, 6]
    assert double.batch([[1, 2, 3]]).tolist() == [[2, 4, 6]]


@pytest.mark.parametrize("count", [0, 1, 2, 3, 50])
def test_batch_is_the_call_row_by_row(count: int) -> None:
    f, (x, J, t) = example(), numbers(count)
    together = f.batch(x, J, t)
    assert [array.shape for array in together] == [(count, 2), (count, 3, 3), (count, 2)]
    for k in range(count):
        for whole, single in zip(together, f(x[k], J[k], t[k]), strict=True):
            np.testing.assert_array_equal(whole[k], single)


def test_batch_shares_what_has_no_sample_axis() -> None:
    f, (x, J, t) = example(), numbers(9)
    for shared, full in zip(f.batch(x, J[0], 0.5), f.batch(x, np.repeat(J[:1], 9, 0), np.full(9, 0.5)), strict=True):
        np.testing.assert_array_equal(shared, full)
    # only a scalar varies: every output still has a sample axis
    assert [array.shape for array in f.batch(x[0], J[0], t)] == [(9, 2), (9, 3, 3), (9, 2)]


@pytest.mark.parametrize("of", ["y", "K", "constant"])
@pytest.mark.parametrize("wrt", ["x", "J", "t"])
def test_jacobian_against_central_differences(of: str, wrt: str) -> None:
    f = example()
    values = dict(zip("xJt", (array[0] for array in numbers(1)), strict=True))
    exact = f.jacobian(of, wrt)(**values)
    place = [port.name for port in f.outputs].index(of)
    at = np.asarray(values[wrt], dtype=float)
    columns = []
    for k in range(at.size):
        nudge = np.zeros(at.size)
        nudge[k] = 1e-5
        ahead, behind = (f(**(values | {wrt: at + sign * nudge.reshape(at.shape)}))[place].ravel() for sign in (1, -1))
        columns.append((ahead - behind) / 2e-5)
    np.testing.assert_allclose(exact, np.stack(columns, axis=1), atol=1e-8)


def test_jacobian_carries_its_unit_and_batches() -> None:
    f, (x, J, t) = example(), numbers(4)
    jacobian = f.jacobian("y", "t")
    assert str(jacobian.outputs[0]) == "d_y_d_t (2, 1) [m/(s)]"
    assert jacobian.batch(x, J, t).shape == (4, 2, 1)
    assert f.jacobian("K", "t").outputs[0].unit == "1/(s)"
    assert f.jacobian("K", "J").outputs[0].unit == "-"


def test_casadi_arguments_give_casadi_results() -> None:
    f, (x, J, t) = example(), numbers(1)
    time = ca.SX.sym("time")
    y, _, _ = f(x[0], J[0], ca.cos(time))
    composed = ca.Function("composed", [time], [y])
    np.testing.assert_allclose(composed(t[0]).full()[:, 0], f(x[0], J[0], np.cos(t[0]))[0], rtol=1e-15)


def test_pickle_keeps_the_function() -> None:
    f, (x, J, t) = example(), numbers(1)
    copy = pickle.loads(pickle.dumps(f))
    assert repr(copy) == repr(f)
    for one, other in zip(copy(x[0], J[0], t[0]), f(x[0], J[0], t[0]), strict=True):
        np.testing.assert_array_equal(one, other)


def test_repr_shows_ports_and_units() -> None:
    assert repr(example()) == (
        "example(x (3,) [m] in B, J (3, 2) [-], t () [s]) -> y (2,) [m], K (3, 3) [-], constant (2,) [-]"
    )


def test_refusals_name_the_function_and_the_port() -> None:
    f, (x, J, t) = example(), numbers(3)
    with pytest.raises(InputError, match=r"example: `x` must have shape \(3,\) \[m\], got \(2,\)\.$"):
        f(x[0][:2], J[0], 1.0)
    with pytest.raises(InputError, match=r"got \(3, 3\)\. Use `\.batch`"):
        f(x, J[0], 1.0)
    with pytest.raises(InputError, match=r"example: `J` must be finite"):
        f(x[0], J[0] * np.nan, 1.0)
    with pytest.raises(InputError, match=r"example: input t \(\) \[s\] is missing"):
        f(x[0], J[0])
    with pytest.raises(InputError, match="takes 3 arguments, got 4"):
        f(x[0], J[0], 1.0, 2.0)
    with pytest.raises(InputError, match="`x` was given by position and by name"):
        f(x[0], x=x[0])
    with pytest.raises(UnknownOptionError, match=r"example has no input `tt`\. Did you mean `t`"):
        f(x[0], J[0], tt=1.0)
    with pytest.raises(InputError, match="`x` 3, `J` 2"):
        f.batch(x, J[:2], 1.0)
    with pytest.raises(InputError, match="same number of samples; lengths: none"):
        f.batch(x[0], J[0], 1.0)
    with pytest.raises(InputError, match=r"example\.batch: `x` must have shape \(N, 3\)"):
        f.batch(x[:, :2], J, t)
    with pytest.raises(InputError, match=r"no port `constnat`\. Did you mean `constant`"):
        f.jacobian("constnat", "x")


def test_generate_refuses_what_cannot_be_a_function() -> None:
    x, other = ca.SX.sym("x", 3), ca.SX.sym("other")
    port, out = Port("x", (3,), "m"), Port("y", (3,), "m")
    with pytest.raises(InputError, match="g: the outputs use other, which is no input"):
        generate("g", [(port, x)], [(out, other * x)])
    with pytest.raises(InputError, match="input `x` must be a CasADi symbol"):
        generate("g", [(port, 2 * x)], [(out, x)])
    with pytest.raises(InputError, match=r"y \(3,\) \[m\] does not match an expression of shape \(1, 1\)"):
        generate("g", [(port, x)], [(out, x[0])])
    with pytest.raises(InputError, match="input `x` appears twice"):
        generate("g", [(port, x), (port, x)], [(out, x)])
    with pytest.raises(InputError, match="use letters, digits and single underscores"):
        generate("no good", [(port, x)], [(out, x)])
    with pytest.raises(InputError, match=r"must have shape \(\), \(n,\) or \(n, m\)"):
        Port("x", (2, 2, 2), "-")
