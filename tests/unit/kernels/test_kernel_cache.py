"""The cache of compiled kernels: whole, safe and self-healing, whatever happens to its files and folders."""

import logging
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from kernel_examples import forget, needs_compiler, samples, turning

from optsat.files import write_atomically
from optsat.kernels import binding, cache, compilation, fingerprint, folders, open_kernel, upkeep
from optsat.kernels import entry as entry_file
from optsat.kernels.entry import DAY, BadEntryError, Entry, read_entry
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.record import KernelRecord
from optsat.kernels.toolchain import find_compiler

AS_ROOT = os.getuid() == 0


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and spare folders that are empty too."""
    needs_compiler()
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "own"))
    monkeypatch.setattr(folders, "spare_folders", lambda: iter([tmp_path / "spare"]))
    forget(folders._warn_once)
    # what is compiled here is compiled often
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0")
    monkeypatch.setattr(open_kernel, "lane_width", lambda _real: 1)
    return tmp_path / "own"


def compile_again(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Count what is compiled from now on."""
    compiled: list[str] = []
    really = compilation._library

    def counted(compiler: object, text: str, optimisation: str) -> bytes:
        compiled.append(text)
        return really(compiler, text, optimisation)  # type: ignore[arg-type]

    monkeypatch.setattr(compilation, "_library", counted)
    return compiled


def entry_of(folder: Path, kernel: Kernel) -> Entry:
    found = read_entry(folder, kernel.record.key)
    assert found is not None
    return found


def answer(kernel: Kernel) -> bytes:
    x, J, t = (each[0] for each in samples(1))
    return b"".join(np.asarray(result).tobytes() for result in kernel(x, J, t))


