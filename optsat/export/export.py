"""Export: kernels as a folder of freestanding C, written once it was compiled and answered as Python does."""

import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optsat.errors import InputError, explain_unknown_options, nearest_name
from optsat.export.bundle import Bundle
from optsat.export.catalogue import ARITHMETIC, Kernel, build, entry_named
from optsat.export.definition import Definition, define
from optsat.export.interface import Interface
from optsat.export.misra import Extent, check, print_record
from optsat.export.object_file import ObjectFile
from optsat.export.print_readme import print_readme
from optsat.export.provenance import Measured
from optsat.export.target import TARGETS, Precision, Target
from optsat.export.verify import Replay, Verification, check_answers, verify
from optsat.files import write_atomically
from optsat.kernels.float_constants import check_float_constants

_EXTENTS: Mapping[str, Extent] = {"none": "none", "small": "small", "all": "all"}
_PRECISIONS: Mapping[str, Precision] = {"float": "float", "double": "double"}


@dataclass(frozen=True)
class ExportedKernel:
    """One kernel of an export: what it is, and what its object file and its self-test said, None where not done."""

    definition: Definition
    functions: tuple[str, ...]
    object_file: ObjectFile | None
    replay: Replay | None


@dataclass(frozen=True)
class Export:
    """What was written where, for what, and how it was checked.

    files : names in `folder`; unchecked : one sentence for each check that was not made
    """

    folder: Path
    target: Target
    precision: Precision
    files: tuple[str, ...]
    kernels: tuple[ExportedKernel, ...]
    compiler: str
    unchecked: tuple[str, ...]


@explain_unknown_options
def export_c(
    kernels: Sequence[str | Kernel] | str | Kernel,
    folder: str | Path,
    target: str = "desktop",
    precision: str | None = None,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    keep_last: Mapping[str, Sequence[str]] | None = None,
    force: bool = False,
    misra: str = "small",
) -> Export:
    """Write kernels as flight C with header, self-test, build files and provenance; compile and run them first.

    kernels : names of the catalogue, generated functions or kernel sources
    target : "desktop", "cortex-m4" or "cortex-m7"; precision : "float" or "double", by default that of its processor
    parameters : by name of the kernel, what its definition takes; keep_last : by name, results that hold their last
    good value after a failure
    force : replace files that are there; misra : which kernels to check against MISRA C,
    "none", "small" or "all"; large ones take minutes

    Raises
    ------
    InputError : an unknown name (the nearest is offered), a constant that float cannot hold, files in the way.
    SelfTestError : the C does not answer as Python does; ToolError : the compiler fails. Nothing is written then.
    OSError : the folder cannot be made or written.
    """
    if misra not in _EXTENTS:
        raise InputError(f"`misra` must be 'none', 'small' or 'all', got {misra!r}.")
    bundle = gather(kernels, target, precision, parameters or {}, keep_last or {})
    out = Path(folder)
    draft = bundle.texts({})
    _check_free(out, [*draft, "README.md", "DEVIATIONS.md"], force)
    with _written(draft) as folder_of_draft:
        found = verify(bundle, folder_of_draft)
    check_answers(found, bundle.allowed)
    texts = bundle.texts({name: _measured(name, found) for name in bundle.names})
    texts["DEVIATIONS.md"], unchecked = _deviations(bundle, texts, _EXTENTS[misra])
    export = Export(
        folder=out,
        target=bundle.target,
        precision=bundle.precision,
        files=tuple(sorted([*texts, "README.md"])),
        kernels=tuple(
            ExportedKernel(d, i.functions, found.objects.get(d.source.name), found.replays.get(d.source.name))
            for d, i in zip(bundle.definitions, bundle.interfaces, strict=True)
        ),
        compiler=found.compiler,
        unchecked=(*found.missing, *unchecked),
    )
    texts["README.md"] = print_readme(export)
    out.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        write_atomically(out / name, text.encode())
    return export


