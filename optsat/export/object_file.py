"""Object file: what a compiled kernel holds, needs and puts on the stack, measured by the target's binary tools."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from optsat.export.target import Target
from optsat.export.tools import ToolError, find_tool, run_tool

EXACT = ("sqrt", "fabs", "floor", "ceil", "copysign")
"""Functions of C that give the same bits everywhere; most compilers need no library for them."""

COMPILER_SUPPORT = ("__aeabi_", "memcpy", "memmove", "memset")
"""Beginnings of names that compilers call where the processor lacks an instruction, and to move structures."""

_NODE = re.compile(r'^node: \{ title: "([^"]+)" label: "([^"]*)"', re.MULTILINE)
_EDGE = re.compile(r'^edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', re.MULTILINE)
_FRAME = re.compile(r"(\d+) bytes \(([\w,]+)\)")


@dataclass(frozen=True)
class ObjectFile:
    """One compiled kernel.

    text, data, bss : bytes; text holds the constants
    defined : functions that it exports; undefined : that it needs from elsewhere
    stack : most bytes on the stack from its deepest function down, or None where the compiler does not say
    outside : functions of libraries called below, whose stack comes on top
    """

    text: int
    data: int
    bss: int
    defined: tuple[str, ...]
    undefined: tuple[str, ...]
    stack: int | None
    outside: tuple[str, ...] = ()


def examine(path: Path, target: Target) -> ObjectFile:
    """Return what `size`, `nm` and the compiler's call graph beside the file say.

    Raises
    ------
    ToolError : a tool is absent or fails, the call graph has a cycle, or a stack frame has no bound.
    """
    text, data, bss = (int(word) for word in _tool(target, "size", path).splitlines()[1].split()[:3])
    symbols = [line.split() for line in _tool(target, "nm", path).splitlines() if line.strip()]
    graph = path.with_suffix(".ci")
    stated = stack_bound(graph.read_text(encoding="utf-8")) if graph.exists() else (None, ())
    return ObjectFile(
        text=text,
        data=data,
        bss=bss,
        defined=tuple(sorted(words[-1] for words in symbols if words[-2] in "TDBCRVW")),
        undefined=tuple(sorted(words[-1] for words in symbols if words[-2] == "U")),
        stack=stated[0],
        outside=stated[1],
    )


def faults(found: ObjectFile, functions: Sequence[str], libm: Sequence[str]) -> list[str]:
    """Return what a flight kernel must not hold or need, one sentence each.

    functions : that it exports; libm : functions of the mathematical library that its model uses
    """
    allowed = {f"{name}{suffix}" for name in (*libm, *EXACT) for suffix in ("", "f")}
    foreign = [name for name in found.undefined if name not in allowed and not name.startswith(COMPILER_SUPPORT)]
    extra = sorted(set(found.defined) - set(functions))
    return [
        *([f"it has {found.data} bytes of data and {found.bss} of bss"] if found.data or found.bss else []),
        *([f"it needs {', '.join(foreign)}"] if foreign else []),
        *([f"it exports {', '.join(extra)}"] if extra else []),
    ]


def stack_bound(call_graph: str) -> tuple[int, tuple[str, ...]]:
    """Return the most bytes that any chain of calls takes, and the functions outside that it may end in.

    call_graph : as gcc writes it with -fcallgraph-info=su

    Raises
    ------
    ToolError : functions call each other in a circle, or a frame is not of fixed size.
    """
    frames: dict[str, int] = {}
    for title, label in _NODE.findall(call_graph):
        if found := _FRAME.search(label):
            if found[2] != "static":
                raise ToolError(f"{title} has a stack frame that is not of fixed size ({found[2]}).")
            frames[title] = int(found[1])
    calls: dict[str, list[str]] = {}
    for source, destination in _EDGE.findall(call_graph):
        calls.setdefault(source, []).append(destination)
    depth = max((_depth(name, frames, calls, ()) for name in frames), default=0)
    called = {destination for destinations in calls.values() for destination in destinations}
    return depth, tuple(sorted(called - frames.keys()))


def _depth(name: str, frames: Mapping[str, int], calls: Mapping[str, list[str]], above: tuple[str, ...]) -> int:
    if name in above:
        raise ToolError(f"{' calls '.join((*above, name))}: recursion, which has no stack bound.")
    below = (_depth(callee, frames, calls, (*above, name)) for callee in calls.get(name, []))
    return frames.get(name, 0) + max(below, default=0)


def _tool(target: Target, name: str, path: Path) -> str:
    tool = find_tool(f"{target.prefix}{name}")
    if tool is None:
        raise ToolError(f"{target.prefix}{name} is not on the path; it comes with the compiler's binutils.")
    return run_tool([tool, path.name], path.parent)
