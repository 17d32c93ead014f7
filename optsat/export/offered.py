"""Offered kernels, compiled for this machine, by their public names."""

from typing import Any

from optsat.export.catalogue import Precision, chosen, entry_named
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import open_kernel


def kernel(name: str, precision: Precision = "double", **parameters: Any) -> Kernel:
    """Return an offered kernel ready to call, such as "wahba_4"; `optsat export --list` shows all of them.

    It is compiled once, kept in the cache, and opened from there without CasADi.
    precision : of the arithmetic
    parameters : of its definition, such as `inertia_B`

    Raises
    ------
    InputError : no such kernel or precision (the nearest name is offered), or a parameter that its definition refuses.
    UnknownOptionError : the kernel has no such parameter; the nearest is offered.
    """
    return open_kernel(entry_named(name).definition, precision, **chosen(name, precision, parameters))
