"""Scalar printer: a program as one C99 function of one sample."""

import math
from typing import Literal

import numpy as np

from optsat.errors import InputError
from optsat.kernels.codes import ARITY, LIBM
from optsat.kernels.expressions import Language, as_number, assignments
from optsat.kernels.program import Constant, Input, Operation, Pattern, Program, starts

Real = Literal["double", "float"]

PRELUDE = """\
#include <math.h>
#include <stdbool.h>

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "compile without -ffast-math: NaN, signed zeros and the order of operations are part of the results"
#endif
"""
"""What stands once above the leaves of a file."""

OPERATIONS: dict[str, str] = {
    "ADD": "{a} + {b}",
    "SUB": "{a} - {b}",
    "MUL": "{a} * {b}",
    "DIV": "{a} / {b}",
    "NEG": "-{a}",
    "SQ": "{a} * {a}",
    "TWICE": "{a} + {a}",
    "INV": "{one} / {a}",
    "SQRT": "sqrt{f}({a})",
    "FABS": "fabs{f}({a})",
    "FLOOR": "floor{f}({a})",
    "CEIL": "ceil{f}({a})",
    # not C's fmax and fmin, which leave open what a tie of +0 and -0 returns
    "FMAX": "(isnan({b}) || {a} >= {b}) ? {a} : {b}",
    "FMIN": "(isnan({b}) || {a} <= {b}) ? {a} : {b}",
    "SIGN": "({a} > {zero}) ? {one} : (({a} < {zero}) ? -{one} : {a})",
    "COPYSIGN": "isnan({b}) ? fabs{f}({a}) : copysign{f}({a}, {b})",
    "IF_ELSE_ZERO": "{p} ? {b} : {zero}",
    "LT": "{a} < {b}",
    "LE": "{a} <= {b}",
    "EQ": "{a} == {b}",
    "NE": "{a} != {b}",
    "NOT": "!{p}",
    "AND": "{p} && {q}",
    "OR": "{p} || {q}",
    **{
        code: f"{name}{{f}}({{a}}, {{b}})" if ARITY[code] == 2 else f"{name}{{f}}({{a}})" for code, name in LIBM.items()
    },
}
"""Expression by code."""

SMALLEST_NORMAL_FLOAT = 2.0**-126


def print_scalar(program: Program, real: Real = "double", dense: bool = False) -> str:
    """Return `static inline void NAME_leaf(const REAL *x, REAL *y)` over the arguments and the results in a row each.

    program : folded, as `lower` returns it
    All of x is read before any of y is written, so the two may be the same memory.
    dense : matrices hold all their entries, counted by rows as NumPy does, structural zeros of the results stored as 0;
    otherwise their non-zeros alone, counted by columns as CasADi does

    Raises
    ------
    InputError : a constant is too large or too small for `float`; the message shows it and the operation that uses it.
    """
    if real == "float":
        _check_constants(program)
    language = _language(program, real, dense)
    lines = [
        f"    const {'bool' if each.is_truth else real} {each.variable} = {each.expression};"
        for each in assignments(program, language)
    ]
    if not any(isinstance(node, Input) for node in program.nodes):
        lines.append("    (void)x;")
    stores = _stores(program, language, dense)
    return "\n".join(
        [
            f"/* x: {_listed(program.inputs, dense)}; y: {_listed(program.outputs, dense)} */",
            f"static inline void {program.name}_leaf(const {real} *x, {real} *y)",
            "{",
            *lines,
            *(stores or ["    (void)y;"]),
            "}",
            "",
        ]
    )


def _language(program: Program, real: Real, dense: bool) -> Language:
    suffix = "f" if real == "float" else ""
    offsets = [pattern.offsets(dense) for pattern in program.inputs]
    start = starts(program.inputs, dense)
    return Language(
        operations=OPERATIONS,
        number="({p} ? {one} : {zero})",
        truth="({a} != {zero})",
        constant=lambda value: _literal(value, real),
        load=lambda node: f"x[{start[node.argument] + offsets[node.argument][node.element]}]",
        words={"f": suffix, "one": f"1.0{suffix}", "zero": f"0.0{suffix}"},
    )


def _literal(value: float, real: Real) -> str:
    """A hexadecimal constant, which every compiler reads as the same bits."""
    if math.isnan(value):
        return f"(({real})NAN)"
    if math.isinf(value):
        return f"({'-' if value < 0.0 else ''}({real})INFINITY)"
    rounded = float(np.float32(value)) if real == "float" else value
    mantissa, exponent = rounded.hex().split("p")
    digits = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    literal = f"{digits}p{exponent}{'f' if real == 'float' else ''}"
    return f"({literal})" if literal.startswith("-") else literal


def _stores(program: Program, language: Language, dense: bool) -> list[str]:
    stores = []
    for pattern, result, start in zip(program.outputs, program.results, starts(program.outputs, dense), strict=False):
        written = {
            offset: as_number(program, i, language) for offset, i in zip(pattern.offsets(dense), result, strict=True)
        }
        stores += [
            f"    y[{start + k}] = {written.get(k, language.words['zero'])};" for k in range(pattern.length(dense))
        ]
    return stores


def _listed(patterns: tuple[Pattern, ...], dense: bool) -> str:
    return ", ".join(f"{pattern.name} ({pattern.length(dense)})" for pattern in patterns) or "nothing"


def _check_constants(program: Program) -> None:
    for index, node in enumerate(program.nodes):
        if not isinstance(node, Constant) or not math.isfinite(node.value) or node.value == 0.0:
            continue
        with np.errstate(over="ignore", under="ignore"):
            rounded = abs(float(np.float32(node.value)))
        if math.isinf(rounded) or rounded < SMALLEST_NORMAL_FLOAT:
            fault = "overflows" if math.isinf(rounded) else "underflows"
            raise InputError(
                f"{program.name}: the constant {node.value!r} {fault} in float, in {_user(program, index)}. "
                "Scale the model, or build it with a constant that float can hold."
            )


def _user(program: Program, constant: int) -> str:
    for index, node in enumerate(program.nodes):
        if isinstance(node, Operation) and constant in node.operands:
            operands = (program.nodes[i] for i in node.operands)
            spelt = ", ".join(
                repr(operand.value) if isinstance(operand, Constant) else f"t{i}"
                for i, operand in zip(node.operands, operands, strict=True)
            )
            return f"t{index} = {node.code}({spelt})"
    output = next(k for k, result in enumerate(program.results) if constant in result)
    return f"result `{program.outputs[output].name}`"
