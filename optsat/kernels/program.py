"""Program: what a kernel computes, as a list of nodes in the order of their evaluation."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

from optsat.kernels.codes import LIBM


@dataclass(frozen=True, slots=True)
class Input:
    """One non-zero of an argument, counted by columns."""

    argument: int
    element: int


@dataclass(frozen=True, slots=True, eq=False)
class Constant:
    """A number; two are equal when their bits are, so +0 and -0 stay apart and a NaN equals itself."""

    value: float

    @property
    def bits(self) -> bytes:
        """The number as its eight bytes."""
        return struct.pack("<d", self.value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Constant) and self.bits == other.bits

    def __hash__(self) -> int:
        return hash(self.bits)


@dataclass(frozen=True, slots=True)
class Operation:
    """A code of `optsat.kernels.codes` and the indices of the nodes that it works on."""

    code: str
    operands: tuple[int, ...]


Node: TypeAlias = Input | Constant | Operation


@dataclass(frozen=True)
class Pattern:
    """Name and sparsity of one argument or result: the rows of its non-zeros, column after column.

    colind : (columns + 1,) where each column begins; row : one per non-zero
    """

    name: str
    rows: int
    columns: int
    colind: tuple[int, ...]
    row: tuple[int, ...]

    def length(self, dense: bool) -> int:
        """Return how many numbers stand for it in memory: all entries, or its non-zeros alone."""
        return self.rows * self.columns if dense else len(self.row)

    def offsets(self, dense: bool) -> list[int]:
        """Return where each non-zero stands: counted by rows among all entries, or by columns among the non-zeros."""
        if not dense:
            return list(range(len(self.row)))
        return [
            self.row[k] * self.columns + column
            for column in range(self.columns)
            for k in range(self.colind[column], self.colind[column + 1])
        ]


@dataclass(frozen=True)
class Program:
    """Straight-line code without branches: operands stand before the operation that uses them.

    results : for each output, the node of each of its non-zeros, counted by columns
    """

    name: str
    inputs: tuple[Pattern, ...]
    outputs: tuple[Pattern, ...]
    nodes: tuple[Node, ...]
    results: tuple[tuple[int, ...], ...]

    @property
    def operation_count(self) -> int:
        """Number of operations, inputs and constants not counted."""
        return sum(isinstance(node, Operation) for node in self.nodes)

    @property
    def libm(self) -> tuple[str, ...]:
        """The C functions whose last bits depend on the machine; none means the same bits everywhere."""
        codes = {node.code for node in self.nodes if isinstance(node, Operation)}
        return tuple(sorted({LIBM[code] for code in codes & LIBM.keys()}))


def starts(patterns: Sequence[Pattern], dense: bool) -> list[int]:
    """Return where each argument begins in their concatenation, and at the end the length of the whole."""
    found = [0]
    for pattern in patterns:
        found.append(found[-1] + pattern.length(dense))
    return found
