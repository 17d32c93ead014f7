"""Instantiate: a template with its sizes and leaves in place, as the source of one kernel."""

import re
from collections.abc import Mapping, Sequence
from importlib import resources

from optsat.errors import InputError
from optsat.kernels.print_scalar import print_scalar
from optsat.kernels.program import Program, starts
from optsat.kernels.source import KernelSource, Twin
from optsat.port import Port

_SLOT = re.compile(r"^/\*@leaf (\w+): (\w+) -> (\w+) \*/$", re.MULTILINE)
_SIZES = "/*@sizes*/"


def instantiate(
    template: str,
    name: str,
    leaves: Mapping[str, Program],
    sizes: Mapping[str, int],
    inputs: Sequence[Port],
    outputs: Sequence[Port],
    twin: Twin | None = None,
) -> KernelSource:
    """Return the kernel `name` of `optsat/kernels/templates/TEMPLATE.c`.

    In the text, KERNEL stands for the name of the kernel and KERNEL_N for the size N. The line `/*@sizes*/` becomes
    an enumeration of the sizes, a line `/*@leaf f: NX -> NY */` the function KERNEL_f_leaf(x, y) of NX arguments and
    NY results in a row each.

    leaves : folded program by the name of its slot; sizes : by name, without the prefix

    Raises
    ------
    InputError : a slot or size is missing or unknown, or a leaf does not fit its slot.
    """
    text = resources.files("optsat.kernels.templates").joinpath(f"{template}.c").read_text(encoding="utf-8")
    slots = {slot: (n_in, n_out) for slot, n_in, n_out in _SLOT.findall(text)}
    if slots.keys() != leaves.keys():
        raise InputError(f"Template {template} has the leaves {sorted(slots)}, got {sorted(leaves)}.")
    for slot, (n_in, n_out) in slots.items():
        _check_fit(f"{template}, leaf {slot}", leaves[slot], _size(n_in, sizes), _size(n_out, sizes))
    listed = ", ".join(f"KERNEL_{size} = {value}" for size, value in sizes.items())
    text = text.replace(_SIZES, f"enum {{ {listed} }};")
    text = _SLOT.sub(lambda found: _printed(leaves[found[1]], f"KERNEL_{found[1]}"), text)
    unknown = set(re.findall(r"\bKERNEL_([A-Z][A-Z0-9_]*)\b", text)) - sizes.keys()
    if unknown:
        raise InputError(f"Template {template} needs the sizes {sorted(unknown)}.")
    return KernelSource(
        name=name,
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        body=re.sub(r"\bKERNEL(?=_|\b)", name, text),
        has_status=True,
        libm=tuple(sorted({function for program in leaves.values() for function in program.libm})),
        operations=sum(program.operation_count for program in leaves.values()),
        twin=twin,
    )


def _size(word: str, sizes: Mapping[str, int]) -> int:
    if word.isdigit():
        return int(word)
    if word not in sizes:
        raise InputError(f"A slot needs the size {word}; sizes given: {sorted(sizes)}.")
    return sizes[word]


def _check_fit(where: str, program: Program, n_in: int, n_out: int) -> None:
    got = starts(program.inputs, dense=True)[-1], starts(program.outputs, dense=True)[-1]
    if got != (n_in, n_out):
        raise InputError(
            f"Template {where}: the slot takes {n_in} arguments and gives {n_out} results, {program.name} {got}."
        )


def _printed(program: Program, name: str) -> str:
    leaf = print_scalar(program, dense=True)
    return leaf.replace(f"{program.name}_leaf(", f"{name}_leaf(")
