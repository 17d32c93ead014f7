"""Lanes printer: a program as one C function of several samples at once, with the bits of the scalar form in each."""

import re

from optsat.kernels.codes import ARITY, LIBM
from optsat.kernels.elementary import OWN, Math
from optsat.kernels.expressions import Language, assignments
from optsat.kernels.print_scalar import c_constant, listed, stores_of
from optsat.kernels.program import Input, Program, starts

OPERATIONS: dict[str, str] = {
    "ADD": "{a} + {b}",
    "SUB": "{a} - {b}",
    "MUL": "{a} * {b}",
    "DIV": "{a} / {b}",
    "NEG": "-{a}",
    "SQ": "{a} * {a}",
    "TWICE": "{a} + {a}",
    "INV": "{one} / {a}",
    "SQRT": "os_lanes_sqrt({a})",
    "FABS": "os_lanes_fabs({a})",
    "FLOOR": "os_lanes_floor({a})",
    "CEIL": "os_lanes_ceil({a})",
    "FMAX": "os_lanes_fmax({a}, {b})",
    "FMIN": "os_lanes_fmin({a}, {b})",
    "SIGN": "os_lanes_sign({a})",
    "COPYSIGN": "os_lanes_copysign({a}, {b})",
    "IF_ELSE_ZERO": "os_lanes_or_zero({p}, {b})",
    "LT": "(os_lanes_bool_t)({a} < {b})",
    "LE": "(os_lanes_bool_t)({a} <= {b})",
    "EQ": "os_lanes_equal({a}, {b})",
    "NE": "~os_lanes_equal({a}, {b})",
    "NOT": "~{p}",
    "AND": "{p} & {q}",
    "OR": "{p} | {q}",
    **{
        code: f"os_lanes_libm_{name}({{a}}, {{b}})" if ARITY[code] == 2 else f"os_lanes_libm_{name}({{a}})"
        for code, name in LIBM.items()
    },
}
"""Expression by code."""

_OWN = {code: re.sub(r"\bos_", "os_lanes_", template) for code, template in OWN.items()}
_TYPES = {"number": "os_lanes_real_t", "truth": "os_lanes_bool_t", "pair": "os_lanes_sine_cosine_t"}


def print_lanes(program: Program, dense: bool = False, math: Math = "own", sides: int = 1) -> str:
    """Return `NAME_lanes(const os_lanes_real_t *x, os_lanes_real_t *y)`: each number of the scalar leaf is a vector.

    program, dense, math : as in `print_scalar`
    sides : vectors that each number is, side by side in x and in y; their computations do not wait for each other, so
        the processor works on the next where it would wait for a division or a root of the first
    The text is the same for every width. All of x is read before any of y is written.
    """
    languages = [_language(program, dense, math, side, sides) for side in range(sides)]
    lines = [
        f"    const {_TYPES[each.kind]} {each.variable} = {each.expression};"
        for together in zip(*(assignments(program, language) for language in languages), strict=True)
        for each in together
    ]
    if not any(isinstance(node, Input) for node in program.nodes):
        lines.append("    (void)x;")
    stores = [
        line
        for side, language in enumerate(languages)
        for line in stores_of(program, language, dense, _place("{k}", side, sides))
    ]
    return "\n".join(
        [
            f"/* x: {listed(program.inputs, dense)}; y: {listed(program.outputs, dense)}; vectors for each: {sides} */",
            f"OS_LANE void {program.name}_lanes(const os_lanes_real_t *x, os_lanes_real_t *y)",
            "{",
            *lines,
            *(stores or ["    (void)y;"]),
            "}",
            "",
        ]
    )


def _place(k: object, side: int, sides: int) -> str:
    return str(k) if sides == 1 else f"{k} * {sides} + {side}"


def _language(program: Program, dense: bool, math: Math, side: int, sides: int) -> Language:
    offsets = [pattern.offsets(dense) for pattern in program.inputs]
    start = starts(program.inputs, dense)

    def load(node: Input) -> str:
        return f"x[{_place(start[node.argument] + offsets[node.argument][node.element], side, sides)}]"

    return Language(
        operations=OPERATIONS | _OWN if math == "own" else OPERATIONS,
        number="os_lanes_or_zero({p}, {one})",
        truth="os_lanes_truth({a})",
        constant=_constant,
        load=load,
        words={"one": _constant(1.0), "zero": _constant(0.0)},
        pair="os_lanes_sine_cosine({a})" if math == "own" else "",
        suffix="" if sides == 1 else f"_{side}",
    )


def _constant(value: float) -> str:
    return f"os_lanes_constant({c_constant(value)})"
