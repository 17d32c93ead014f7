"""`optsat cache`: the compiled kernels of this user, shown and removed."""

import time
from typing import Annotated, Any

import typer

from optsat.commands.output import AsJson, aligned, print_json

app = typer.Typer(no_args_is_help=True, help="Show or remove the compiled kernels that are kept on disk.")

_DAY = 86_400.0


@app.command("show", epilog="Example: optsat cache show --json")
def show_command(as_json: AsJson = False) -> None:
    """List the folders that are searched and the kernels in them. Exit code 1 when one is damaged."""
    from optsat.kernels.folders import searched_folders
    from optsat.kernels.upkeep import damaged, entries

    folders = [(folder, list(entries(folder)), set(damaged(folder))) for folder in searched_folders()]
    document = [
        {
            "folder": str(folder),
            "bytes": sum(entry.size() for entry in kept),
            "damaged": sorted(bad),
            "kernels": [_described(entry, entry.record.key not in bad) for entry in kept],
        }
        for folder, kept, bad in folders
    ]
    if as_json:
        print_json(document)
    else:
        typer.echo(_in_words(document))
    if any(bad for _, _, bad in folders):
        raise typer.Exit(1)


@app.command("clean", epilog="Example: optsat cache clean --unused 30")
def clean_command(
    unused: Annotated[float, typer.Option(metavar="DAYS", min=0.0, help="Only kernels not used for so long.")] = 0.0,
    as_json: AsJson = False,
) -> None:
    """Remove kernels from the folders of this user; they are compiled again when they are next asked for."""
    from optsat.kernels.folders import own_folder, searched_folders, shared_folders
    from optsat.kernels.upkeep import clean

    shared = shared_folders()
    document: list[dict[str, Any]] = []
    for folder in searched_folders():
        if folder not in shared:
            kernels, size = clean(folder, unused * _DAY)
            document.append({"folder": str(folder), "removed": kernels, "bytes": size})
    if as_json:
        print_json(document)
        return
    for each in document:
        typer.echo(f"{each['folder']}: {each['removed']} kernels removed, {each['bytes'] / 1e6:.1f} MB")
    if not document:
        typer.echo(f"{own_folder()}: nothing kept")


def _described(entry: Any, sound: bool) -> dict[str, Any]:
    record = entry.record
    return {
        "name": record.name,
        "key": record.key,
        "real": record.real,
        "width": record.width,
        "operations": record.operations,
        "libm": list(record.libm),
        "compiler": record.compiler,
        "bytes": entry.size(),
        "unused_days": max(0.0, (time.time() - entry.last_used()) / _DAY),
        "sound": sound,
    }


def _in_words(document: list[dict[str, Any]]) -> str:
    lines = []
    for folder in document:
        lines.append(f"{folder['folder']}: {len(folder['kernels'])} kernels, {folder['bytes'] / 1e6:.1f} MB")
        rows: list[tuple[Any, ...]] = [("  kernel", "key", "real", "width", "operations", "kB", "used", "")]
        rows += [
            (
                f"  {each['name']}",
                each["key"][:12],
                each["real"],
                each["width"],
                each["operations"],
                f"{each['bytes'] / 1e3:.0f}",
                _ago(each["unused_days"]),
                "" if each["sound"] else "damaged: it is made again",
            )
            for each in folder["kernels"]
        ]
        if folder["kernels"]:
            lines.append(aligned(rows))
        unreadable = set(folder["damaged"]) - {each["key"] for each in folder["kernels"]}
        lines += [f"  {key[:12]}: its record is damaged, it is made again" for key in sorted(unreadable)]
    return "\n".join(lines) or "No kernels are kept."


def _ago(days: float) -> str:
    return "within a day" if days < 1.0 else f"{days:.0f} days ago"
