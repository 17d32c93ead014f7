"""Constants of a C text that `float` cannot hold: they would become 0 or infinity and take a guard with them."""

import re

import numpy as np

from optsat.errors import InputError

SMALLEST_NORMAL_FLOAT = 2.0**-126

_CONSTANT = re.compile(r"\(os_real_t\)\s*\(?(-?0[xX][0-9a-fA-F.]+[pP][+-]?\d+|-?\d+\.\d*(?:[eE][+-]?\d+)?)")


def lost_in_float(text: str) -> str:
    """Return the first constant that overflows or underflows in `float`, with the operation it stands in, or ""."""
    for line in text.splitlines():
        for word in _CONSTANT.findall(line):
            value = float.fromhex(word) if "x" in word.lower() else float(word)
            with np.errstate(over="ignore", under="ignore"):
                rounded = abs(float(np.float32(value)))
            if np.isinf(rounded) or (value != 0.0 and rounded < SMALLEST_NORMAL_FLOAT):
                fault = "overflows" if np.isinf(rounded) else "underflows"
                return f"the constant {value!r} {fault} in float, in `{line.strip()}`"
    return ""


def check_float(kernel: str, text: str) -> None:
    """Raise where a constant of the text is lost in `float`.

    Raises
    ------
    InputError : shows the constant and the operation.
    """
    if fault := lost_in_float(text):
        raise InputError(
            f"{kernel}: {fault}. Scale the model, build it with a constant that float can hold, or export it with "
            "`--precision double`."
        )
