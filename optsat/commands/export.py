"""`optsat export`: kernels as flight C."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optsat.commands.output import AsJson, aligned, note, print_json

if TYPE_CHECKING:
    from optsat.export.export import Export, ExportedKernel


def export_command(
    kernels: Annotated[
        list[str] | None, typer.Argument(metavar="KERNEL...", help="Names of `--list`.", show_default=False)
    ] = None,
    target: Annotated[str, typer.Option(help="desktop, cortex-m4 or cortex-m7.")] = "desktop",
    precision: Annotated[
        str | None, typer.Option(help="float or double; that of the target's processor when absent.")
    ] = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the files.")] = Path("flight"),
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[KERNEL.]NAME=JSON",
            help="What a kernel is made with, such as inertia_B=[[2,0,0],[0,3,0],[0,0,4]].",
            show_default=False,
        ),
    ] = None,
    keep_last: Annotated[
        list[str] | None,
        typer.Option(
            metavar="[KERNEL.]RESULT",
            help="A result that holds its last good value after a failure.",
            show_default=False,
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace files that are there.")] = False,
    misra: Annotated[
        str, typer.Option(help="Kernels to check against MISRA C: none, small or all; large ones take minutes.")
    ] = "small",
    listed: Annotated[bool, typer.Option("--list", help="List the kernels and their parameters.")] = False,
    as_json: AsJson = False,
) -> None:
    """Write kernels as freestanding C, compile them, and replay stored answers of Python.

    Exit code 1 when the C answers otherwise than Python; nothing is written then.
    """
    if listed:
        _list(as_json)
        return
    from optsat.export.export import export_c
    from optsat.export.verify import SelfTestError

    names = kernels or []
    try:
        export = export_c(
            names,
            out,
            target,
            precision,
            _parameters(parameter or [], names),
            _kept(keep_last or [], names),
            force,
            misra,
        )
    except SelfTestError as error:
        note(f"optsat: {error}")
        raise typer.Exit(1) from None
    if as_json:
        print_json(document(export))
    else:
        typer.echo(_in_words(export))
    for sentence in export.unchecked:
        note(sentence)


def document(export: "Export") -> dict[str, Any]:
    """Return an export as plain JSON values."""
    return {
        "folder": str(export.folder),
        "target": export.target.name,
        "precision": export.precision,
        "compiler": export.compiler or None,
        "files": list(export.files),
        "kernels": [_kernel_document(kernel) for kernel in export.kernels],
        "unchecked": list(export.unchecked),
    }


def _kernel_document(kernel: "ExportedKernel") -> dict[str, Any]:
    found, said = kernel.object_file, kernel.replay
    return {
        "kernel": kernel.definition.source.name,
        "functions": list(kernel.functions),
        "model": kernel.definition.model,
        "operations": kernel.definition.source.operations,
        "libm": list(kernel.definition.source.libm),
        "object": None
        if found is None
        else {
            "text": found.text,
            "data": found.data,
            "bss": found.bss,
            "stack": found.stack,
            "stack_outside": list(found.outside),
            "undefined": list(found.undefined),
        },
        "replay": None
        if said is None
        else {
            "where": said.where,
            "vectors": said.vectors,
            "accepted": said.accepted,
            "numbers": said.numbers,
            "differing": said.differing,
            "worst_ulp": said.worst_ulp,
            "error": said.error,
            "bits": said.bits,
        },
    }


def _in_words(export: "Export") -> str:
    rows: list[tuple[Any, ...]] = [
        ("kernel", "text", "data", "bss", "stack", "vectors", "largest difference from Python")
    ]
    for kernel in export.kernels:
        found, said = kernel.object_file, kernel.replay
        sizes = ("-",) * 4 if found is None else (found.text, found.data, found.bss, _stack(found.stack))
        replayed = ("-", "not run") if said is None else (said.vectors, f"{said.worst_ulp:.3g} ulp ({said.error:.2g})")
        rows.append((kernel.definition.source.name, *sizes, *replayed))
    head = f"{export.folder}: {len(export.files)} files for {export.target.name} in {export.precision}"
    return f"{head}\n{aligned(rows)}"


def _stack(size: int | None) -> str:
    return "-" if size is None else str(size)


def _list(as_json: bool) -> None:
    from optsat.export.catalogue import CATALOGUE

    if as_json:
        print_json(
            [
                {
                    "kernel": name,
                    "says": entry.says,
                    "parameters": [{"name": each.name, "says": each.says} for each in entry.parameters()],
                }
                for name, entry in CATALOGUE.items()
            ]
        )
        return
    rows = []
    for name, entry in CATALOGUE.items():
        rows.append((name, entry.says))
        rows += [(f"  {each.name}", each.says) for each in entry.parameters()]
    typer.echo(aligned(rows))


def _parameters(given: list[str], kernels: list[str]) -> dict[str, dict[str, Any]]:
    found: dict[str, dict[str, Any]] = {}
    for each in given:
        place, equals, value = each.partition("=")
        if not equals:
            raise typer.BadParameter(f"`{each}` must be NAME=JSON, such as substeps=2.")
        kernel, name = _placed(place, kernels)
        try:
            found.setdefault(kernel, {})[name] = json.loads(value)
        except json.JSONDecodeError as error:
            raise typer.BadParameter(f"`{each}`: {value!r} is no JSON: {error}.") from None
    return found


def _kept(given: list[str], kernels: list[str]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for each in given:
        kernel, name = _placed(each, kernels)
        found.setdefault(kernel, []).append(name)
    return found


def _placed(place: str, kernels: list[str]) -> tuple[str, str]:
    kernel, dot, name = place.rpartition(".")
    if dot:
        return kernel, name
    if len(kernels) != 1:
        raise typer.BadParameter(f"`{place}`: with several kernels, say of which: KERNEL.{place}.")
    return kernels[0], name
