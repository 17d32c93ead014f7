"""Kernels opened by definition: warm without CasADi, made again when a file changes, carried to other processes."""

import json
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kernel_examples import bits, equations, forget, needs_compiler, samples, turning, use_form

from optsat.errors import InputError
from optsat.kernels import folders, index, open_kernel, processor
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import KernelChangedError, make_kernel
from optsat.kernels.request import Request
from optsat.kernels.toolchain import CompilerMissingError

HERE = str(Path(__file__).parent)


@pytest.fixture(autouse=True)
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache; definitions can be imported here and in other processes."""
    needs_compiler()
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "own"))
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0")
    monkeypatch.syspath_prepend(HERE)
    forget_what_was_seen()
    yield tmp_path / "own"
    monkeypatch.undo()
    forget_what_was_seen()


def forget_what_was_seen() -> None:
    """As in a new process."""
    forget(index._machine_of, index._was_unchanged, index._is_of_this_installation)


def opened(name: str, **options: Any) -> Kernel:
    return open_kernel.open_kernel(f"kernel_definitions:{name}", **options)


def count_builds(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    built: list[str] = []
    really = Request.build

    def counted(self: Request) -> Any:
        built.append(self.definition)
        return really(self)

    monkeypatch.setattr(Request, "build", counted)
    return built


def test_a_definition_is_built_once(monkeypatch: pytest.MonkeyPatch) -> None:
    built = count_builds(monkeypatch)
    first, again = opened("turned"), opened("turned")
    assert built == ["kernel_definitions:turned"]
    assert again.record == first.record
    assert again.c_text == first.c_text
    x, J, t = (each[0] for each in samples(1))
    assert [bits(r) for r in again(x, J, t)] == [bits(r) for r in make_kernel(turning())(x, J, t)]


def test_parameters_and_choices_are_part_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    built = count_builds(monkeypatch)
    keys = {
        opened("turned").record.key,
        opened("turned", gain=2.0).record.key,
        opened("turned", gain=np.float64(3.0)).record.key,
        opened("turned", real="float").record.key,
        opened("solved", n=4).record.key,
    }
    assert len(keys) == len(built) == 5
    assert opened("turned", gain=2.0).record.key in keys
    assert len(built) == 5


def test_a_template_opens_warm_too() -> None:
    A, b = equations(3)
    first, again = opened("solved"), opened("solved")
    assert first(A[1], b[1])[2] == again(A[1], b[1])[2] == 0


_WARM = """
import sys, time
sys.path[:0] = [{here!r}]
import numpy as np
from optsat.kernels.open_kernel import open_kernel
kernel = open_kernel("kernel_definitions:turned", gain=2.0)
y = kernel.batch(np.ones((4, 3)), np.ones((3, 2)), 0.0)[0]
assert kernel.is_compiled and y.tolist() == [[6.0, 6.0]] * 4, y
heavy = {{"casadi", "ctypes", "subprocess", "scipy", "kernel_definitions"}} & set(sys.modules)
print(sorted(heavy - {allowed}))
"""


def test_a_warm_start_imports_no_casadi_and_no_definition(root: Path) -> None:
    opened("turned", gain=2.0)
    # numpy itself imports ctypes
    program = _WARM.format(here=HERE, allowed='{"ctypes", "subprocess"}')
    environment = {**os.environ, "PYTHONPATH": str(root)}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr


def notes(own: Path) -> list[Path]:
    return list(own.glob("index/*/*.json"))


def test_a_changed_file_makes_it_built_again(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    built = count_builds(monkeypatch)
    opened("turned")
    (note,) = notes(own)
    first, installed = note.read_bytes().splitlines()
    document = json.loads(first)
    names = {Path(path).name for path, *_ in document["files"]}
    assert {"kernel_definitions.py", "casadi.py"} <= names
    assert not {"generated_function.py", "os_rt.h"} & names
    names |= {Path(path).name for path, *_ in json.loads(installed)}
    assert {"kernel_definitions.py", "generated_function.py", "os_rt.h", "casadi.py", "cholesky_solve.c"} <= names
    copy = tmp_path / "file.py"
    copy.write_text("a = 1\n")
    document["files"].append(index._described(str(copy)))
    note.write_bytes(json.dumps(document).encode() + b"\n" + installed)
    opened("turned")
    assert len(built) == 1
    os.utime(copy, (1, 1))  # another time, the same text
    opened("turned")
    assert len(built) == 1
    copy.write_text("a = 2\n")
    opened("turned")
    assert len(built) == 2


def test_files_of_optsat_are_looked_at_once_in_a_process(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(index, "_HOME", str(tmp_path))
    part = tmp_path / "part.py"
    part.write_text("a = 1\n")
    monkeypatch.setattr(index, "_files", lambda _wanted: [str(part)])
    built = count_builds(monkeypatch)
    opened("turned")
    (note,) = notes(own)
    assert json.loads(note.read_bytes().splitlines()[0])["files"] == []
    opened("turned")
    part.write_text("a = 2, longer\n")
    opened("turned")
    assert len(built) == 1
    forget_what_was_seen()
    opened("turned")
    assert len(built) == 2
    # what was written since is a file of its own, and holds from now on
    opened("turned")
    assert len(built) == 2


def test_the_compiler_is_looked_for_again_in_another_environment(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key = opened("turned").record.key
    monkeypatch.setenv("CC", "/nonexistent")
    assert opened("turned").record.key == key
    monkeypatch.delenv("CC")
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0 -DOTHER")
    assert opened("turned").record.key != key
    assert len(notes(own)) == 2


@pytest.mark.parametrize(
    "damage", [b"", b"{", b'{"key": "ab"}', b'{"key": "00", "files": []}\n[]', b"[]", b"[]\n[]", b"{}\n[[]]"]
)
def test_a_damaged_note_is_as_none(damage: bytes, own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key = opened("turned").record.key
    (note,) = notes(own)
    note.write_bytes(damage)
    built = count_builds(monkeypatch)
    assert opened("turned").record.key == key
    assert len(built) == 1


def test_another_machine_or_compiler_has_a_note_of_its_own(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened("turned")
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0 -DOTHER")
    opened("turned")
    monkeypatch.setattr(index, "identity", lambda: "another")
    forget_what_was_seen()
    opened("turned")
    assert len(notes(own)) == 3


def test_without_a_compiler_what_is_there_is_used(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    key = opened("turned").record.key

    def missing(*_arguments: Any) -> Any:
        raise CompilerMissingError("No C compiler, says this test.")

    monkeypatch.setattr(index, "find_compiler", missing)
    forget_what_was_seen()
    kernel = opened("turned")
    assert kernel.is_compiled
    assert kernel.record.key == key


@pytest.mark.parametrize(
    ("definition", "message"),
    [
        ("turned", "A kernel is defined by 'module:function', got 'turned'"),
        ("nowhere_at_all:turned", "nowhere_at_all:turned: No module named 'nowhere_at_all'"),
        ("kernel_definitions:turmed", r"kernel_definitions has no function `turmed`\. Did you mean `turned`"),
        ("kernel_definitions:number", "must return a GeneratedFunction or a KernelSource, got float"),
        ("__main__:f", "a script cannot be imported elsewhere"),
    ],
)
def test_what_is_no_definition_is_refused(definition: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        open_kernel.open_kernel(definition)


def test_parameters_are_plain() -> None:
    with pytest.raises(InputError, match="its parameters must be numbers, texts, lists or arrays"):
        opened("turned", gain=object())


def answer_of(kernel: Kernel) -> list[bytes]:
    x, J, t = (each[0] for each in samples(1))
    return [bits(result) for result in kernel(x, J, t)]


def in_a_fresh_process(kernel: Kernel) -> Any:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(answer_of, (kernel,))


@pytest.mark.parametrize("kind", ["opened", "made"])
def test_a_kernel_travels_to_a_spawned_process(kind: str) -> None:
    kernel = opened("turned") if kind == "opened" else make_kernel(turning())
    assert in_a_fresh_process(kernel) == answer_of(kernel)


def test_a_worker_that_does_not_have_it_makes_it_again(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for kernel in (opened("turned"), make_kernel(turning())):
        sent = pickle.dumps(kernel)
        assert kernel.record.key.encode() in sent
        monkeypatch.setenv(folders.VARIABLE, str(tmp_path / f"worker-{len(sent)}"))
        found = pickle.loads(sent)
        assert found.is_compiled
        assert answer_of(found) == answer_of(kernel)
        monkeypatch.setenv(folders.VARIABLE, str(own))


def test_an_opened_kernel_travels_light() -> None:
    assert len(pickle.dumps(opened("turned"))) < 600


def test_a_kernel_that_is_defined_otherwise_there_is_refused(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = pickle.dumps(opened("differs_by_process"))
    (tmp_path / "sent").write_bytes(sent)
    program = f"import sys, pickle; sys.path[:0] = [{HERE!r}]; pickle.load(open({str(tmp_path / 'sent')!r}, 'rb'))"
    root = str(Path(open_kernel.__file__).parents[2])
    environment = {
        **os.environ,
        "PYTHONPATH": root,
        folders.VARIABLE: str(tmp_path / "worker"),
        "GAIN_OF_THE_TEST": "2",
    }
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    said = "kernel_definitions:differs_by_process gives another kernel here"
    assert f"{KernelChangedError.__name__}: {said}" in done.stderr


def test_an_interpreted_kernel_travels(monkeypatch: pytest.MonkeyPatch) -> None:
    use_form("interpreted", monkeypatch)
    monkeypatch.setattr("optsat.kernels.interpreted._warn_once", lambda _reason: None)
    kernel = make_kernel(turning())
    assert answer_of(pickle.loads(pickle.dumps(kernel))) == answer_of(kernel)
    with pytest.raises(CompilerMissingError):
        make_kernel(turning(), real="float")


def test_no_compiler_in_earnest(root: Path, tmp_path: Path) -> None:
    program = f"""
