"""Expressions: the nodes of a program as assignments, spelt by the tables of a language."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from optsat.kernels.codes import TRUTH
from optsat.kernels.program import Constant, Input, Operation, Program

CIRCULAR = frozenset({"SIN", "COS", "TAN"})
"""Codes that sine and cosine of their operand give."""


@dataclass(frozen=True)
class Language:
    """How one language writes the nodes.

    operations : template by code, of the operands {a} and {b} as numbers, {p} and {q} as truth values
    number : template that makes a number of the truth value {p}; truth : a truth value of the number {a}
    constant, load : spelling of a constant, of an input
    words : what else the templates name in braces
    pair : what gives sine and cosine of {a} together, which the templates call {pair}; "" where there is no such thing
    suffix : end of the names of variables
    """

    operations: Mapping[str, str]
    number: str
    truth: str
    constant: Callable[[float], str]
    load: Callable[[Input], str]
    words: Mapping[str, str]
    pair: str = ""
    suffix: str = ""

    def variable(self, index: int) -> str:
        """Return the name of what a node gives."""
        return f"t{index}{self.suffix}"

    def write(self, template: str, **operands: str) -> str:
        """Return the template with the operands and the words in place."""
        return template.format(**operands, **self.words)


@dataclass(frozen=True)
class Assignment:
    """One variable, what it holds, and its expression."""

    variable: str
    kind: Literal["number", "truth", "pair"]
    expression: str


def assignments(program: Program, language: Language) -> Iterator[Assignment]:
    """Yield a variable for each input and operation, in order; constants stand where they are used."""
    paired: set[int] = set()
    for index, node in enumerate(program.nodes):
        if isinstance(node, Input):
            yield Assignment(language.variable(index), "number", language.load(node))
        elif isinstance(node, Operation):
            numbers = [as_number(program, i, language) for i in node.operands]
            truths = [_as_truth(program, i, language) for i in node.operands]
            named = dict(zip("ab", numbers, strict=False)) | dict(zip("pq", truths, strict=False))
            if language.pair and node.code in CIRCULAR:
                operand = node.operands[0]
                named["pair"] = f"p{operand}{language.suffix}"
                if operand not in paired:
                    paired.add(operand)
                    yield Assignment(named["pair"], "pair", language.write(language.pair, **named))
            kind: Literal["number", "truth"] = "truth" if node.code in TRUTH else "number"
            yield Assignment(language.variable(index), kind, language.write(language.operations[node.code], **named))


def as_number(program: Program, index: int, language: Language) -> str:
    """Return how the value of a node is written as a number."""
    node = program.nodes[index]
    if isinstance(node, Constant):
        return language.constant(node.value)
    name = language.variable(index)
    return language.write(language.number, p=name) if _is_truth(program, index) else name


def _as_truth(program: Program, index: int, language: Language) -> str:
    if _is_truth(program, index):
        return language.variable(index)
    return language.write(language.truth, a=as_number(program, index, language))


def _is_truth(program: Program, index: int) -> bool:
    node = program.nodes[index]
    return isinstance(node, Operation) and node.code in TRUTH
