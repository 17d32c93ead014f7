"""Generated functions compiled: when that happens, that no bit changes, and what a kernel of one is."""

import pickle
from typing import Any

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError, UnknownOptionError
from optsat.kernels import open_kernel
from optsat.kernels.toolchain import CompilerMissingError, find_compiler
from optsat.port import Port
from optsat.symbolic import evaluation
from optsat.symbolic.generated_function import GeneratedFunction, generate


def swinging() -> GeneratedFunction:
    x, t = ca.SX.sym("x", 2), ca.SX.sym("t")
    rate = ca.vertcat(x[1], -ca.sin(x[0]) * ca.exp(-t))
    return generate(
        "swinging",
        [(Port("x", (2,), "-"), x), (Port("t", (), "s"), t)],
        [(Port("rate", (2,), "1/s"), rate), (Port("energy", (), "-"), 1 - ca.cos(x[0]) + x[1] ** 2 / 2)],
    )


def numbers(count: int) -> tuple[Array, Array]:
    rng = np.random.default_rng(3)
    return rng.normal(size=(count, 2)) * 10.0, rng.normal(size=count)


def is_compiled(function: GeneratedFunction) -> bool:
    return function._evaluation._compiled is not None


@pytest.fixture
def soon(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions are compiled after ten samples."""
    monkeypatch.setattr(evaluation, "COMPILE_AFTER", 10)
    try:
        find_compiler()
    except CompilerMissingError as error:
        pytest.skip(str(error))


@pytest.mark.usefixtures("soon")
def test_compiling_changes_no_bit_of_a_call() -> None:
    f, (x, t) = swinging(), numbers(30)
    before = [f(x[k], t[k]) for k in range(9)]
    assert not is_compiled(f)
    after = [f(x[k], t[k]) for k in range(30)]
    assert is_compiled(f)
    for k in range(9):
        for one, other in zip(before[k], after[k], strict=True):
            np.testing.assert_array_equal(one, other)
            assert type(one) is type(other)
    exact = [f.casadi(x[k], t[k])[0].full()[:, 0] for k in range(30)]
    np.testing.assert_array_equal([rate for rate, _ in after], exact)


@pytest.mark.usefixtures("soon")
def test_compiling_changes_no_bit_of_a_batch() -> None:
    f, (x, t) = swinging(), numbers(3000)
    before = f.batch(x[:5], t[:5])
    assert not is_compiled(f)
    after = f.batch(x, t)
    assert is_compiled(f)
    for one, other, threaded in zip(before, after, f.batch(x, t, threads=2), strict=True):
        np.testing.assert_array_equal(one, other[:5])
        np.testing.assert_array_equal(other, threaded)
    exact = swinging().casadi.map(3000)(x.T, t)[1].full()[0]
    np.testing.assert_array_equal(after[1], exact)


@pytest.mark.usefixtures("soon")
def test_refusals_are_those_of_before() -> None:
    f, (x, t) = swinging(), numbers(20)
    said: list[list[str]] = []
    for _ in range(2):
        said.append([])
        for wrong in ((x[0], np.nan), (x[:2], 0.0), ([1.0], 0.0), (x[0],)):
            with pytest.raises(InputError) as caught:
                f(*wrong)
            said[-1].append(str(caught.value))
        with pytest.raises(UnknownOptionError):
            f(x[0], time=0.0)
        with pytest.raises(InputError, match=r"swinging: `x` must be finite \[-\]: row 7 holds inf"):
            f.batch(np.where(np.arange(20)[:, None] == 7, np.inf, x), t)
        with pytest.raises(InputError, match="`threads` must be a whole number from 1"):
            f.batch(x, t, threads=0)
        f.batch(x, t)
    assert is_compiled(f)
    assert said[0] == said[1]


@pytest.mark.usefixtures("soon")
def test_a_compiled_function_still_composes_and_travels() -> None:
    f, (x, t) = swinging(), numbers(20)
    f.batch(x, t)
    symbol = ca.SX.sym("s")
    composed = ca.Function("composed", [symbol], [f(x[0], symbol)[0]])
    np.testing.assert_array_equal(composed(t[0]).full()[:, 0], f(x[0], t[0])[0])
    copy = pickle.loads(pickle.dumps(f))
    np.testing.assert_array_equal(copy(x[0], t[0])[0], f(x[0], t[0])[0])
    assert f.jacobian("rate", "x")(x[0], t[0]).shape == (2, 2)


@pytest.mark.usefixtures("soon")
def test_what_no_kernel_can_do_stays_with_casadi() -> None:
    y = ca.SX.sym("y")
    odd = generate("odd", [(Port("y", (), "-"), y)], [(Port("z", (), "-"), ca.erfinv(y))])
    for _ in range(20):
        assert odd(0.5) == pytest.approx(0.4769362762044699, rel=1e-9)
    assert not is_compiled(odd)
    with pytest.raises(InputError, match="inverse error function"):
        odd.kernel()


@pytest.mark.usefixtures("soon")
def test_a_large_function_is_compiled_on_demand_only(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(evaluation, "LARGE", 5)
    f, (x, t) = swinging(), numbers(20)
    f.batch(x, t)
    assert not is_compiled(f)


def test_without_a_compiler_nothing_changes_and_it_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from optsat.kernels import interpreted

    def refuse(*_arguments: Any) -> Any:
        raise CompilerMissingError("No C compiler, says this test of evaluation.")

    monkeypatch.setattr(open_kernel, "compile_form", refuse)
    monkeypatch.setattr(evaluation, "COMPILE_AFTER", 10)
    f, (x, t) = swinging(), numbers(20)
    with pytest.warns(interpreted.CompilerMissing, match="says this test of evaluation"):
        many = f.batch(x, t)
    assert not is_compiled(f)
    for k in range(20):
        np.testing.assert_array_equal(f(x[k], t[k])[0], many[0][k])


@pytest.mark.usefixtures("soon")
def test_a_kernel_of_one() -> None:
    f, (x, t) = swinging(), numbers(20)
    exact = f.kernel(math="libm")
    assert f.kernel(math="libm") is exact
    assert exact.record.libm == ("cos", "exp", "sin")
    np.testing.assert_array_equal(exact.batch(x, t)[0], f.batch(x, t)[0])
    own = f.kernel()
    assert own.record.libm == ()
    np.testing.assert_allclose(own.batch(x, t)[0], f.batch(x, t)[0], rtol=1e-13, atol=1e-13)
    single = f.kernel(real="float")
    assert single.batch(x, t)[0].dtype == np.float32
    np.testing.assert_allclose(single.batch(x, t)[1], f.batch(x, t)[1], rtol=1e-5, atol=1e-5)
    with pytest.raises(InputError, match="`real` must be 'double' or 'float', got 'half'"):
        f.kernel(real="half")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`math` must be 'own' or 'libm', got 'fast'"):
        f.kernel(math="fast")  # type: ignore[arg-type]


def test_its_c_source() -> None:
    text = swinging().c_source()
    assert "swinging_call(" in text
    assert "#define OS_REAL_IS_FLOAT" in swinging().c_source(real="float")
    assert "sin(" in swinging().c_source(math="libm")
    with pytest.raises(InputError, match=r"`target` must be 'host', got 'cortex-m4'\. Flight code"):
        swinging().c_source("cortex-m4")
