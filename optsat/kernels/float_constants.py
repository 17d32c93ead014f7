"""Constants of a C text that `float` cannot hold: they would become 0 or infinity and take a guard with them."""

import re

import numpy as np

from optsat.errors import InputError

_CONSTANT = re.compile(r"\(os_real_t\)\s*\(?(-?0[xX][0-9a-fA-F.]+[pP][+-]?\d+|-?\d+\.\d*(?:[eE][+-]?\d+)?)")
_SMALLEST, _LARGEST = float(np.finfo(np.float32).tiny), float(np.finfo(np.float32).max)


def check_float_constants(kernel: str, text: str) -> None:
    """Refuse a constant of type os_real_t that overflows in `float`, or is not 0 and below its smallest normal number.

    Raises
    ------
    InputError : shows the constant and the line that it stands in.
    """
    for line in text.splitlines():
        for word in _CONSTANT.findall(line):
            value = float.fromhex(word) if "x" in word.lower() else float(word)
            with np.errstate(over="ignore", under="ignore"):
                rounded = abs(float(np.float32(value)))
            if value != 0.0 and not _SMALLEST <= rounded <= _LARGEST:
                fault = "overflows" if rounded > _LARGEST else "underflows"
                raise InputError(
                    f"{kernel}: the constant {value!r} {fault} in float, in `{line.strip()}`. "
                    "Scale the model, or build it with a constant that float can hold."
                )
