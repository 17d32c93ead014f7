"""Health: whether kernels can be compiled, kept and called on this machine, and how, for `optsat doctor`."""

import hashlib
import statistics
import struct
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from optsat.errors import InputError, OptsatError
from optsat.kernels.binding import find_binding
from optsat.kernels.casadi_form import CasadiForm
from optsat.kernels.compilation import compiled
from optsat.kernels.ctypes_form import CtypesForm
from optsat.kernels.fingerprint import fingerprint
from optsat.kernels.folders import fault_of, own_folder, searched_folders, shared_folders
from optsat.kernels.open_kernel import make_kernel
from optsat.kernels.processor import c_library, lane_width
from optsat.kernels.record import KernelRecord
from optsat.kernels.toolchain import Compiler, CompilerMissingError, find_compiler
from optsat.kernels.upkeep import damaged, entries
from optsat.port import Port

_ROUNDS, _CALLS = 7, 400


@dataclass(frozen=True)
class Fact:
    """One line: the subject, whether it is well, absent without need, or broken, and what to do then."""

    subject: str
    state: Literal["ok", "absent", "broken"]
    says: str


def examine_kernels() -> list[Fact]:
    """Return what is known of compiler, binding, cache, mathematical library and the cost of a call."""
    with warnings.catch_warnings():
        # what they warn of is among the facts
        warnings.simplefilter("ignore")
        try:
            compiler, facts = _compiler()
        except OptsatError as error:
            compiler, facts = None, [Fact("C compiler", "broken", str(error))]
        return [*facts, _lanes(), _binding(compiler), *_folders(), _libm(), _calls(compiler)]


def _compiler() -> tuple[Compiler | None, list[Fact]]:
    try:
        compiler = find_compiler()
    except CompilerMissingError as error:
        cost = "Not needed: kernels run interpreted, a call tens of times slower, a batch hundreds of times."
        return None, [Fact("C compiler", "absent", f"{cost} {error}")]
    except InputError as error:
        return None, [Fact("C compiler", "broken", str(error))]
    found = fingerprint(compiler)
    version = found.version.partition("\n")[0]
    flags = " ".join((*found.flags, *compiler.flags)) or "none"
    facts = [Fact("C compiler", "ok", f"{compiler}: {version}; flags for this processor: {flags}")]
    if found.refused:
        return None, [*facts, Fact("C compiler probe", "broken", found.refused)]
    return compiler, [*facts, Fact("C compiler probe", "ok", "computes as IEEE 754 asks, to the last bit")]


def _lanes() -> Fact:
    return Fact("kernel lanes", "ok", f"{lane_width('double')} doubles or {lane_width('float')} floats at once")


def _binding(compiler: Compiler | None) -> Fact:
    if found := find_binding():
        where = "installed" if found[1] == "extension" else "not installed, compiled into the cache instead"
        return Fact("kernel binding", "ok", f"{found[1]}: {where}")
    if compiler is None:
        return Fact("kernel binding", "absent", "not installed; install optsat again once a C compiler is here")
    says = "ctypes, a call several times slower: install Python's headers (python3-dev) or reinstall optsat"
    return Fact("kernel binding", "absent", says)


def _folders() -> Iterator[Fact]:
    own = own_folder()
    for folder in (own, *shared_folders()):
        subject = "kernel cache" if folder == own else f"kernel cache, shared: {folder}"
        try:
            status = folder.stat()
        except OSError:
            if folder == own:
                yield Fact(subject, "ok", f"{folder}: nothing kept yet")
            else:
                yield Fact(subject, "broken", "not there; take it out of OPTSAT_CACHE")
            continue
        if fault := fault_of(status, shared=folder != own):
            cure = "not used; give it to yourself with mode 0700, or let OPTSAT_CACHE name another"
            yield Fact(subject, "broken", f"{folder} {fault}: {cure}")
            continue
        kept, bad = list(entries(folder)), damaged(folder)
        size = sum(entry.size() for entry in kept)
        rights = f"owner {status.st_uid}, mode {status.st_mode & 0o7777:04o}"
        says = f"{folder}: {len(kept)} kernels, {size / 1e6:.1f} MB, {rights}"
        if bad:
            yield Fact(subject, "broken", f"{says}; {len(bad)} damaged, which are made again: optsat cache clean")
        else:
            yield Fact(subject, "ok", f"{says}, all verified")
    spare = [folder for folder in searched_folders() if folder not in (own, *shared_folders())]
    for folder in spare:
        kept = list(entries(folder))
        if kept:
            yield Fact(f"kernel cache, spare: {folder}", "ok", f"{len(kept)} kernels")


def _libm() -> Fact:
    # its last bits differ between processors, even of one version
    from math import exp, sin

    known = b"".join(struct.pack("<dd", sin(1.7 * k * k + 0.1), exp(0.37 * k - 3.1)) for k in range(16))
    variant = hashlib.sha256(known).hexdigest()[:8]
    return Fact("mathematical library", "ok", f"{c_library()}, variant {variant} by its last bits")


def _calls(compiler: Compiler | None) -> Fact:
    """The cost of one call by each way, as ratios of interleaved medians."""
    try:
        ways = dict(_ways(compiler))
    except (OptsatError, ImportError, OSError) as error:
        return Fact("kernel calls", "broken", f"{error}")
    costs: dict[str, list[float]] = {way: [] for way in ways}
    for _ in range(_ROUNDS):
        for way, call in ways.items():
            begin = time.perf_counter()
            for _ in range(_CALLS):
                call()
            costs[way].append(time.perf_counter() - begin)
    medians = {way: statistics.median(cost) for way, cost in costs.items()}
    fastest = min(medians.values())
    return Fact("kernel calls", "ok", "cost " + ", ".join(f"{way} {m / fastest:.1f}" for way, m in medians.items()))


@dataclass(frozen=True)
class _Example:
    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    casadi: Any


def _ways(compiler: Compiler | None) -> Iterator[tuple[str, Callable[[], Any]]]:
    import casadi as ca

    a, b = ca.SX.sym("a", 4), ca.SX.sym("b", 4)
    ports = (Port("a", (4,), "-"), Port("b", (4,), "-"))
    example = _Example("doctor", ports, (Port("c", (4,), "-"),), ca.Function("doctor", [a, b], [a * b + a]))
    x, y = np.arange(4.0), np.ones(4)
    if compiler is not None:
        kernel = make_kernel(example)
        if kernel.is_compiled:
            yield kernel.form, lambda: kernel(x, y)
            if kernel.form != "ctypes":
                other, _ = compiled(kernel.record, kernel.c_text, CtypesForm)
                yield "ctypes", lambda: other.call(x, y)
    record = KernelRecord(example.name, "double", example.inputs, example.outputs)
    machine = CasadiForm(example.casadi, record)
    yield "interpreted", lambda: machine.call(x, y)
    yield "CasADi called with arrays", lambda: example.casadi(x, y)
