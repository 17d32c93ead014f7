"""NumPy printer: a program as a readable Python module over many samples, the second oracle beside CasADi."""

import keyword
import re
from collections.abc import Iterable

from optsat.kernels.codes import ARITY, LIBM
from optsat.kernels.expressions import Language, as_number, assignments
from optsat.kernels.program import Pattern, Program

_NAMED_OTHERWISE = {
    **{f"a{name}": f"np.arc{name}" for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh", "tan2")},
    "pow": "np.power",
    "erf": "erf",
    "remainder": "ieee_remainder",
}


def _of_libm(code: str) -> str:
    name = LIBM[code]
    function = _NAMED_OTHERWISE.get(name, f"np.{name}")
    return f"{function}({{a}}, {{b}})" if ARITY[code] == 2 else f"{function}({{a}})"


OPERATIONS: dict[str, str] = {
    "ADD": "{a} + {b}",
    "SUB": "{a} - {b}",
    "MUL": "{a} * {b}",
    "DIV": "{a} / {b}",
    "NEG": "-{a}",
    "SQ": "{a} * {a}",
    "TWICE": "2.0 * {a}",
    "INV": "1.0 / {a}",
    "SQRT": "np.sqrt({a})",
    "FABS": "np.abs({a})",
    "FLOOR": "np.floor({a})",
    "CEIL": "np.ceil({a})",
    # not NumPy's maximum and fmax, which treat NaN or a tie of +0 and -0 otherwise
    "FMAX": "np.where(np.isnan({b}) | ({a} >= {b}), {a}, {b})",
    "FMIN": "np.where(np.isnan({b}) | ({a} <= {b}), {a}, {b})",
    "SIGN": "np.where({a} > 0.0, 1.0, np.where({a} < 0.0, -1.0, {a}))",
    "COPYSIGN": "np.where(np.isnan({b}), np.abs({a}), np.copysign({a}, {b}))",
    "IF_ELSE_ZERO": "np.where({p}, {b}, 0.0)",
    "LT": "{a} < {b}",
    "LE": "{a} <= {b}",
    "EQ": "{a} == {b}",
    "NE": "{a} != {b}",
    "NOT": "~{p}",
    "AND": "{p} & {q}",
    "OR": "{p} | {q}",
    **{code: _of_libm(code) for code in LIBM},
}
"""Expression by code."""

IEEE_REMAINDER = '''

def ieee_remainder(a, b):
    """Return a - n b with n the integer nearest to a / b, the even one at a tie: the remainder of C, exact."""
    size = np.abs(b)
    rest = np.fmod(np.abs(a), 2.0 * size)
    less = rest - size
    less = np.where(less >= size - less, less - size, less)
    rest = np.where(rest > size - rest, less, rest)
    return np.where(np.signbit(a), -rest, rest)

'''


def print_numpy(program: Program, dense: bool = False) -> str:
    """Return a Python module that holds the program as a function of arrays (..., k), one for each argument.

    program : folded, as `lower` returns it
    The arrays are float64, and so are the results (..., k), a tuple where there are several. Arithmetic has the bits of
    the C form; NumPy's own elementary functions are not those of the C library, and agree to a few units in the last
    place.
    dense : as in `print_scalar`
    """
    names = _unique_names(program)
    arguments = names[: len(program.inputs)]
    results = names[len(program.inputs) :]
    language = _language(program, arguments, dense)
    lines = [
        f"lead = np.broadcast_shapes({', '.join(f'{name}.shape[:-1]' for name in arguments)})",
        *(f"{each.variable} = {each.expression}" for each in assignments(program, language)),
    ]
    for name, pattern, result in zip(results, program.outputs, program.results, strict=True):
        lines.append(f"{name} = np.zeros((*lead, {pattern.length(dense)}))")
        offsets = pattern.offsets(dense)
        lines += [f"{name}[..., {k}] = {as_number(program, i, language)}" for k, i in zip(offsets, result, strict=True)]
    lines.append(f"return {', '.join(results) if len(results) != 1 else results[0]}".rstrip())
    return "\n".join(
        [
            *_header(program),
            '@np.errstate(all="ignore")',
            f"def {_allowed(program.name, set())}({', '.join(arguments)}):",
            f'    """{_shapes(arguments, program.inputs, dense)} -> {_shapes(results, program.outputs, dense)}."""',
            *(f"    {line}" for line in lines),
            "",
        ]
    )


def _header(program: Program) -> list[str]:
    lines = ["import numpy as np"]
    if "erf" in program.libm:
        lines.append("from scipy.special import erf")
    return [*lines, IEEE_REMAINDER if "remainder" in program.libm else "\n"]


def _language(program: Program, arguments: list[str], dense: bool) -> Language:
    offsets = [pattern.offsets(dense) for pattern in program.inputs]
    return Language(
        operations=OPERATIONS,
        number="{p}.astype(float)",
        truth="({a} != 0.0)",
        constant=_literal,
        load=lambda node: f"{arguments[node.argument]}[..., {offsets[node.argument][node.element]}]",
        words={},
    )


def _literal(value: float) -> str:
    if value != value or value in (float("inf"), float("-inf")):
        return "np.nan" if value != value else "np.inf" if value > 0.0 else "(-np.inf)"
    return f"({value!r})" if repr(value).startswith("-") else repr(value)


def _unique_names(program: Program) -> list[str]:
    taken: set[str] = set()
    names = []
    for pattern in (*program.inputs, *program.outputs):
        names.append(_allowed(pattern.name, taken))
        taken.add(names[-1])
    return names


def _allowed(name: str, taken: Iterable[str]) -> str:
    own = {"np", "erf", "ieee_remainder", "lead"}
    while name in own or name in taken or keyword.iskeyword(name) or re.fullmatch(r"t\d+", name):
        name += "_"
    return name


def _shapes(names: list[str], patterns: tuple[Pattern, ...], dense: bool) -> str:
    spelt = (f"{name} (..., {pattern.length(dense)})" for name, pattern in zip(names, patterns, strict=True))
    return ", ".join(spelt) or "nothing"
