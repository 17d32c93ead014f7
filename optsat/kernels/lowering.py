"""Lowering: from a symbolic function to the program that is printed, of a size that compilers can take."""

import warnings
from collections.abc import Sequence
from typing import Any

from optsat.errors import InputError
from optsat.kernels.fold import fold
from optsat.kernels.instructions import read_instructions
from optsat.kernels.program import Program

LARGE = 10_000
"""Operations above which compilation takes seconds."""

TOO_LARGE = 20_000
"""Operations above which it takes minutes, for code slower than a loop."""

_ADVICE = "Make a kernel of the body of its loops and write the loops around it in C"


def lower(
    function: Any, allow_large: bool = False, names_in: Sequence[str] = (), names_out: Sequence[str] = ()
) -> Program:
    """Return the folded program of a CasADi SXFunction; warns above 10,000 operations.

    names_in, names_out : of the arguments and results; CasADi's own unless given
    allow_large : take more than 20,000 operations

    Raises
    ------
    InputError : no SXFunction, an operation that no kernel knows, or too many of them.
    """
    program = fold(read_instructions(function, names_in, names_out))
    count = program.operation_count
    if count > TOO_LARGE and not allow_large:
        raise InputError(
            f"{program.name} has {count} operations; above {TOO_LARGE} compilation takes minutes and the code is "
            f"slower than a loop. {_ADVICE}, or pass allow_large=True."
        )
    if count > LARGE:
        warnings.warn(f"{program.name} has {count} operations and will compile for seconds. {_ADVICE}.", stacklevel=2)
    return program


def optimisation_level(program: Program) -> str:
    """Return the compiler flag that suits the size of the program; the bits are the same at every level."""
    return "-O2" if program.operation_count <= LARGE else "-O1"