@contextmanager
def _written(texts: Mapping[str, str]) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="optsat-export-") as temporary:
        for name, text in texts.items():
            (Path(temporary) / name).write_text(text, encoding="utf-8")
        yield Path(temporary)


def _deviations(bundle: Bundle, texts: Mapping[str, str], extent: Extent) -> tuple[str, list[str]]:
    # of the final texts, whose lines the record names
    with _written(texts) as folder:
        findings, unchecked = check(bundle, folder, extent)
    return print_record(findings, unchecked), unchecked


def gather(
    kernels: Sequence[str | Kernel] | str | Kernel,
    target: str,
    precision: str | None,
    parameters: Mapping[str, Mapping[str, Any]],
    keep_last: Mapping[str, Sequence[str]],
) -> Bundle:
    """Return the bundle of these kernels; nothing is compiled or written.

    Raises
    ------
    InputError : an unknown name, two kernels of one name, none at all, or a constant that float cannot hold.
    """
    if target not in TARGETS:
        raise InputError(f"There is no target `{target}`.{nearest_name(target, list(TARGETS))}")
    real = _precision(precision, TARGETS[target])
    listed = [kernels] if isinstance(kernels, str | Kernel) else list(kernels)
    definitions = [_definition(each, real, parameters) for each in listed]
    names = [definition.source.name for definition in definitions]
    if not names:
        raise InputError("No kernel was named; see `optsat export --list`.")
    if repeated := {name for name in names if names.count(name) > 1}:
        raise InputError(f"Kernel {min(repeated)} was named twice.")
    for option, given in (("parameters", parameters), ("keep_last", keep_last)):
        for name in given:
            if name not in names:
                raise InputError(f"`{option}` names {name}, which is not exported.{nearest_name(name, names)}")
    if real == "float":
        for definition in definitions:
            check_float_constants(definition.source.name, definition.source.body)
    interfaces = [Interface(d.source, tuple(keep_last.get(d.source.name, ()))) for d in definitions]
    return Bundle(tuple(definitions), tuple(interfaces), TARGETS[target], real)


def _precision(name: str | None, target: Target) -> Precision:
    if name is None:
        return target.natural
    if name not in _PRECISIONS:
        raise InputError(f"`precision` must be 'float' or 'double', got {name!r}.")
    return _PRECISIONS[name]


def _definition(kernel: str | Kernel, precision: Precision, parameters: Mapping[str, Mapping[str, Any]]) -> Definition:
    if not isinstance(kernel, str):
        return define(kernel)
    chosen = parameters.get(kernel, {})
    return define(build(kernel, precision, **chosen), _baked_in(kernel, precision, chosen))


def _baked_in(kernel: str, precision: Precision, chosen: Mapping[str, Any]) -> dict[str, Any]:
    """Return every parameter of the definition by name, defaults included, as JSON values."""
    entry = entry_named(kernel)
    values = {parameter.name: parameter.default for parameter in entry.parameters()}
    values |= {name: value for name, value in ARITHMETIC[precision].items() if name in values}
    values |= {**chosen, **entry.fixed}
    return {name: json.loads(json.dumps(value, default=_as_list)) for name, value in sorted(values.items())}


def _as_list(value: Any) -> Any:
    return np.asarray(value).tolist()


def _check_free(folder: Path, names: Sequence[str], force: bool) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file. Name a folder for the export.")
    there = sorted(name for name in names if (folder / name).exists())
    if there and not force:
        more = f" and {len(there) - 1} more" if len(there) > 1 else ""
        raise InputError(f"{folder} already holds {there[0]}{more}. Name another folder, or replace them with --force.")


def _measured(name: str, found: Verification) -> Measured:
    object_file, replay = found.objects.get(name), found.replays.get(name)
    return Measured(
        stack=object_file.stack if object_file else None,
        outside=object_file.outside if object_file else (),
        compiler=found.compiler,
        error=replay.error if replay else None,
    )
