"""What `optsat doctor` finds of kernels: all of it, and the cure of each fault."""

import shutil
from pathlib import Path

import pytest
from kernel_examples import needs_compiler, turning

from optsat.kernels import binding, folders, health, loader
from optsat.kernels.entry import Entry
from optsat.kernels.health import Fact, examine_kernels
from optsat.kernels.open_kernel import make_kernel


@pytest.fixture(autouse=True)
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "own"))
    monkeypatch.setattr(health, "_CALLS", 2)
    return tmp_path / "own"


def examined() -> dict[str, Fact]:
    facts = examine_kernels()
    assert len({fact.subject for fact in facts}) == len(facts)
    return {fact.subject: fact for fact in facts}


def test_a_whole_machine_is_well(own: Path) -> None:
    needs_compiler()
    make_kernel(turning())
    found = examined()
    assert {fact.state for fact in found.values()} <= {"ok", "absent"}
    assert found["C compiler probe"].says == "computes as IEEE 754 asks, to the last bit"
    assert found["C compiler"].state == "ok"
    assert "kernels, " in found["kernel cache"].says
    assert found["kernel cache"].says.endswith("mode 0700, all verified")
    assert "interpreted" in found["kernel calls"].says
    assert "variant" in found["mathematical library"].says


def test_no_compiler_is_no_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "/nonexistent")
    monkeypatch.setattr(health, "find_binding", lambda: None)
    found = examined()
    assert {fact.state for fact in found.values()} == {"ok", "absent"}
    assert found["C compiler"].state == found["kernel binding"].state == "absent"
    assert "CC names /nonexistent" in found["C compiler"].says
    assert "interpreted 1.0" in found["kernel calls"].says


def test_a_flag_that_changes_results_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPTSAT_CFLAGS", "-Ofast")
    fact = examined()["C compiler"]
    assert fact.state == "broken"
    assert "Take it out of CC or OPTSAT_CFLAGS" in fact.says


def test_a_compiler_that_computes_otherwise_is_a_fault(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not on the path")
    wrapper = own.parent / "cc"
    wrapper.write_text(f'#!/bin/sh\nexec {gcc} -ffast-math "$@"\n')
    wrapper.chmod(0o700)
    monkeypatch.setenv("CC", str(wrapper))
    found = examined()
    assert found["C compiler probe"].state == "broken"
    assert "let CC name another compiler" in found["C compiler probe"].says


def test_one_that_compiles_nothing_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    false = shutil.which("false")
    if false is None:
        pytest.skip("false is not on the path")
    monkeypatch.setenv("CC", false)
    assert examined()["C compiler"].state == "broken"


def test_a_binding_that_cannot_be_made_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    needs_compiler()
    monkeypatch.setattr(health, "find_binding", lambda: None)
    monkeypatch.setattr(loader, "find_binding", lambda: None)
    found = examined()
    assert found["kernel binding"].state == "absent"
    assert "python3-dev" in found["kernel binding"].says
    assert "ctypes" in found["kernel calls"].says


def test_an_installed_binding_of_another_age_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    class Old:
        """A binding from before."""

        INTERFACE = 0

    binding.installed_binding.cache_clear()
    monkeypatch.setattr("importlib.import_module", lambda _name: Old)
    assert binding.installed_binding() is None
    monkeypatch.undo()
    binding.installed_binding.cache_clear()


def test_an_open_folder_is_a_fault(own: Path) -> None:
    own.mkdir()
    own.chmod(0o777)
    fact = examined()["kernel cache"]
    assert fact.state == "broken"
    assert "can be written by others (mode 0777): not used; give it to yourself with mode 0700" in fact.says


def test_a_damaged_kernel_is_a_fault(own: Path) -> None:
    needs_compiler()
    entry = Entry(own, make_kernel(turning()).record)
    entry.library.unlink()
    fact = examined()["kernel cache"]
    assert fact.state == "broken"
    assert fact.says.endswith("1 damaged, which are made again: optsat cache clean")


def test_shared_and_spare_folders_are_told(own: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs_compiler()
    make_kernel(turning())
    monkeypatch.setenv(folders.VARIABLE, f"{tmp_path / 'other'}:{own}:/nonexistent")
    found = examined()
    assert found[f"kernel cache, shared: {own}"].state == "ok"
    assert found["kernel cache, shared: /nonexistent"].state == "broken"
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "file" / "nothing"))
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr(folders, "spare_folders", lambda: iter([own]))
    assert examined()[f"kernel cache, spare: {own}"].state == "ok"
