"""Instantiate: a template with its sizes, constants and leaves in place, as the source of one kernel."""

import math
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import TypeAlias

from optsat.errors import InputError
from optsat.kernels.elementary import libm_of
from optsat.kernels.print_scalar import c_constant, print_scalar
from optsat.kernels.program import Program, starts
from optsat.kernels.source import Example, KernelSource, Twin
from optsat.port import Port

Leaf: TypeAlias = Program | KernelSource
"""What a slot of a template takes: straight-line code, or a kernel with loops of its own."""

_SLOT = re.compile(r"^/\*@(leaf|step) (\w+): ([\w +*]+) -> ([\w +*]+) \*/$", re.MULTILINE)
_INCLUDE = re.compile(r"^/\*@include (\w+)\*/$", re.MULTILINE)
_SIZES = "/*@sizes*/"
_TABLES = re.compile(r"^( *)/\*@tables\*/$", re.MULTILINE)

_WRAPPED = """\
typedef struct {{
    os_real_t unused;
}} {name}_work_t;

static os_status_t {name}_body(const os_real_t *x, os_real_t *y, {name}_work_t *work)
{{
    (void)work;
    {name}_leaf(x, y);
    return OS_OK;
}}
"""


def instantiate(
    template: str,
    name: str,
    leaves: Mapping[str, Leaf],
    sizes: Mapping[str, int],
    inputs: Sequence[Port],
    outputs: Sequence[Port],
    twin: Twin | None = None,
    constants: Mapping[str, float] | None = None,
    tables: Mapping[str, Sequence[int] | Sequence[float]] | None = None,
    operations: int | None = None,
    example: Example | None = None,
    has_short_loops: bool = False,
) -> KernelSource:
    """Return the kernel `name` of `optsat/kernels/templates/TEMPLATE.c`.

    In the text, KERNEL stands for the name of the kernel, KERNEL_N for the size or constant N. The line `/*@sizes*/`
    becomes an enumeration of the sizes, `/*@tables*/` the constant arrays, `/*@include part*/` the text of part.c. A
    slot of NX arguments and NY results in a row each, both sums of products such as `N + 2 * M`, becomes
        `/*@leaf f: NX -> NY */`  the function KERNEL_f_leaf(x, y) of straight-line code
        `/*@step f: NX -> NY */`  the function KERNEL_f_body(x, y, work) with a status, of any kernel

    leaves : what fills each slot, by its name, programs folded; sizes, constants, tables : by name, without the prefix
    tables : 32-bit whole numbers where all entries are, else reals
    operations : of one sample; the sum over the leaves unless given

    Raises
    ------
    InputError : a slot, size or constant is missing or unknown, or a leaf does not fit its slot.
    """
    constants, tables = constants or {}, tables or {}
    if re.match(r"os(_|$)", name):
        raise InputError(f"A kernel cannot be called {name}: names with `os_` are those of the run-time header.")
    text = _INCLUDE.sub(lambda found: _read(found[1]), _read(template))
    slots = [slot for _, slot, _, _ in _SLOT.findall(text)]
    if sorted(slots) != sorted(leaves):
        raise InputError(f"Template {template} has the slots {sorted(slots)}, got {sorted(leaves)}.")
    named = set(re.findall(r"\bKERNEL_([A-Z][A-Z0-9_]*)\b", text))
    known = {*sizes, *constants, *tables}
    if missing := named - known:
        raise InputError(f"Template {template} needs the sizes, constants or tables {sorted(missing)}.")
    if unknown := known - named - _words_of_slots(text):
        raise InputError(f"Template {template} has no size, constant or table {sorted(unknown)}.")
    listed = ", ".join(f"KERNEL_{size} = {value}" for size, value in sizes.items() if size in named)
    text = text.replace(_SIZES, f"enum {{ {listed} }};")
    printed = [_table(f"KERNEL_{key}", values) for key, values in tables.items()]
    text = _TABLES.sub(lambda found: "\n".join(f"{found[1]}{table}" for table in printed), text)
    for key, value in constants.items():
        text = re.sub(rf"\bKERNEL_{key}\b", c_constant(float(value)), text)
    text = _SLOT.sub(lambda found: _filled(template, found, leaves[found[2]], sizes), text)
    return KernelSource(
        name=name,
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        body=re.sub(r"\bKERNEL(?=_|\b)", name, text),
        has_status=True,
        libm=tuple(sorted({function for leaf in leaves.values() for function in _libm(leaf)})),
        operations=sum(map(operation_count, leaves.values())) if operations is None else operations,
        twin=twin,
        example=example,
        has_short_loops=has_short_loops,
    )


def _read(template: str) -> str:
    return resources.files("optsat.kernels.templates").joinpath(f"{template}.c").read_text(encoding="utf-8")


def operation_count(leaf: Leaf) -> int:
    """Return the operations of one sample of what fills a slot."""
    return leaf.operations if isinstance(leaf, KernelSource) else leaf.operation_count


def _libm(leaf: Leaf) -> tuple[str, ...]:
    return leaf.libm if isinstance(leaf, KernelSource) else libm_of(leaf, "own")


def _words_of_slots(text: str) -> set[str]:
    return {word for _, _, n_in, n_out in _SLOT.findall(text) for word in re.findall(r"[A-Z]\w*", f"{n_in} {n_out}")}


def _filled(template: str, slot: re.Match[str], leaf: Leaf, sizes: Mapping[str, int]) -> str:
    kind, name = slot[1], f"KERNEL_{slot[2]}"
    wanted = _length(slot[3], sizes), _length(slot[4], sizes)
    got = _lengths(leaf)
    if got != wanted:
        raise InputError(
            f"Template {template}, slot {slot[2]}: it takes {wanted[0]} arguments and gives {wanted[1]} results, "
            f"{leaf.name} takes {got[0]} and gives {got[1]}."
        )
    text = leaf.body if isinstance(leaf, KernelSource) else print_scalar(leaf, dense=True)
    # the name of the leaf, alone or as the first word of its own names
    text = re.sub(rf"\b{leaf.name}(?=_|\b)", name, text)
    if isinstance(leaf, KernelSource) and leaf.has_status:
        if kind == "leaf":
            raise InputError(
                f"Template {template}, slot {slot[2]}: {leaf.name} has a status, and this slot takes "
                "straight-line code only."
            )
        return text
    return text if kind == "leaf" else f"{text}\n{_WRAPPED.format(name=name)}"


def _lengths(leaf: Leaf) -> tuple[int, int]:
    if isinstance(leaf, KernelSource):
        return sum(port.size for port in leaf.inputs), sum(port.size for port in leaf.outputs)
    return starts(leaf.inputs, dense=True)[-1], starts(leaf.outputs, dense=True)[-1]


def _length(expression: str, sizes: Mapping[str, int]) -> int:
    terms = [[factor.strip() for factor in term.split("*")] for term in expression.split("+")]
    for word in {factor for term in terms for factor in term}:
        if not word.isdigit() and word not in sizes:
            raise InputError(f"A slot needs the size {word}; sizes given: {sorted(sizes)}.")
    return sum(math.prod(int(f) if f.isdigit() else sizes[f] for f in term) for term in terms)


def _table(name: str, values: Sequence[int] | Sequence[float]) -> str:
    if all(isinstance(value, int) for value in values):
        listed, kind = [str(value) for value in values], "int32_t"
    else:
        listed, kind = [c_constant(float(value)) for value in values], "os_real_t"
    return f"static const {kind} {name}[{len(listed)}] = {{ {', '.join(listed)} }};"
