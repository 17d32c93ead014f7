"""Open kernel: a kernel by its definition or by its key, from the cache where it is there, else made."""

from typing import Any

from optsat.errors import OptsatError
from optsat.kernels.cache import UnloadableError
from optsat.kernels.compilation import digest_of
from optsat.kernels.definition import Definition
from optsat.kernels.fingerprint import CompilerRefusedError
from optsat.kernels.index import find_key, note_key
from optsat.kernels.interpreted import interpreted
from optsat.kernels.kernel import Kernel
from optsat.kernels.leaf import leaf_source
from optsat.kernels.loader import compile_form, load_form
from optsat.kernels.lowering import lower
from optsat.kernels.record import KernelRecord
from optsat.kernels.request import Request, request
from optsat.kernels.source import KernelSource
from optsat.kernels.toolchain import CompilationError, CompilerMissingError
from optsat.kernels.unit import Real, library_text


class KernelChangedError(OptsatError):
    """A kernel that came from another process is defined otherwise here."""


def open_kernel(definition: str, real: Real = "double", **parameters: Any) -> Kernel:
    """Return the kernel that a function defines; one in the cache is ready in a millisecond, without CasADi.

    definition : "module:function", a function that returns a GeneratedFunction or a KernelSource
    real : "float" computes in single precision; parameters : of the function, plain numbers, texts, lists or arrays

    Raises
    ------
    InputError : there is no such function, or it defines no kernel.
    OptsatError : as `make_kernel`.
    """
    wanted = request(definition, real, parameters)
    key = find_key(wanted)
    if key is not None and (loaded := load_form(key)):
        form, entry = loaded
        return Kernel(entry.record, form, wanted, entry.text)
    kernel = _made(wanted.build(), real, wanted)
    if kernel.record.key:
        note_key(wanted, kernel.record.key)
    return kernel


def make_kernel(definition: Definition | KernelSource, real: Real = "double") -> Kernel:
    """Return the kernel of a symbolic function or of a kernel source, compiled unless the cache holds it.

    Without a compiler it runs interpreted, with the same results where `record.libm` is empty, and a warning says so.

    Raises
    ------
    InputError : an operation or constant that no kernel can have, or too many operations.
    OptsatError : it can neither be compiled nor interpreted.
    """
    return _made(definition, real, None)


def reopen(key: str, text: str, wanted: Request | None, portable: Any) -> Kernel:
    """Return a kernel that was pickled: by its key, else by its definition, else by what travelled with it.

    key, text : its digests; portable : record and C text, or what an interpreted kernel was made of

    Raises
    ------
    KernelChangedError : the definition has another C text here than where the kernel comes from.
    OptsatError : as `make_kernel`.
    """
    if key and (loaded := load_form(key)):
        form, entry = loaded
        return Kernel(entry.record, form, wanted, entry.text)
    if wanted is not None:
        kernel = _made(wanted.build(), wanted.real, wanted)
        if kernel.record.text != text:
            raise KernelChangedError(
                f"{wanted.definition} gives another kernel here than in the process that sent it ({text[:12]} there, "
                f"{kernel.record.text[:12]} here). Give both the same version of optsat, CasADi and that module."
            )
        return kernel
    if not isinstance(portable, tuple):
        return _made(portable, "double", None)
    record, c_text = portable
    form, entry = compile_form(record, c_text)
    return Kernel(entry.record, form, None, lambda: c_text)


def _made(definition: Definition | KernelSource, real: Real, wanted: Request | None) -> Kernel:
    source = definition if isinstance(definition, KernelSource) else _lowered(definition)
    text = library_text(source, real)
    record = KernelRecord(
        name=source.name,
        real=real,
        inputs=source.inputs,
        outputs=source.outputs,
        has_status=source.has_status,
        libm=source.libm,
        operations=source.operations,
        text=digest_of(text),
    )
    try:
        form, entry = compile_form(record, text)
    except (CompilerMissingError, CompilerRefusedError, CompilationError, UnloadableError) as reason:
        return Kernel(record, interpreted(definition, record, reason), wanted or definition, lambda: text)
    return Kernel(entry.record, form, wanted, lambda: text)


def _lowered(definition: Definition) -> KernelSource:
    names = [[port.name for port in ports] for ports in (definition.inputs, definition.outputs)]
    return leaf_source(
        lower(definition.casadi, names_in=names[0], names_out=names[1]), definition.inputs, definition.outputs
    )
