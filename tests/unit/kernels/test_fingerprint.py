"""The examination of a compiler: what it computes, which processor it compiles for, and that it is asked once."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from kernel_examples import forget, needs_compiler, turning

from optsat.kernels import fingerprint as examined
from optsat.kernels import folders
from optsat.kernels.fingerprint import PROBE, CompilerRefusedError, Fingerprint, compiler_identity, fingerprint
from optsat.kernels.interpreted import CompilerMissing, _warn_once
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.toolchain import CompilationError, Compiler

MASK = 2**64 - 1


def _digest() -> int:
    """os_probe.c once more, on NumPy's arithmetic."""
    digest = 0xCBF29CE484222325
    for real, word, nan in ((np.float64, np.uint64, 0x7FF8 << 48), (np.float32, np.uint32, 0x7FC0 << 16)):
        zero, one, sum_ = real(0), real(1), real(0)
        state = 1
        for _ in range(4096):
            drawn = []
            for _ in range(3):
                state = (state * 6364136223846793005 + 1442695040888963407) & MASK
                bits = state if real is np.float64 else state >> 32
                if (state >> 20) & 3:
                    fraction, half = ((2**53 - 1, 0x3FE << 52), (2**24 - 1, 0x3F << 24))[real is np.float32]
                    sign = bits & (1 << (63 if real is np.float64 else 31))
                    bits = sign | (bits & fraction) | half
                drawn.append(np.array([bits], word).view(real)[0])
            a, b, c = drawn
            sum_ = sum_ + (a - b * b)
            sum_ = sum_ if np.isfinite(sum_) else zero
            for value in (
                (a * b) + c,
                a - (c * b),
                (a + b) - a,
                (a / c) + (b / c),
                (a * zero) + (c - c),
                zero - a,
                -(b + zero),
                np.sqrt(a),
                a if a >= b else b,
                one if a < b and not b <= c else c,
                sum_,
            ):
                pattern = nan if np.isnan(value) else int(np.array([value], real).view(word)[0])
                digest = ((digest ^ pattern) * 0x100000001B3) & MASK
    return digest


def test_the_stored_digest_is_that_of_ieee_arithmetic() -> None:
    with np.errstate(all="ignore"):
        assert _digest() == PROBE


def compiler(name: str) -> Compiler:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not on the path")
    return Compiler((path,))


@pytest.fixture(autouse=True)
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(folders.VARIABLE, str(tmp_path / "own"))
    forget(examined._fingerprint)
    return tmp_path / "own"


@pytest.mark.parametrize("name", ["gcc", "clang"])
def test_real_compilers_pass(name: str) -> None:
    found = fingerprint(compiler(name))
    assert found.refused == ""
    assert found.checked() is found
    assert name in found.version
    assert found.target
    assert not any("native" in word or "/" in word for word in found.target)


@pytest.mark.parametrize("flag", ["-ffast-math", "-ffinite-math-only"])
def test_one_that_computes_otherwise_is_refused(flag: str, own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # through a wrapper, as the flag itself is refused before
    wrapper = own.parent / "cc"
    wrapper.write_text(f'#!/bin/sh\nexec {compiler("gcc").command[0]} {flag} "$@"\n')
    wrapper.chmod(0o700)
    found = fingerprint(Compiler((str(wrapper),)))
    assert "does not compute as IEEE 754 asks" in found.refused
    with pytest.raises(CompilerRefusedError, match="let CC name another compiler"):
        found.checked()
    monkeypatch.setenv("CC", str(wrapper))
    forget(_warn_once)
    with pytest.warns(CompilerMissing, match="does not compute as IEEE 754 asks"):
        assert make_kernel(turning()).form == "casadi"


def test_a_compiler_is_examined_once(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    needs_compiler()
    first = fingerprint(compiler("gcc"))
    forget(examined._fingerprint)

    def never(_compiler: Compiler) -> Fingerprint:
        raise AssertionError("examined again")

    monkeypatch.setattr(examined, "_examined", never)
    assert fingerprint(compiler("gcc")) == first
    (note,) = own.glob("compiler-*.json")
    note.write_text("{")
    forget(examined._fingerprint)
    with pytest.raises(AssertionError, match="examined again"):
        fingerprint(compiler("gcc"))


def test_it_is_examined_again_when_something_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "cc"
    program.write_text("1")
    names = {compiler_identity(Compiler((str(program),))), compiler_identity(Compiler((str(program),), ("-g",)))}
    names.add(compiler_identity(Compiler((str(program), "-m32"))))
    program.write_text("12")
    names.add(compiler_identity(Compiler((str(program),))))
    monkeypatch.setattr(examined, "identity", lambda: "another machine")
    names.add(compiler_identity(Compiler((str(program),))))
    assert len(names) == 5
    assert compiler_identity(Compiler(("/nonexistent",))) not in names


def test_a_program_that_compiles_nothing(tmp_path: Path) -> None:
    false = shutil.which("false")
    if false is None:
        pytest.skip("false is not on the path")
    with pytest.raises(CompilationError, match="failed with status 1"):
        fingerprint(Compiler((false,)))
    with pytest.raises(CompilationError, match="cannot be run"):
        fingerprint(Compiler((str(tmp_path / "gone"),)))
