"""Final file: every case of a run as NetCDF, written block by block, the same bytes whatever the chunks were."""

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.campaign.table import Table
from optsat.errors import MissingExtraError
from optsat.files import durable_step, sync_folder

BLOCK = 4096
"""Cases that are written at once, and the chunk shape inside the file."""

Tables = Callable[[], Iterator[Table]]
"""The tables of a run in case order; called once to learn the columns and once to write them."""


def write_final_file(path: Path, tables: Tables, cases: int, attributes: Mapping[str, Any]) -> None:
    """Write all cases: `status` (0 ran, 1 failed), `failure` (why), then the study's columns along `case`.

    A failed case holds NaN, 0 or an empty word in the study's columns. Nothing else than results and `attributes`
    enters the file: no date, no machine, no chunk size.

    Raises
    ------
    MissingExtraError : h5netcdf is absent.
    """
    try:
        import h5netcdf
    except ImportError:
        raise MissingExtraError(
            "Writing result.nc needs h5netcdf, which is absent: pip install 'optsat[results]'."
        ) from None
    columns = _columns(tables)
    temporary = path.with_name(f".{path.name}.{os.getpid():08x}")
    try:
        with h5netcdf.File(temporary, "w") as file:
            file.dimensions = {"case": cases, **_axes(columns)}
            file.attrs.update(attributes)
            _declare(file, columns, cases)
            durable_step()
            for start, block in _blocks(tables, columns, cases):
                for name, values in block.items():
                    file.variables[name][start : start + len(values), ...] = values
                durable_step()
        with temporary.open("rb") as stream:
            os.fsync(stream.fileno())
        durable_step()
        temporary.replace(path)
        durable_step()
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)
    durable_step()


Columns = dict[str, tuple[np.dtype[Any], tuple[int, ...]]]
_WORDS = np.dtype(object)


def _columns(tables: Tables) -> Columns:
    """Return the kind and the further axes of each column over the whole run."""
    found: Columns = {}
    for table in tables():
        for name, column in table.columns.items():
            if name == "case":
                continue
            kind = _WORDS if column.dtype.kind == "U" else column.dtype
            before = found.get(name, (kind, ()))[0]
            found[name] = (kind if kind == before else np.promote_types(kind, before), column.shape[1:])
    return found


def _axes(columns: Columns) -> dict[str, int]:
    return {f"{name}_{k}": length for name, (_, shape) in columns.items() for k, length in enumerate(shape)}


def _declare(file: Any, columns: Columns, cases: int) -> None:
    import h5py

    words = h5py.string_dtype()
    layout = {"status": (np.dtype(np.int8), ()), "failure": (_WORDS, ()), **columns}
    for name, (kind, shape) in layout.items():
        dimensions = ("case", *(f"{name}_{k}" for k in range(len(shape))))
        stored = words if kind == _WORDS else np.dtype(np.int8) if kind.kind == "b" else kind
        checked = {} if kind == _WORDS else {"fletcher32": True}
        file.create_variable(name, dimensions, stored, chunks=(min(BLOCK, cases), *shape), **checked)


def _blocks(tables: Tables, columns: Columns, cases: int) -> Iterator[tuple[int, dict[str, NDArray[Any]]]]:
    """Yield the cases in blocks of a fixed length, which the lengths of the tables do not change."""
    waiting: list[Table] = []
    source = tables()
    for start in range(0, cases, BLOCK):
        stop = min(start + BLOCK, cases)
        while sum(_last(table) >= 0 for table in waiting) == 0 or max(map(_last, waiting)) < stop - 1:
            table = next(source, None)
            if table is None:
                break
            waiting.append(table)
        yield start, _filled(waiting, columns, start, stop)
        waiting = [table for table in waiting if _last(table) >= stop]


def _last(table: Table) -> int:
    ran = table.columns["case"][-1] if "case" in table.columns and len(table.columns["case"]) else -1
    return max(int(ran), table.failures[-1].case if table.failures else -1)


def _filled(tables: list[Table], columns: Columns, start: int, stop: int) -> dict[str, NDArray[Any]]:
    count = stop - start
    block: dict[str, NDArray[Any]] = {
        "status": np.zeros(count, dtype=np.int8),
        "failure": np.full(count, "", dtype=object),
    }
    for name, (kind, shape) in columns.items():
        empty: Any = "" if kind == _WORDS else np.nan if kind.kind == "f" else 0
        block[name] = np.full((count, *shape), empty, dtype=kind)
    for table in tables:
        for failure in table.failures:
            if start <= failure.case < stop:
                block["status"][failure.case - start] = 1
                block["failure"][failure.case - start] = f"{failure.error}: {failure.message}"
        if "case" in table.columns:
            numbers = table.columns["case"]
            here = (numbers >= start) & (numbers < stop)
            for name in columns:
                block[name][numbers[here] - start] = table.columns[name][here]
    return {name: values.astype(np.int8) if values.dtype.kind == "b" else values for name, values in block.items()}