import sys, warnings
sys.path[:0] = [{HERE!r}]
warnings.simplefilter("error")
from kernel_examples import equations, samples, solving, turning
from optsat.kernels.interpreted import CompilerMissing
from optsat.kernels.open_kernel import make_kernel
warnings.simplefilter("always", CompilerMissing)
with warnings.catch_warnings(record=True) as caught:
    kernels = make_kernel(turning()), make_kernel(solving())
assert [kernel.form for kernel in kernels] == ["casadi", "python"]
assert len(caught) == 1 and "CC names /nonexistent" in str(caught[0].message), caught
print(kernels[0].batch(*samples(5))[0].tobytes().hex(), kernels[1].batch(*equations(5))[2].tolist())
"""
    environment = {**os.environ, "PYTHONPATH": str(root), "CC": "/nonexistent"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    expected = make_kernel(turning()).batch(*samples(5))[0].tobytes().hex()
    assert done.stdout.strip() == f"{expected} [4, 0, 0, 4, 0]"


def _in_a_child(kernel: Kernel, write: int) -> None:
    os.write(write, b"".join(answer_of(kernel)))
    os._exit(0)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork on this system")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
def test_a_loaded_kernel_survives_fork() -> None:
    kernel = opened("turned")
    kernel.batch(*samples(3000), threads=2)
    read, write = os.pipe()
    if (child := os.fork()) == 0:
        _in_a_child(kernel, write)
    os.close(write)
    with os.fdopen(read, "rb") as stream:
        said = stream.read()
    assert os.waitpid(child, 0)[1] == 0
    assert said == b"".join(answer_of(kernel))


def test_many_threads_call_one_kernel() -> None:
    kernel = opened("turned")
    x, J, t = samples(200)
    expected = [[bits(r) for r in kernel(x[k], J[k], t[k])] for k in range(200)]
    wrong: list[int] = []

    def call(first: int) -> None:
        found = ((k, [bits(r) for r in kernel(x[k], J[k], t[k])]) for k in range(first, 200))
        wrong.extend(k for k, answer in found if answer != expected[k])

    threads = [threading.Thread(target=call, args=(first,)) for first in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_denormal_numbers_must_not_be_flushed(monkeypatch: pytest.MonkeyPatch) -> None:
    processor.check_denormals()

    class Flushed:
        """An array of a processor that replaces denormal numbers by zero."""

        def __init__(self, values: list[float]) -> None:
            self.values = values

        def __mul__(self, factor: float) -> list[float]:
            return [0.0 for _ in self.values]

    monkeypatch.setattr(np, "array", Flushed)
    with pytest.raises(processor.DenormalsFlushedError, match="linked with -ffast-math"):
        processor.check_denormals()
