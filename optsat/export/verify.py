"""Verify: compile an exported folder for its target, measure the objects, and replay the stored answers."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from optsat.errors import OptsatError
from optsat.export.build_files import WARNINGS, flags
from optsat.export.bundle import Bundle
from optsat.export.object_file import ObjectFile, examine, faults
from optsat.export.tools import ToolError, find_tool, run_tool

_LINE = re.compile(r"^(\w+) (passed|FAILED) (.+)$", re.MULTILINE)


class SelfTestError(OptsatError):
    """Compiled C answered otherwise than Python; the message says which kernel, where and by how much."""


@dataclass(frozen=True)
class Replay:
    """What one self-test said of a kernel.

    accepted : vectors with OS_OK; worst_ulp : largest difference from Python, in units in the last place of the
    largest number of its result; error : the same as a number; bits : digest of all results
    """

    where: str
    passed: bool
    vectors: int
    accepted: int
    wrong_status: int
    numbers: int
    differing: int
    worst_ulp: float
    error: float
    bits: str


@dataclass(frozen=True)
class Verification:
    """Objects and replays by kernel; `missing` says what was not done, and why."""

    compiler: str
    objects: Mapping[str, ObjectFile]
    replays: Mapping[str, Replay]
    missing: tuple[str, ...]


def verify(bundle: Bundle, folder: Path) -> Verification:
    """Compile and run what stands in `folder`, which also takes the objects; a missing tool is told, not an error.

    Raises
    ------
    ToolError : a compiler or simulator fails, or an object file holds or needs what no flight kernel may.
    """
    target, precision = bundle.target, bundle.precision
    compiler = find_tool(*target.compilers)
    if compiler is None:
        return Verification("", {}, {}, (f"Not compiled: no {' or '.join(target.compilers)} on the path.",))
    version = run_tool([compiler, "--version"], folder).splitlines()[0].strip()
    measuring = ["-fstack-usage", "-fcallgraph-info=su"] if _is_gcc(compiler, folder) else []
    missing = [] if measuring else [f"Stack not measured: {version} does not state it; gcc does."]
    objects = {}
    for interface in bundle.interfaces:
        name = interface.source.name
        command = [compiler, *flags(target, precision), *WARNINGS, *measuring, "-c", f"{name}.c", "-o", f"{name}.o"]
        run_tool(command, folder)
        objects[name] = examine(folder / f"{name}.o", target)
        if found := faults(objects[name], interface.functions, interface.source.libm):
            raise ToolError(f"{name} is no flight code, compiled with {version}: {'; '.join(found)}.")
    if target.simulator and find_tool(target.simulator[0]) is None:
        missing.append(f"Not run: {target.simulator[0]} is not on the path.")
        return Verification(version, objects, {}, tuple(missing))
    return Verification(version, objects, replay(bundle, folder, compiler), tuple(missing))


def check_answers(found: Verification, allowed: Mapping[str, float]) -> None:
    """Raise where a kernel answered otherwise than stored.

    allowed : largest difference by kernel, in units in the last place of the largest number of a result

    Raises
    ------
    SelfTestError : says what differs, or that the kernel accepted none of its vectors.
    """
    for name, said in found.replays.items():
        if said.passed:
            continue
        if said.wrong_status:
            fault = f"{said.wrong_status} of {said.vectors} vectors gave another status than Python"
        elif said.accepted == 0:
            fault = f"none of {said.vectors} vectors was accepted, so nothing is shown; widen the checks of its ports"
        else:
            fault = (
                f"{said.differing} of {said.numbers} numbers differ from Python, by up to {said.worst_ulp:.4g} units "
                f"in the last place where {allowed[name]:g} are allowed"
            )
        raise SelfTestError(f"{name} on {said.where}: {fault}. Nothing was written.")


def replay(bundle: Bundle, folder: Path, compiler: str) -> dict[str, Replay]:
    """Link the self-tests in `folder` and return what they say by kernel.

    Raises
    ------
    ToolError : the link or the run fails, or a kernel says nothing.
    """
    names, target = bundle.names, bundle.target
    sources = [f"{name}{end}" for name in names for end in (".c", "_selftest.c")]
    extra = [file.rpartition("/")[2] for file in target.files if file.endswith(".c")]
    program = f"selftest-{target.name}"
    command = [
        compiler,
        *flags(target, bundle.precision),
        "selftest.c",
        *extra,
        *sources,
        *target.link,
        "-lm",
        "-o",
        program,
    ]
    run_tool(command, folder)
    accept = tuple(range(len(names) + 1))
    said = run_tool([*target.simulator, f"./{program}"], folder, accept=accept)
    found = {name: _replay(target.name, word, figures) for name, word, figures in _LINE.findall(said)}
    if found.keys() != set(names):
        raise SelfTestError(f"The self-test on {target.name} stopped early and said:\n{said.strip()}")
    return found


def _replay(where: str, word: str, figures: str) -> Replay:
    words = figures.split()
    said = dict(zip(words[::2], words[1::2], strict=True))
    return Replay(
        where=where,
        passed=word == "passed",
        vectors=int(said["vectors"]),
        accepted=int(said["accepted"]),
        wrong_status=int(said["wrong_status"]),
        numbers=int(said["numbers"]),
        differing=int(said["differing"]),
        worst_ulp=float(said["worst_ulp"]),
        error=float(said["error"]),
        bits=said["bits"],
    )


def _is_gcc(compiler: str, folder: Path) -> bool:
    return "clang" not in run_tool([compiler, "-v"], folder)
