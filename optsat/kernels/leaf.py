"""Leaf: the kernel source of straight-line code."""

from collections.abc import Sequence

from optsat.errors import InputError
from optsat.kernels.elementary import Math, libm_of
from optsat.kernels.print_lanes import print_lanes
from optsat.kernels.print_scalar import print_scalar
from optsat.kernels.program import Program
from optsat.kernels.source import KernelSource
from optsat.port import Port

SIDE_BY_SIDE = 2000
"""Operations up to which lanes are two vectors side by side; more of them wait for memory, not for each other."""


def leaf_source(program: Program, inputs: Sequence[Port], outputs: Sequence[Port], math: Math = "own") -> KernelSource:
    """Return the kernel of a folded program, its arguments and results described by ports.

    math : "own", elementary functions with the same bits on every machine, at every width; or "libm", those of the
        machine's library, which CasADi calls too

    Raises
    ------
    InputError : the shape of a port differs from the program's.
    """
    for kind, ports, patterns in (("input", inputs, program.inputs), ("output", outputs, program.outputs)):
        expected = [(pattern.rows, pattern.columns) for pattern in patterns]
        if (got := [(port.rows, port.columns) for port in ports]) != expected:
            raise InputError(f"{program.name}: the {kind} ports have shapes {got}, the program has {expected}.")
    sides = 2 if program.operation_count <= SIDE_BY_SIDE else 1
    return KernelSource(
        name=program.name,
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        body=print_scalar(program, dense=True, math=math),
        lanes=print_lanes(program, dense=True, math=math, sides=sides),
        sides=sides,
        libm=libm_of(program, math),
        operations=program.operation_count,
    )
