"""The unscented filter in loops: equal to the unrolled one to rounding, bits of the twin, status, size in flash."""

import shutil
import subprocess
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from kernel_source_harness import STRICT, assert_same_bits, compiled, sanitized, unit_text

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.estimators.attitude_filter import unscented_filter_7
from optsat.estimators.filter_model import FilterModel
from optsat.estimators.unscented import SigmaPoints, unscented_step
from optsat.estimators.unscented_loops import unscented_filter_7_loops, unscented_loops
from optsat.kernels.source import KernelSource
from optsat.kernels.status import Status
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


def model(n: int, m: int, seed: int) -> FilterModel:
    """Rational motion and measurement of n states by m numbers, with one input, without elementary functions."""
    rng = np.random.default_rng(seed)
    x, u = ca.SX.sym("x", n), ca.SX.sym("u")
    A, C = ca.DM(rng.normal(size=(n, n)) / n), ca.DM(rng.normal(size=(m, n)))
    inputs = [(Port("x", (n,), "-"), x), (Port("u", (), "-"), u)]
    moved = x + A @ (x / (1 + x * x)) + u * ca.DM(rng.normal(size=n))
    seen = C @ (x + 0.1 * x * x) + u
    return FilterModel(
        generate("f", inputs, [(Port("x", (n,), "-"), moved)]),
        generate("h", inputs, [(Port("z", (m,), "-"), seen)]),
        ["x"],
    )


def covariance(rng: np.random.Generator, n: int) -> Array:
    root = rng.normal(size=(n, n + 2)) / np.sqrt(n + 2)
    return np.asarray(root @ root.T)


def sample(rng: np.random.Generator, n: int, m: int) -> list[Array]:
    x, u, z = rng.normal(size=n), rng.normal(size=1), rng.normal(size=m)
    return [x, covariance(rng, n), u, z, covariance(rng, n), covariance(rng, m)]


def attitude_sample(rng: np.random.Generator) -> list[Array]:
    q, omega = rng.normal(size=4), 0.1 * rng.normal(size=3)
    q /= np.linalg.norm(q)
    x = np.concatenate([q, omega])
    z = x * rng.choice([1.0, -1.0]) + 1e-2 * rng.normal(size=7)
    z[4:] = omega + 1e-2 * rng.normal(size=3)
    P = 1e-3 * covariance(rng, 7)
    return [x, P, 0.01 * rng.normal(size=3), np.array([0.1]), z, np.full(7, 1e-6), np.full(7, 1e-4)]


def row(arguments: list[Array]) -> Array:
    return np.concatenate([np.ravel(each) for each in arguments])


def expected_of(function: GeneratedFunction, arguments: list[Array]) -> tuple[Array, float]:
    shaped = [np.reshape(each, port.shape) for each, port in zip(arguments, function.inputs, strict=True)]
    *results, definite = function(*shaped)
    return np.concatenate([np.ravel(each) for each in results]), float(definite)


@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 5), (4, 2), (7, 7), (12, 3)])
@pytest.mark.parametrize("points", [SigmaPoints(), SigmaPoints(alpha=0.5, beta=1.0, kappa=2.0)])
def test_it_is_the_unrolled_filter(n: int, m: int, points: SigmaPoints, tmp_path: Path) -> None:
    rng = np.random.default_rng(10 * n + m)
    function, source = unscented_step(model(n, m, n), points=points), unscented_loops(model(n, m, n), points=points)
    call, single = compiled(source, tmp_path), compiled(source, tmp_path, real=np.float32)
    assert [port.name for port in source.inputs] == [port.name for port in function.inputs]
    assert [port.name for port in source.outputs] == [port.name for port in function.outputs][:-1]
    for _ in range(10):
        arguments = sample(rng, n, m)
        expected, definite = expected_of(function, arguments)
        status, y = call(row(arguments))
        assert (status, definite) == (Status.OK, 1.0)
        np.testing.assert_allclose(y, expected, rtol=1e-9, atol=1e-11)
        P = y[n : n + n * n].reshape(n, n)
        np.testing.assert_array_equal(P, P.T)
        status, y_single = single(row(arguments))
        assert status == Status.OK
        np.testing.assert_allclose(y_single, expected, rtol=5e-2, atol=5e-3 * (1.0 + np.abs(expected).max()))


