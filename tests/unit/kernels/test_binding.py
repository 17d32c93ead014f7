"""The binding alone: arguments that no caller of ours gives it are refused, never believed."""

import array
import sys
from collections.abc import Callable
from importlib import util
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np
import pytest
from kernel_examples import doubled, needs_compiler

from optsat.kernels import folders
from optsat.kernels.binding import find_binding
from optsat.kernels.bound_form import MAX_PORTS
from optsat.kernels.entry import Entry
from optsat.kernels.form import STATUSES
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.unit import ABI
from optsat.port import Port
from optsat.symbolic.generated_function import generate


@pytest.fixture
def bind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """`bind` on a library of one argument (3,) and one result (3,)."""
    needs_compiler()
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "own"))
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0")
    found = find_binding()
    if found is None:
        pytest.skip("the binding is neither installed nor can it be compiled here")
    library = str(Entry(tmp_path / "own", make_kernel(doubled()).record).library)

    def bound(**changed: Any) -> Any:
        usual: dict[str, Any] = {
            "path": library,
            "name": "doubled",
            "abi": ABI,
            "is_float": False,
            "inputs": ((3,),),
            "outputs": ((3,),),
            "statuses": None,
            "convert": lambda _arguments, _by_name: (np.zeros(3),),
        }
        return found[0].bind(*(usual | changed).values())

    return bound


def test_it_gives_call_and_run(bind: Callable[..., Any]) -> None:
    call, run, width, has_tiles = bind()
    assert call(np.arange(3.0)).tolist() == [0.0, 2.0, 4.0]
    x, y = np.arange(60.0).reshape(20, 3), np.zeros((20, 3))
    assert run(False, 5, 20, 20, (x, y), None) == (0, -1)
    np.testing.assert_array_equal(y[5:], 2 * x[5:])
    assert not y[:5].any()
    assert has_tiles == (width > 1)


@pytest.mark.parametrize(
    ("changed", "error", "message"),
    [
        ({"path": "/nonexistent.so"}, OSError, "nonexistent"),
        ({"name": "tripled"}, OSError, "holds no kernel tripled"),
        ({"name": "d" * 300}, OSError, "holds no kernel"),
        ({"abi": ABI + 1}, OSError, f"speaks ABI {ABI}, not {ABI + 1}"),
        ({"inputs": ((3, 3, 3),)}, ValueError, "a tuple of at most two lengths"),
        ({"inputs": (3,)}, ValueError, "a tuple of at most two lengths"),
        ({"inputs": ((0,),)}, ValueError, "a length must be at least 1"),
        ({"inputs": (("a",),)}, TypeError, "an integer is required"),
        ({"outputs": ()}, ValueError, "from one result to 64 ports"),
        ({"inputs": ((1,),) * MAX_PORTS}, ValueError, "has 65 ports"),
        ({"inputs": [(3,)]}, TypeError, "tuple"),
    ],
)
def test_what_is_no_kernel_is_refused(
    changed: dict[str, Any], error: type[Exception], message: str, bind: Callable[..., Any]
) -> None:
    with pytest.raises(error, match=message):
        bind(**changed)


def test_ranges_and_arrays_are_checked(bind: Callable[..., Any]) -> None:
    _, run, _, has_tiles = bind()
    x, y = np.zeros((20, 3)), np.zeros((20, 3))
    for arguments, message in (
        ((False, 0, 20, 20, (x,), None), "wrong number of arrays"),
        ((False, 0, 20, 20, (x, y, y), None), "wrong number of arrays"),
        ((False, -1, 20, 20, (x, y), None), "a range beyond the samples"),
        ((False, 0, 21, 20, (x, y), None), "a range beyond the samples"),
        ((False, 9, 8, 20, (x, y), None), "a range beyond the samples"),
        ((False, 0, 20, 20, (x[:19], y), None), "array 0 is not contiguous"),
        ((False, 0, 20, 20, (x, y[:19]), None), "array 1 is not contiguous"),
        ((False, 0, 20, 20, (x[:, ::-1], y), None), "array 0 is not contiguous"),
        ((False, 0, 20, 20, (x.astype(">f8"), y), None), "array 0 is not contiguous"),
        ((False, 0, 20, 20, (x.astype(np.float32), y), None), "array 0 is not contiguous"),
        ((False, 0, 20, 20, (x, bytes(480)), None), "array 1 is not contiguous"),
        ((False, 0, 20, 20, (x, "text"), None), "array 1 is not contiguous"),
        ((False, 0, 20, 20, (x, x), None), "arrays 0 and 1 share memory"),
        ((False, 0, 20, 20, (x, y), np.zeros(20)), "statuses must be 32-bit"),
        ((False, 0, 20, 20, (x, y), np.zeros(20, np.float32)), "statuses must be 32-bit"),
        ((False, 0, 20, 20, (x, y), np.zeros(20, np.uint32)), "statuses must be 32-bit"),
        ((False, 0, 20, 20, (x, y), np.zeros(40, np.int32)[::2]), "statuses must be 32-bit"),
        ((False, 0, 20, 20, (x, y), np.zeros(19, np.int32)), "statuses must be 32-bit"),
        ((False, 0, 20, 20, (x, y), bytes(80)), "statuses must be 32-bit"),
    ):
        with pytest.raises(ValueError, match=message):
            run(*arguments)
    frozen = np.zeros((20, 3))
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="array 1 is not contiguous"):
        run(False, 0, 20, 20, (x, frozen), None)
    if not has_tiles:
        with pytest.raises(ValueError, match="no form in tiles"):
            run(True, 0, 5, 5, (x, y), None)


