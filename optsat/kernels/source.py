"""Kernel source: the C text of one kernel, whatever it is made of, and the ports that it is called through."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.kernels.elementary import headers_of
from optsat.port import Port

Twin = Callable[[Array], tuple[int, Array]]
"""The same computation in plain Python: x (k_in,) to status and y (k_out,)."""


Example = Callable[[np.random.Generator], Array]
"""Arguments in a row from a generator."""


@dataclass(frozen=True)
class KernelSource:
    """C text of a kernel over `os_rt.h`, in strict C99.

    Arguments stand dense, matrices counted by rows, one after another in x; results in y likewise.

    body : text that includes what it needs beside `os_rt.h` and defines either
        `static inline void NAME_leaf(const os_real_t *x, os_real_t *y)`, or where `has_status`
        `static os_status_t NAME_body(const os_real_t *x, os_real_t *y, NAME_work_t *work)` and its struct NAME_work_t;
        all of x is read before any of y is written
    lanes : text of the same leaf over vectors of several samples, or "" where there is none
    sides : vectors that each number of it is
    libm : the C functions used whose last bits depend on the machine
    operations : arithmetic operations of one sample, or of one iteration where they are not fixed
    twin : the same in plain Python, where no C compiler is; None for a leaf, which CasADi runs
    has_short_loops : over a small fixed number of lanes, modes or rows, which pay to be unrolled and kept in registers
    example : arguments x (k_in,) that belong together, drawn anew, where numbers drawn port by port would not
    float_ulp : how far a result in single precision may be from that of double, in units in the last place of the
        largest number that it has; more than usual where an iteration ends at rounding
    """

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    body: str
    has_status: bool = False
    lanes: str = ""
    sides: int = 1
    libm: tuple[str, ...] = ()
    operations: int = 0
    twin: Twin | None = None
    has_short_loops: bool = False
    example: Example | None = None
    float_ulp: float = 4096.0

    @property
    def is_exact(self) -> bool:
        """Whether Python gives the same bits: no elementary function is called, neither the library's nor our own."""
        return not self.libm and not headers_of(self.body)
