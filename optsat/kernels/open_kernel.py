"""Open kernel: a kernel by its definition or by its key, from the cache where it is there, else made."""

from typing import Any

from optsat.errors import InputError, OptsatError, explain_unknown_options
from optsat.kernels.cache import UnloadableError
from optsat.kernels.compilation import digest_of
from optsat.kernels.definition import Definition
from optsat.kernels.elementary import Math
from optsat.kernels.fingerprint import CompilerRefusedError
from optsat.kernels.index import find_key, note_key
from optsat.kernels.interpreted import interpreted
from optsat.kernels.kernel import Kernel
from optsat.kernels.leaf import leaf_source
from optsat.kernels.loader import compile_form, load_form
from optsat.kernels.lowering import lower
from optsat.kernels.processor import lane_width
from optsat.kernels.record import KernelRecord
from optsat.kernels.request import Request, request
from optsat.kernels.source import KernelSource
from optsat.kernels.toolchain import CompilationError, CompilerMissingError
from optsat.kernels.unit import Real, library_text


class KernelChangedError(OptsatError):
    """A kernel that came from another process is defined otherwise here."""


def open_kernel(definition: str, real: Real = "double", math: Math = "own", **parameters: Any) -> Kernel:
    """Return the kernel that a function defines; one in the cache is ready in a millisecond without CasADi.

    The first of a process takes two or three: it loads the binding and looks at the compiler and the files of optsat.

    definition : "module:function", a function that returns a GeneratedFunction or a KernelSource
    real, math : as of `make_kernel`; parameters : of the function, plain numbers, texts, lists or arrays

    Raises
    ------
    InputError : there is no such function, or it defines no kernel.
    OptsatError : as `make_kernel`.
    """
    _check_choices(real, math)
    wanted = request(definition, real, math, parameters)
    key = find_key(wanted)
    if key is not None and (loaded := load_form(key)):
        form, entry = loaded
        return Kernel(entry.record, form, wanted, entry.text)
    kernel = _made(wanted.build(), real, math, wanted)
    if kernel.is_compiled:
        note_key(wanted, kernel.record.key)
    return kernel


@explain_unknown_options
def make_kernel(definition: Definition | KernelSource, real: Real = "double", math: Math = "own") -> Kernel:
    """Return the kernel of a symbolic function or of a kernel source, compiled unless the cache holds it.

    real : "float" computes in single precision
    math : elementary functions of a symbolic function, "own" with the same bits on every machine, or those of "libm"

    Without a compiler it runs interpreted, slower, and a warning says so. It calls the machine's library then, so that
    results with elementary functions differ in the last bits, as `record.libm` tells.

    Raises
    ------
    InputError : an operation or constant that no kernel can have, or too many operations.
    OptsatError : it can neither be compiled nor interpreted.
    """
    _check_choices(real, math)
    return _made(definition, real, math, None)


def source_of(definition: Definition | KernelSource, math: Math) -> KernelSource:
    """Return the kernel source of a symbolic function; one that is a source already stays as it is.

    Raises
    ------
    InputError : an operation that no kernel knows, or too many of them.
    """
    if isinstance(definition, KernelSource):
        return definition
    names = [[port.name for port in ports] for ports in (definition.inputs, definition.outputs)]
    program = lower(definition.casadi, names_in=names[0], names_out=names[1])
    return leaf_source(program, definition.inputs, definition.outputs, math)


def reopen(key: str, source: str, wanted: Request | None, portable: Any) -> Kernel:
    """Return a kernel that was pickled: by its key, else by its definition, else by what travelled with it.

    key, source : digests of its record; portable : record and C text, or what an interpreted kernel was made of

    Raises
    ------
    KernelChangedError : the definition has another C text here than where the kernel comes from.
    OptsatError : as `make_kernel`.
    """
    if key and (loaded := load_form(key)):
        form, entry = loaded
        return Kernel(entry.record, form, wanted, entry.text)
    if wanted is not None:
        kernel = _made(wanted.build(), wanted.real, wanted.math, wanted)
        if kernel.record.source != source:
            raise KernelChangedError(
                f"{wanted.definition} gives another kernel here than in the process that sent it ({source[:12]} there, "
                f"{kernel.record.source[:12]} here). Give both the same version of optsat, CasADi and that module."
            )
        return kernel
    if not isinstance(portable, tuple):
        return _made(portable, "double", "libm", None)
    record, c_text = portable
    form, entry = compile_form(record, c_text)
    return Kernel(entry.record, form, None, lambda: c_text)


def _made(definition: Definition | KernelSource, real: Real, math: Math, wanted: Request | None) -> Kernel:
    source = source_of(definition, math)
    text = library_text(source, real, lane_width(real))
    record = _record(source, real, text)
    try:
        form, entry = compile_form(record, text)
    except (CompilerMissingError, CompilerRefusedError, CompilationError, UnloadableError) as reason:
        # CasADi's machine calls the library
        record = _record(source_of(definition, "libm"), real, text)
        return Kernel(record, interpreted(definition, record, reason), wanted or definition, lambda: text)
    return Kernel(entry.record, form, wanted, lambda: text)


def _record(source: KernelSource, real: Real, text: str) -> KernelRecord:
    return KernelRecord(
        name=source.name,
        real=real,
        inputs=source.inputs,
        outputs=source.outputs,
        has_status=source.has_status,
        libm=source.libm,
        operations=source.operations,
        has_short_loops=source.has_short_loops,
        source=digest_of(library_text(source, real)),
        text=digest_of(text),
    )


def _check_choices(real: Real, math: Math) -> None:
    if real not in ("double", "float"):
        raise InputError(f"`real` must be 'double' or 'float', got {real!r}.")
    if math not in ("own", "libm"):
        raise InputError(f"`math` must be 'own' or 'libm', got {math!r}.")
