"""Drivers: batches of any length, shared arguments, resident tiles; nothing read or written beyond the arrays."""

import ctypes
import mmap
import re
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from kernel_harness import any_compiler, on_machine
from library_harness import Library, source_of

from optsat.errors import InputError
from optsat.kernels import unit
from optsat.kernels.float_constants import check_float_constants
from optsat.kernels.leaf import leaf_source
from optsat.kernels.linear import cholesky_solve
from optsat.kernels.lowering import lower
from optsat.kernels.unit import library_text
from optsat.port import Port

WIDTHS = (1, 2, 4, 8)


def model() -> ca.Function:
    """A vector, a matrix and a scalar in; a matrix, a scalar and a vector out."""
    v, M, s = ca.SX.sym("v", 3), ca.SX.sym("M", 2, 3), ca.SX.sym("s")
    length = ca.sqrt(ca.dot(v, v))
    outputs = [M * s + ca.repmat(v.T, 2, 1), length / (1 + s * s), M @ v - s]
    return ca.Function("model", [v, M, s], outputs, ["v", "M", "s"], ["A", "b", "c"])


@pytest.fixture(scope="module", params=WIDTHS)
def library(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Library:
    return Library(source_of(model()), any_compiler(), tmp_path_factory.mktemp("drivers"), request.param)


def arguments(rng: np.random.Generator, n: int) -> list[Any]:
    return [rng.normal(size=(n, 3)), rng.normal(size=(n, 2, 3)), rng.normal(size=(n, 1))]


def expected(given: list[Any], n: int) -> list[Any]:
    """By CasADi, whose matrices are counted by columns."""
    v, M, s = (np.broadcast_to(a, (n, *a.shape[1:])) for a in given)
    x = np.concatenate([v, M.swapaxes(1, 2).reshape(n, 6), s], axis=1)
    y = on_machine(model(), x) if n else np.zeros((0, 9))
    return [y[:, :6].reshape(n, 3, 2).swapaxes(1, 2).reshape(n, 6), y[:, 6:7], y[:, 7:]]


def assert_same(found: list[Any], wanted: list[Any]) -> None:
    for f, w in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(f, w)


def lengths(width: int) -> set[int]:
    return {0, 1, width - 1, width, width + 1, 2 * width + 1, 1025}


def test_a_batch_of_any_length_is_what_casadi_computes(library: Library) -> None:
    for n in sorted(lengths(library.width)):
        given = arguments(np.random.default_rng(n), n)
        status = np.full(n, 9, np.int32)
        assert_same(library.batch(n, given, (3, 6, 1), status), expected(given, n))
        assert not status.any()


@pytest.mark.parametrize("shared", [(0,), (1,), (2,), (0, 2), (0, 1, 2)])
def test_shared_arguments_are_read_once_for_all(shared: tuple[int, ...], library: Library) -> None:
    n = 2 * library.width + 1
    given = arguments(np.random.default_rng(3), n)
    for k in shared:
        given[k] = given[k][:1]
    strides = [0 if k in shared else size for k, size in enumerate((3, 6, 1))]
    assert_same(library.batch(n, given, strides), expected(given, n))


def test_samples_may_stand_apart(library: Library) -> None:
    n = library.width + 1
    wide = np.random.default_rng(4).normal(size=(n, 5))
    given = arguments(np.random.default_rng(5), n)
    found = library.batch(n, [wide, *given[1:]], (5, 6, 1))
    assert_same(found, expected([wide[:, :3], *given[1:]], n))


def test_a_call_is_a_batch_of_one_and_may_overwrite_its_arguments(library: Library) -> None:
    given = arguments(np.random.default_rng(6), 1)
    status, found = library.call(given)
    assert status == 0
    assert_same([f[np.newaxis] for f in found], expected(given, 1))
    square = ca.SX.sym("x", 3)
    function = ca.Function("turned", [square], [ca.vertcat(square[2], square[0], square[1] + square[0])])
    x = np.array([1.0, 2.0, 3.0])
    other = Library(source_of(function), any_compiler(), Path(library.library._name).parent)
    pointers = (ctypes.c_void_p * 1)(x.ctypes.data)
    other.library.turned_call(pointers, pointers)
    np.testing.assert_array_equal(x, [3.0, 1.0, 3.0])


def test_a_single_sample_of_a_large_kernel_runs_through_the_lanes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(unit, "LANES_ALONE", 0)
    source = source_of(model())
    assert "model_leaf" not in library_text(source, width=4)
    given = arguments(np.random.default_rng(9), 5)
    library = Library(source, any_compiler(), tmp_path, 4)
    status, found = library.call([a[:1] for a in given])
    assert status == 0
    assert_same([f[np.newaxis] for f in found], expected([a[:1] for a in given], 1))
    assert_same(library.batch(5, given, (3, 6, 1)), expected(given, 5))


def test_resident_tiles_hold_the_same_numbers(library: Library) -> None:
    if library.width == 1:
        assert not hasattr(library.library, "model_tiles")
        return
    width, tiles = library.width, 3
    given = arguments(np.random.default_rng(7), width * tiles)
    resident = [tiled(a.reshape(width * tiles, -1), width) for a in given]
    found = library.tiles(tiles, resident, [a[0].size for a in resident])
    assert_same([untiled(f) for f in found], expected(given, width * tiles))
    one = [resident[0][:1], *resident[1:]]
    shared = library.tiles(tiles, one, (0, *(a[0].size for a in resident[1:])))
    repeated = [np.tile(given[0][:width], (tiles, 1)), *given[1:]]
    assert_same([untiled(f) for f in shared], expected(repeated, width * tiles))


def test_tiles_may_stand_at_any_address_of_a_number(library: Library) -> None:
    if library.width == 1:
        return
    width = library.width
    given = arguments(np.random.default_rng(8), width)
    resident = [off_by_one(tiled(a.reshape(width, -1), width)) for a in given]
    found = library.tiles(1, resident, (0, 0, 0))
    assert_same([untiled(f) for f in found], expected(given, width))


def tiled(samples: Any, width: int) -> Any:
    return np.ascontiguousarray(samples.reshape(-1, width, samples.shape[1]).swapaxes(1, 2))


def untiled(tiles: Any) -> Any:
    return tiles.swapaxes(1, 2).reshape(-1, tiles.shape[1])


def off_by_one(array: Any) -> Any:
    room = np.zeros(array.size + 1)
    room[1:] = array.ravel()
    return room[1:].reshape(array.shape)


def test_nothing_is_read_beyond_the_last_sample(library: Library) -> None:
    """The arrays end where memory that cannot be read begins: a read too far would kill the process."""
    for n in sorted(lengths(library.width) - {0}):
        given = arguments(np.random.default_rng(n), n)
        fenced = [at_the_end_of_memory(a) for a in given]
        assert_same(library.batch(n, [array for array, _ in fenced], (3, 6, 1)), expected(given, n))


def at_the_end_of_memory(array: Any) -> tuple[Any, mmap.mmap]:
    page = mmap.PAGESIZE
    whole = -(-array.nbytes // page) * page
    memory = mmap.mmap(-1, whole + page)
    start = ctypes.addressof(ctypes.c_char.from_buffer(memory))
    copy = np.frombuffer(memory, np.float64, array.size, whole - array.nbytes).reshape(array.shape)
    copy[:] = array
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.mprotect(ctypes.c_void_p(start + whole), ctypes.c_size_t(page), 0) != 0:
        pytest.skip("this system does not fence memory")
    return copy, memory


def test_what_has_a_status_reports_it_by_sample(tmp_path: Path) -> None:
    library = Library(cholesky_solve(2), any_compiler(), tmp_path, 4)
    assert library.width == 1
    A = np.array([[2.0, 0.0, 0.0, 2.0], [1.0, 2.0, 2.0, 1.0], [4.0, 0.0, 0.0, 4.0]])
    b = np.ones((3, 2))
    status = np.full(3, 9, np.int32)
    outputs = [np.zeros((3, 2)), np.zeros((3, 1))]
    function = library.library.cholesky_solve_batch
    function.restype = ctypes.c_int64
    pointers = [(ctypes.c_void_p * 2)(*(array.ctypes.data for array in arrays)) for arrays in ([A, b], outputs)]
    strides = (ctypes.c_int64 * 2)(4, 2)
    failed = function(ctypes.c_int64(3), pointers[0], strides, pointers[1], ctypes.c_void_p(status.ctypes.data))
    assert failed == 1
    assert status.tolist() == [0, 4, 0]
    np.testing.assert_allclose(outputs[0][[0, 2]], [[0.5, 0.5], [0.25, 0.25]])
    assert function(ctypes.c_int64(3), pointers[0], strides, pointers[1], None) == 1


def test_a_width_that_no_compiler_has_is_refused() -> None:
    with pytest.raises(InputError, match="`width` must be one of 1, 2, 4, 8, 16, got 3"):
        library_text(source_of(model()), width=3)


def test_ports_of_another_shape_than_the_program_are_refused() -> None:
    program = lower(model())
    good = [Port("v", (3,), "-"), Port("M", (2, 3), "-"), Port("s", (), "-")]
    with pytest.raises(InputError, match="model: the output ports have shapes"):
        leaf_source(program, good, [Port("A", (3, 2), "-"), Port("b", (), "-"), Port("c", (2,), "-")])


@pytest.mark.parametrize(("constant", "fault"), [(1e300, "overflows"), (1e-300, "underflows")])
def test_constants_that_float_cannot_hold_are_refused(constant: float, fault: str) -> None:
    x = ca.SX.sym("x")
    source = source_of(ca.Function("guarded", [x], [ca.fmax(x, constant)]))
    library_text(source)
    with pytest.raises(InputError, match=re.escape(f"guarded: the constant {constant!r} {fault} in float, in `")):
        library_text(source, "float")
    check_float_constants("guarded", "((os_real_t)0x0p+0) + ((os_real_t)1.5)")