def test_only_what_can_be_read_in_place_is_not_converted(bind: Callable[..., Any]) -> None:
    converted: list[Any] = []

    def convert(arguments: Any, _by_name: Any) -> Any:
        converted.append(arguments[0])
        return (np.ones(3),)

    class Own(np.ndarray):
        """A subclass, whose numbers may mean something else."""

    call = bind(convert=convert)[0]
    bytes_apart = np.zeros(25, np.uint8)[1:].view(np.float64)
    taken = [np.arange(3.0), np.arange(6.0).reshape(2, 3)[1], np.arange(3.0, dtype="=f8"), np.frombuffer(bytes(24))]
    for each in taken:
        np.testing.assert_array_equal(call(each), 2 * each)
    assert converted == []
    elsewhere: list[Any] = [np.zeros(6)[::2], np.zeros(3)[::-1], bytes_apart]
    other_reals = [np.zeros(3, kind) for kind in (">f8", np.float32, np.int64, complex, object)]
    shaped = [np.zeros((3, 1)), np.zeros(4), np.zeros(())]
    kinds: list[Any] = [np.zeros(3).view(Own), np.ma.zeros(3), [0.0] * 3, array.array("d", [0.0] * 3), 0.0]
    others = [*elsewhere, *other_reals, *shaped, *kinds, np.array([0.0, np.inf, 0.0])]
    for other in others:
        assert call(other).tolist() == [2.0, 2.0, 2.0]
    assert len(converted) == len(others)


def test_results_are_new_arrays_that_own_their_memory(bind: Callable[..., Any]) -> None:
    call = bind()[0]
    first, second = call(np.ones(3)), call(np.zeros(3))
    assert type(first) is np.ndarray
    assert first.dtype == np.float64
    assert first.flags.owndata
    assert first.flags.carray
    assert first.tolist() == [2.0, 2.0, 2.0]
    assert second.tolist() == [0.0, 0.0, 0.0]


def test_calls_leave_no_reference_behind(bind: Callable[..., Any]) -> None:
    call, run, _, _ = bind(statuses=STATUSES)
    argument, rows, results = np.ones(3), np.ones((20, 3)), np.ones((20, 3))
    counted = (argument, rows, results, argument.dtype, STATUSES[0])
    before = [sys.getrefcount(each) for each in counted]
    for _ in range(100):
        call(argument)
        run(False, 0, 20, 20, (rows, results), None)
    found = call(argument)[0]
    assert sys.getrefcount(found) == 2
    del found
    assert [sys.getrefcount(each) for each in counted] == before


def test_it_does_not_load_beside_another_numpy(bind: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    bind()
    found = find_binding()
    assert found is not None
    spec = util.spec_from_file_location("optsat.kernels._binding", found[0].__file__)
    assert spec is not None
    assert spec.loader is not None
    for name in ("numpy._core._multiarray_umath", "numpy.core._multiarray_umath"):
        monkeypatch.setitem(sys.modules, name, ModuleType(name))
    with pytest.raises(ImportError, match="compiled for another NumPy"):
        spec.loader.exec_module(util.module_from_spec(spec))
    monkeypatch.undo()


def test_a_conversion_is_not_believed(bind: Callable[..., Any]) -> None:
    for wrong in ((), [np.zeros(3)], (np.zeros(4),), (np.full(3, np.nan),), None):
        call = bind(convert=lambda _arguments, _by_name, given=wrong: given)[0]
        with pytest.raises(SystemError, match="arguments that the kernel does not take"):
            call([1, 2, 3])

    def refuse(_arguments: Any, _by_name: Any) -> Any:
        raise KeyError("says this test")

    with pytest.raises(KeyError, match="says this test"):
        bind(convert=refuse)[0](x=1)


def test_the_conversion_is_told_all_arguments(bind: Callable[..., Any]) -> None:
    told: list[Any] = []

    def convert(arguments: Any, by_name: Any) -> Any:
        told.append((arguments, by_name))
        return (np.ones(3),)

    call = bind(convert=convert)[0]
    assert call(1, "a", x=2, y=3).tolist() == [2.0, 2.0, 2.0]
    assert call().tolist() == [2.0, 2.0, 2.0]
    assert told == [((1, "a"), {"x": 2, "y": 3}), ((), {})]


def test_a_status_beyond_the_known_ones_is_an_error(bind: Callable[..., Any]) -> None:
    call = bind(statuses=STATUSES)[0]
    assert call(np.ones(3))[1] is STATUSES[0]
    with pytest.raises(IndexError):
        bind(statuses=())[0](np.ones(3))


def test_more_ports_than_it_has_room_for_go_another_way() -> None:
    needs_compiler()
    symbols = [ca.SX.sym(f"x{k}") for k in range(MAX_PORTS)]
    ports = [Port(f"x{k}", (), "-") for k in range(MAX_PORTS)]
    total = generate(
        "total", list(zip(ports, symbols, strict=True)), [(Port("sum", (), "-"), ca.sum1(ca.vertcat(*symbols)))]
    )
    kernel = make_kernel(total)
    assert kernel.form == "ctypes"
    assert kernel(*range(MAX_PORTS)) == sum(range(MAX_PORTS))
