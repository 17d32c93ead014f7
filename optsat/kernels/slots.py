"""Slots: small programs that fill those of a template: a copy, the second of two, one function of one number."""

from optsat.kernels.program import Input, Operation, Pattern, Program


def column(n: int, name: str = "x") -> Pattern:
    """Return the pattern of a dense column of n numbers."""
    return Pattern(name, n, 1, (0, n), tuple(range(n)))


def identity(name: str, n: int) -> Program:
    """Return the program that copies a column of n numbers."""
    return Program(name, (column(n),), (column(n),), tuple(Input(0, k) for k in range(n)), (tuple(range(n)),))


def second(name: str, first: Pattern, other: Pattern) -> Program:
    """Return the program that copies the second of two columns."""
    n = other.rows
    return Program(name, (first, other), (column(n),), tuple(Input(1, k) for k in range(n)), (tuple(range(n)),))


def of_one(code: str) -> Program:
    """Return the program of a code of one operand, such as LOG."""
    return Program(code.lower(), (column(1),), (column(1),), (Input(0, 0), Operation(code, (0,))), ((1,),))
