"""Loader: a kernel on disk, or a C text, to the form that this machine can run it in."""

from optsat.kernels import cache
from optsat.kernels.binding import find_binding
from optsat.kernels.bound_form import MAX_PORTS, BoundForm
from optsat.kernels.compilation import compiled
from optsat.kernels.ctypes_form import CtypesForm
from optsat.kernels.entry import Entry
from optsat.kernels.form import Form
from optsat.kernels.processor import check_denormals
from optsat.kernels.record import KernelRecord


def load_form(key: str) -> tuple[Form, Entry] | None:
    """Return a kernel of the cache by its key, None where it is not there or made for another processor.

    Raises
    ------
    UnloadableError : it is there and the system loads it from nowhere.
    DenormalsFlushedError : this thread computes without denormal numbers.
    """
    return cache.load(key, bound)


def compile_form(record: KernelRecord, text: str) -> tuple[Form, Entry]:
    """Return a kernel of a C text, compiled unless the cache holds it.

    record : name, real, ports, status, libm and operations

    Raises
    ------
    OptsatError : as `compiled`.
    """
    return compiled(record, text, bound)


def bound(library: str, record: KernelRecord) -> Form:
    """Return a library in the fastest form that this machine has.

    Raises
    ------
    OSError : the system does not load it. DenormalsFlushedError : this thread computes without denormal numbers.
    """
    check_denormals()
    found = find_binding()
    if found and len(record.inputs) + len(record.outputs) <= MAX_PORTS:
        return BoundForm(*found, library, record)
    return CtypesForm(library, record)
