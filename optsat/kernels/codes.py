"""Codes: the operations of a CasADi SX function, and what each of them means to the last bit.

Operands are IEEE numbers; a truth value is 1 or 0, and as an operand anything but +0 and -0 is true, NaN too.

SQ x x; TWICE 2 x; INV 1 / x; NEG flips the sign bit, of 0 and NaN too; FABS clears it.
FMAX, FMIN lose a NaN and return the first operand at a tie: a where b is NaN or a >= b (a <= b for FMIN), else b.
SIGN is 1, -1, or the argument itself: NaN, +0 and -0 pass through.
COPYSIGN takes the sign bit of b; of a NaN it takes none, since the sign of a NaN differs between machines.
IF_ELSE_ZERO is x where the condition is true, else +0; the x not taken may be NaN.
The codes in LIBM are the C functions of that name: their last bits belong to the machine's mathematical library.
"""

from collections.abc import Mapping

ARITHMETIC: Mapping[str, int] = {"ADD": 2, "SUB": 2, "MUL": 2, "DIV": 2, "NEG": 1, "SQ": 1, "TWICE": 1, "INV": 1}
EXACT: Mapping[str, int] = {"SQRT": 1, "FABS": 1, "FLOOR": 1, "CEIL": 1}
CHOICE: Mapping[str, int] = {"FMAX": 2, "FMIN": 2, "SIGN": 1, "COPYSIGN": 2, "IF_ELSE_ZERO": 2}
TRUTH: Mapping[str, int] = {"LT": 2, "LE": 2, "EQ": 2, "NE": 2, "NOT": 1, "AND": 2, "OR": 2}

_EXPONENTIAL = ("exp", "log", "expm1", "log1p", "erf")
_CIRCULAR = ("sin", "cos", "tan", "asin", "acos", "atan")
_HYPERBOLIC = ("sinh", "cosh", "tanh", "asinh", "acosh", "atanh")
_OF_TWO = ("pow", "atan2", "hypot", "fmod", "remainder")

LIBM: Mapping[str, str] = {
    **{name.upper(): name for name in (*_EXPONENTIAL, *_CIRCULAR, *_HYPERBOLIC, *_OF_TWO)},
    "CONSTPOW": "pow",
}
"""C function by code."""

ARITY: Mapping[str, int] = {
    **ARITHMETIC,
    **EXACT,
    **CHOICE,
    **TRUTH,
    **{code: 2 if name in _OF_TWO else 1 for code, name in LIBM.items()},
}
"""Number of operands by code: all operations that a program may hold."""

COMMUTATIVE = frozenset({"ADD", "MUL", "EQ", "NE"})
"""Codes whose result does not depend on the order, to the bit."""

STRUCTURE = frozenset({"INPUT", "OUTPUT", "CONST"})
"""Codes that move data."""

COPIES = frozenset({"ASSIGN", "LIFT"})
"""Codes that return their first operand."""

REFUSED: Mapping[str, str] = {
    "PARAMETER": "a symbol that is no input: make it an input, or substitute its number before you build the function",
    "CALL": "a call that is not inlined: build the called function without `never_inline`",
    "PRINTME": "a print, which no kernel can do: take `printme` out of the expression",
    "ERFINV": "the inverse error function, which C does not have: write it with the functions that C has",
}
"""Codes that have no meaning in a kernel: what each is, and the cure."""
