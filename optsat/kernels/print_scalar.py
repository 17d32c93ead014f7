"""Scalar printer: a program as one C99 function of one sample, in the real type of `os_rt.h`."""

from math import isinf, isnan

from optsat.kernels.codes import ARITY, LIBM
from optsat.kernels.elementary import OWN, Math, headers_of
from optsat.kernels.expressions import Language, as_number, assignments
from optsat.kernels.program import Input, Pattern, Program, starts

OPERATIONS: dict[str, str] = {
    "ADD": "{a} + {b}",
    "SUB": "{a} - {b}",
    "MUL": "{a} * {b}",
    "DIV": "{a} / {b}",
    "NEG": "-{a}",
    "SQ": "{a} * {a}",
    "TWICE": "{a} + {a}",
    "INV": "{one} / {a}",
    "SQRT": "os_sqrt({a})",
    "FABS": "os_fabs({a})",
    "FLOOR": "os_floor({a})",
    "CEIL": "os_ceil({a})",
    "FMAX": "os_fmax({a}, {b})",
    "FMIN": "os_fmin({a}, {b})",
    "SIGN": "os_sign({a})",
    "COPYSIGN": "os_copysign({a}, {b})",
    "IF_ELSE_ZERO": "{p} ? {b} : {zero}",
    "LT": "{a} < {b}",
    "LE": "{a} <= {b}",
    "EQ": "os_equal({a}, {b})",
    "NE": "!os_equal({a}, {b})",
    "NOT": "!{p}",
    "AND": "{p} && {q}",
    "OR": "{p} || {q}",
    **{
        code: f"os_libm_{name}({{a}}, {{b}})" if ARITY[code] == 2 else f"os_libm_{name}({{a}})"
        for code, name in LIBM.items()
    },
}
"""Expression by code."""

_TYPES = {"number": "os_real_t", "truth": "bool", "pair": "os_sine_cosine_t"}


def print_scalar(program: Program, dense: bool = False, math: Math = "own") -> str:
    """Return `static inline void NAME_leaf(const os_real_t *x, os_real_t *y)` over arguments and results in a row each.

    program : folded, as `lower` returns it
    All of x is read before any of y is written, so the two may be the same memory. One text serves double and float;
    the headers that it needs beside `os_rt.h` are included at its head.
    dense : matrices hold all their entries, counted by rows as NumPy does, structural zeros of the results stored as 0;
    otherwise their non-zeros alone, counted by columns as CasADi does
    math : our own elementary functions where we have them, or those of the machine's library alone
    """
    language = _language(program, dense, math)
    lines = [
        f"    const {_TYPES[each.kind]} {each.variable} = {each.expression};" for each in assignments(program, language)
    ]
    if not any(isinstance(node, Input) for node in program.nodes):
        lines.append("    (void)x;")
    stores = stores_of(program, language, dense)
    text = "\n".join(
        [
            f"/* x: {listed(program.inputs, dense)}; y: {listed(program.outputs, dense)} */",
            f"static inline void {program.name}_leaf(const os_real_t *x, os_real_t *y)",
            "{",
            *lines,
            *(stores or ["    (void)y;"]),
            "}",
            "",
        ]
    )
    includes = [f'#include "{header}"\n' for header in headers_of(text)]
    return "".join([*includes, *(["\n"] if includes else []), text])


def _language(program: Program, dense: bool, math: Math) -> Language:
    offsets = [pattern.offsets(dense) for pattern in program.inputs]
    start = starts(program.inputs, dense)
    return Language(
        operations={**OPERATIONS, **OWN} if math == "own" else OPERATIONS,
        number="({p} ? {one} : {zero})",
        truth="os_truth({a})",
        constant=c_constant,
        load=lambda node: f"x[{start[node.argument] + offsets[node.argument][node.element]}]",
        words={"one": c_constant(1.0), "zero": c_constant(0.0)},
        pair="os_sine_cosine({a})" if math == "own" else "",
    )


def c_constant(value: float) -> str:
    """Return a number of the type os_real_t in hexadecimal digits, which every compiler reads as the same bits."""
    if isnan(value):
        return "((os_real_t)NAN)"
    if isinf(value):
        return f"((os_real_t){'-' if value < 0.0 else ''}INFINITY)"
    mantissa, exponent = value.hex().split("p")
    digits = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
    return f"((os_real_t){digits}p{exponent})"


def stores_of(program: Program, language: Language, dense: bool, place: str = "{k}") -> list[str]:
    """Return the statements that store the results.

    place : template of where in y the number {k} of all results stands
    """
    stores = []
    for pattern, result, start in zip(program.outputs, program.results, starts(program.outputs, dense), strict=False):
        written = {
            offset: as_number(program, i, language) for offset, i in zip(pattern.offsets(dense), result, strict=True)
        }
        stores += [
            f"    y[{place.format(k=start + k)}] = {written.get(k, language.words['zero'])};"
            for k in range(pattern.length(dense))
        ]
    return stores


def listed(patterns: tuple[Pattern, ...], dense: bool) -> str:
    """Return names and lengths, for a comment."""
    return ", ".join(f"{pattern.name} ({pattern.length(dense)})" for pattern in patterns) or "nothing"