def test_the_attitude_filter_is_the_unrolled_one(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    function, source = unscented_filter_7(), unscented_filter_7_loops()
    call = compiled(source, tmp_path)
    for _ in range(20):
        arguments = attitude_sample(rng)
        expected, definite = expected_of(function, arguments)
        status, y = call(row(arguments))
        assert (status, definite) == (Status.OK, 1.0)
        np.testing.assert_allclose(y, expected, rtol=1e-9, atol=1e-12)


def _but_for_the_logarithm(found: tuple[int, Array], expected: tuple[int, Array]) -> None:
    assert_same_bits((found[0], found[1][:-1]), (expected[0], expected[1][:-1]))
    np.testing.assert_allclose(found[1][-1], expected[1][-1], rtol=1e-14, atol=1e-14)


def _samples(rng: np.random.Generator, source: KernelSource, n: int, m: int) -> list[Array]:
    attitude = source.name == "unscented_filter_7_loops"
    good = [row(attitude_sample(rng) if attitude else sample(rng, n, m)) for _ in range(4)]
    values = [np.nan, np.inf, 0.0, -0.0, -1.0, 1e200]
    hostile = []
    for x in good:
        for _ in range(3):
            bad = x.copy()
            bad[rng.integers(len(x))] = rng.choice(values)
            hostile.append(bad)
    return good + hostile


@pytest.mark.parametrize(("n", "m"), [(1, 2), (5, 3), (7, 7)])
def test_every_form_has_the_bits_of_the_twin(n: int, m: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(20 + n)
    source = unscented_filter_7_loops() if m == 7 else unscented_loops(model(n, m, 3), noise="full")
    assert source.twin is not None
    samples = _samples(rng, source, n, m)
    twins = [source.twin(x) for x in samples]
    assert {status for status, _ in twins} >= {Status.OK, Status.NOT_FINITE}
    for compiler, level in (("gcc", "-O0"), ("gcc", "-O3"), ("clang", "-O2")):
        call = compiled(source, tmp_path, compiler, level)
        for x, expected in zip(samples, twins, strict=True):
            _but_for_the_logarithm(call(x), expected)
    for found, expected in zip(sanitized(source, np.array(samples), tmp_path), twins, strict=True):
        _but_for_the_logarithm(found, expected)


def test_what_is_no_covariance_is_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    call = compiled(unscented_loops(model(3, 2, 1)), tmp_path)
    for place, value in ((1, -np.eye(3)), (1, np.zeros((3, 3))), (4, -9.0 * np.eye(3)), (5, -99.0 * np.eye(2))):
        arguments = sample(rng, 3, 2)
        arguments[place] = value
        status, y = call(row(arguments))
        assert status == Status.STATE
        assert np.isnan(y).all()
    arguments = sample(rng, 3, 2)
    arguments[0] = np.array([1e200, 0.0, 0.0])
    status, y = call(row(arguments))
    assert status in (Status.OUTPUT, Status.STATE)
    assert np.isnan(y).all()


def test_options_that_make_no_filter_are_refused() -> None:
    with pytest.raises(InputError, match="`noise` must be 'full' or 'diagonal', got 'none'"):
        unscented_loops(model(2, 1, 1), noise="none")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="give no sigma points of 2 states"):
        unscented_loops(model(2, 1, 1), points=SigmaPoints(kappa=-2.0))


def test_seven_states_in_float_fit_in_ten_kilobytes(tmp_path: Path) -> None:
    compiler, size = shutil.which("arm-none-eabi-gcc"), shutil.which("arm-none-eabi-size")
    if compiler is None or size is None:
        pytest.skip("arm-none-eabi-gcc is not on the path")
    from importlib import resources

    path = tmp_path / "filter.o"
    core = ["-mcpu=cortex-m4", "-mthumb", "-mfpu=fpv4-sp-d16", "-mfloat-abi=hard", "-Os", "-DOS_REAL_IS_FLOAT"]
    subprocess.run(
        [compiler, *core, *STRICT, f"-I{resources.files('optsat.kernels.c')}", "-x", "c", "-", "-c", "-o", str(path)],
        input=unit_text(unscented_filter_7_loops()),
        text=True,
        check=True,
    )
    done = subprocess.run([size, str(path)], capture_output=True, text=True, check=True)
    text, data, bss = (int(word) for word in done.stdout.splitlines()[1].split()[:3])
    assert (data, bss) == (0, 0)
    assert 1_000 < text <= 10_240