def test_a_kernel_is_compiled_once(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = make_kernel(turning())
    compiled = compile_again(monkeypatch)
    again = make_kernel(turning())
    assert compiled == []
    assert again.record == first.record
    assert answer(again) == answer(first)
    assert len(list(upkeep.entries(own))) >= 1


def test_its_record_says_what_it_is(own: Path) -> None:
    record = make_kernel(turning()).record
    assert KernelRecord.from_json(record.to_json()) == record
    assert record.inputs == turning().inputs
    assert "-ffp-contract=off" in record.flags
    assert not any("native" in flag for flag in (*record.flags, *record.target))
    assert record.libm == ()
    assert record.operations > 10
    entry = read_entry(own, record.key)
    assert entry is not None
    assert entry.is_sound()
    assert compilation.digest_of(entry.text() or "") == record.text
    assert entry.size() > 5000


def test_everything_that_matters_is_in_the_key(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    keys = {make_kernel(turning()).record.key, make_kernel(turning(2.0)).record.key}
    keys.add(make_kernel(turning(), real="float").record.key)
    monkeypatch.setenv("OPTSAT_CFLAGS", "-O0 -DOTHER")
    keys.add(make_kernel(turning()).record.key)
    monkeypatch.setattr(compilation, "c_library", lambda: "another 1.0")
    keys.add(make_kernel(turning()).record.key)
    monkeypatch.setattr(compilation, "ABI", 2)
    text = make_kernel(turning()).record.text
    assert len(keys) == 5
    assert compilation._key(text, (), fingerprint.fingerprint(find_compiler())) not in keys


def test_what_is_compiled_is_only_for_the_user(own: Path) -> None:
    previous = os.umask(0)
    try:
        entry = entry_of(own, make_kernel(turning()))
    finally:
        os.umask(previous)
    for path in (own, entry.library.parent, entry.library, entry.library.with_suffix(".record")):
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0


@pytest.mark.parametrize("damage", ["half", "flipped", "empty", "garbage", "missing"])
@pytest.mark.parametrize("part", ["library", "record"])
def test_a_damaged_entry_is_made_again(
    damage: str, part: str, own: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    kernel = make_kernel(turning(3.0))
    expected = answer(kernel)
    entry = entry_of(own, kernel)
    path = entry.library if part == "library" else entry.library.with_suffix(".record")
    data = path.read_bytes()
    # a new file, as the old one is mapped into this process
    path.unlink()
    flipped = bytearray(data)
    flipped[len(data) // 2] ^= 0x10
    kinds = {"half": data[: len(data) // 2], "flipped": bytes(flipped), "empty": b"", "garbage": b"?" * 99}
    if damage != "missing":
        path.write_bytes(kinds[damage])
    compiled = compile_again(monkeypatch)
    with caplog.at_level(logging.WARNING):
        again = make_kernel(turning(3.0))
    assert len(compiled) == 1
    assert answer(again) == expected
    assert entry_of(own, again).is_sound()
    said = [record.message for record in caplog.records if "is made again" in record.message]
    assert len(said) == (0 if (part, damage) == ("record", "missing") else 1)


def test_a_record_of_another_kernel_is_refused(own: Path) -> None:
    one, other = make_kernel(turning(1.0)), make_kernel(turning(2.0))
    first, second = entry_of(own, one), entry_of(own, other)
    second.library.with_suffix(".record").write_bytes(first.library.with_suffix(".record").read_bytes())
    with pytest.raises(BadEntryError, match="belongs to another kernel"):
        read_entry(own, other.record.key)


def test_a_library_replaced_while_it_is_loaded_is_refused(own: Path) -> None:
    entry = entry_of(own, make_kernel(turning()))

    def replacing(path: str, _record: KernelRecord) -> None:
        data = Path(path).read_bytes()
        Path(path).unlink()
        Path(path).write_bytes(data)

    with pytest.raises(BadEntryError, match="replaced while it was loaded"):
        cache._verified(entry, replacing)


_BUILDER = """
import numpy as np
from optsat.kernels.linear import cholesky_solve
from optsat.kernels.open_kernel import make_kernel
kernel = make_kernel(cholesky_solve(3))
print(kernel(4.0 * np.eye(3), np.ones(3))[0].tolist(), kernel.record.key, sep="|")
"""


def test_eight_processes_race_for_one_kernel(own: Path, root: Path) -> None:
    # the race is for the kernel alone
    forget(fingerprint._fingerprint, binding.find_binding, binding.cached_binding)
    make_kernel(turning())
    environment = {**os.environ, "PYTHONPATH": str(root), "TMPDIR": str(own.parent)}
    started = [
        subprocess.Popen(
            [sys.executable, "-c", _BUILDER], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(8)
    ]
    answers = [(process.communicate(timeout=120), process.returncode) for process in started]
    assert [code for _, code in answers] == [0] * 8, answers
    ((answer, key),) = {tuple(out.strip().split("|")) for (out, _), _ in answers}
    assert answer == "[0.25, 0.25, 0.25]"
    assert sorted(path.name for path in own.glob("??/*") if path.name.startswith((".", key))) == [
        f"{key}.c",
        f"{key}.record",
        f"{key}.so",
    ]


def test_a_builder_that_hangs_stops_nobody(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import fcntl

    monkeypatch.setattr(compilation, "LONGEST_WAIT", 0.05)
    make_kernel(turning())  # the compiler is examined, the binding is there
    key_of = compilation._key
    hung = []

    def hang(*known: object) -> str:
        key = key_of(*known)  # type: ignore[arg-type]
        folder = own / key[:2]
        folder.mkdir(mode=0o700, exist_ok=True)
        stream = (folder / f".{key}.lock").open("w")
        fcntl.flock(stream, fcntl.LOCK_EX)
        hung.append(stream)
        return key

    monkeypatch.setattr(compilation, "_key", hang)
    assert make_kernel(turning(7.0)).is_compiled
    assert len(hung) == 1
    hung[0].close()


@pytest.mark.skipif(AS_ROOT, reason="root can write to read-only folders")
def test_a_read_only_home_falls_to_the_spare_folder(own: Path) -> None:
    own.mkdir(mode=0o500)
    kernel = make_kernel(turning())
    assert not list(own.iterdir())
    assert entry_of(own.parent / "spare", kernel)


def test_a_folder_that_cannot_be_made_falls_to_the_spare_one(
    tmp_path: Path, own: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "file" / "own"))
    kernel = make_kernel(turning())
    assert entry_of(tmp_path / "spare", kernel)


def test_a_full_disk_falls_to_the_spare_folder(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make_kernel(turning())
    really = write_atomically

    def full(path: Path, data: bytes, mode: int) -> None:
        if path.is_relative_to(own):
            raise OSError(28, "No space left on device")
        really(path, data, mode)

    monkeypatch.setattr(entry_file, "write_atomically", full)
    kernel = make_kernel(turning(8.0))
    assert kernel.is_compiled
    assert read_entry(own, kernel.record.key) is None
    assert entry_of(own.parent / "spare", kernel)
    monkeypatch.setattr(folders, "spare_folders", lambda: iter([]))
    with pytest.raises(cache.UnloadableError, match="No space left on device"):
        cache.store(kernel.record, b"", "", lambda _path, _record: None)


def test_a_folder_without_programs_falls_to_the_spare_one(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = make_kernel(turning(9.0))
    entry = entry_of(own, kernel)

    def bind(path: str, _record: KernelRecord) -> str:
        if Path(path).is_relative_to(own):
            raise OSError("failed to map segment from shared object")
        return path

    found = cache.load(kernel.record.key, bind)
    assert found is not None
    assert Path(found[0]).is_relative_to(own.parent / "spare")
    assert entry.library.exists()
    monkeypatch.setattr(folders, "spare_folders", lambda: iter([]))
    with pytest.raises(cache.UnloadableError, match=r"failed to map segment from .* OPTSAT_CACHE"):
        cache.load(kernel.record.key, bind)


@pytest.mark.skipif(not AS_ROOT, reason="only root can give a folder away")
def test_a_folder_of_somebody_else_is_not_used(own: Path) -> None:
    own.mkdir(mode=0o700)
    os.chown(own, 12345, -1)
    with pytest.warns(folders.CacheFolderWarning, match="belongs to user 12345, and compiled kernels are code"):
        kernel = make_kernel(turning())
    assert not list(own.iterdir())
    assert entry_of(own.parent / "spare", kernel)


def test_a_folder_that_others_can_write_to_is_not_used(own: Path) -> None:
    own.mkdir()
    own.chmod(0o770)
    with pytest.warns(folders.CacheFolderWarning, match=r"can be written by others \(mode 0770\)") as caught:
        kernels = [make_kernel(turning()), make_kernel(turning(2.0))]
    assert len(caught) == 1
    assert not list(own.iterdir())
    assert entry_of(own.parent / "spare", kernels[0])


def test_a_file_that_others_can_write_to_is_not_loaded(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = entry_of(own, make_kernel(turning()))
    entry.library.chmod(0o666)
    compiled = compile_again(monkeypatch)
    assert make_kernel(turning()).is_compiled
    assert len(compiled) == 1


def test_a_shared_folder_is_searched_first_and_never_written_to(
    own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = make_kernel(turning())
    own.rename(tmp_path / "shared")
    shared = tmp_path / "shared"
    monkeypatch.setenv(folders.VARIABLE, os.pathsep.join([str(own), str(shared)]))
    compiled = compile_again(monkeypatch)
    assert make_kernel(turning()).record == kernel.record
    assert compiled == []
    before = sorted(shared.rglob("*"))
    entry = entry_of(shared, kernel)
    data = entry.library.read_bytes()
    entry.library.unlink()
    entry.library.write_bytes(data[:-1])
    assert make_kernel(turning()).is_compiled
    assert len(compiled) == 1
    assert sorted(shared.rglob("*")) == before
    assert entry_of(own, kernel)


def test_code_for_another_processor_is_passed_over(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = make_kernel(turning())
    monkeypatch.setattr(cache, "features", lambda: frozenset({"none"}))
    if kernel.record.features:
        assert cache.load(kernel.record.key, lambda path, _record: path) is None


def test_the_oldest_go_when_the_folder_is_large(own: Path) -> None:
    kernels = [make_kernel(turning(float(gain))) for gain in range(1, 5)]
    now = time.time()
    for age, kernel in zip((5, 4, 3, 0.5), kernels, strict=True):
        path = entry_of(own, kernel).library.with_suffix(".record")
        os.utime(path, (now - age * DAY, now - age * DAY))
    half_written = own / kernels[0].record.key[:2] / ".half"
    half_written.write_text("")
    os.utime(half_written, (now - 7200, now - 7200))
    size = Entry(own, kernels[0].record).size()
    total = sum(path.stat().st_size for path in own.glob("??/*"))
    assert upkeep.evict(own, total) == []
    assert not half_written.exists()
    assert upkeep.evict(own, total - size) == [kernels[0].record.key]
    removed = upkeep.evict(own, 0)
    assert removed[:2] == [kernels[1].record.key, kernels[2].record.key]
    # used within a day: it stays, whatever the size
    assert read_entry(own, kernels[3].record.key)


def test_use_keeps_a_kernel(own: Path) -> None:
    kernel = make_kernel(turning())
    path = entry_of(own, kernel).library.with_suffix(".record")
    old = time.time() - 3 * DAY
    os.utime(path, (old, old))
    list(upkeep.entries(own))
    assert path.stat().st_mtime == pytest.approx(old, abs=1.0)
    make_kernel(turning())
    assert time.time() - path.stat().st_mtime < 60.0


def test_where_kernels_are_kept(tmp_path: Path) -> None:
    three = {"OPTSAT_CACHE": os.pathsep.join([str(tmp_path), "/a", "/b"])}
    assert folders.own_folder(three) == tmp_path
    assert folders.shared_folders(three) == (Path("/a"), Path("/b"))
    assert folders.own_folder({"XDG_CACHE_HOME": str(tmp_path)}) == tmp_path / "optsat"
    assert folders.own_folder({"XDG_CACHE_HOME": "relative"}) == Path.home() / ".cache" / "optsat"
    assert folders.own_folder({}) == Path.home() / ".cache" / "optsat"
    assert folders.shared_folders({}) == ()


def test_cleaning_leaves_what_is_not_ours(own: Path) -> None:
    forget(fingerprint._fingerprint)
    kernels = [make_kernel(turning()), make_kernel(turning(2.0))]
    (own / "mine.txt").write_text("keep")
    old = time.time() - 3 * DAY
    path = entry_of(own, kernels[0]).library.with_suffix(".record")
    os.utime(path, (old, old))
    size = entry_of(own, kernels[1]).size()
    assert upkeep.clean(own, unused=DAY)[0] == 1
    assert read_entry(own, kernels[1].record.key)
    assert list(own.glob("compiler-*.json"))
    count, removed = upkeep.clean(own)
    assert count >= 1
    assert removed >= size
    assert [path.name for path in own.rglob("*") if path.is_file()] == ["mine.txt"]
    assert upkeep.clean(own) == (0, 0)


def test_damage_is_found(own: Path) -> None:
    kernels = [make_kernel(turning(float(gain))) for gain in (1, 2, 3)]
    assert upkeep.damaged(own) == []
    first, second = (entry_of(own, kernel) for kernel in kernels[:2])
    first.library.unlink()
    second.library.with_suffix(".record").write_text("x")
    assert upkeep.damaged(own) == sorted([first.record.key, second.record.key])
