"""Final file: every case of a run as NetCDF, written block by block, the same bytes whatever the chunks were."""

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optsat.campaign.case_blocks import WORDS, block_length, case_blocks, result_kinds
from optsat.campaign.disk import require_room
from optsat.campaign.rows import Cases
from optsat.campaign.table import Kinds
from optsat.errors import MissingExtraError
from optsat.files import durable_step, sync_folder

_WORD_BYTES, _FILE_BYTES = 32, 1 << 15


def write_final_file(path: Path, cases: Cases, count: int, attributes: Mapping[str, Any]) -> None:
    """Write all `count` cases: `status` (0 ran, 1 failed), `failure` (why), then the study's columns along `case`.

    Nothing else than results and `attributes` enters the file: no date, no machine, no chunk size.

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
    kinds = result_kinds(cases)
    temporary = path.with_name(f".{path.name}.{os.getpid():08x}")
    try:
        require_room(temporary, _size(kinds, count))
        with h5netcdf.File(temporary, "w") as file:
            file.dimensions = {"case": count, **_axes(kinds)}
            file.attrs.update(attributes)
            _declare(file, kinds, min(block_length(kinds), count))
            durable_step()
            for start, block in case_blocks(cases, count):
                for name, values in block.items():
                    stored = values.astype(np.int8) if values.dtype.kind == "b" else values
                    file.variables[name][start : start + len(stored), ...] = stored
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


def _size(kinds: Kinds, count: int) -> int:
    """Return about how many bytes the file takes: columns, `status` and `failure`, and what HDF5 adds."""
    a_case = sum(_WORD_BYTES if kind.kind == "U" else 8 * math.prod(kind.shape) for kind in kinds.values())
    return round(1.02 * count * (a_case + 1 + _WORD_BYTES)) + _FILE_BYTES


def _axes(kinds: Kinds) -> dict[str, int]:
    return {f"{name}_{k}": length for name, kind in kinds.items() for k, length in enumerate(kind.shape)}


def _declare(file: Any, kinds: Kinds, length: int) -> None:
    import h5py

    words = h5py.string_dtype()
    columns = {name: (WORDS if kind.kind == "U" else kind.dtype, kind.shape) for name, kind in kinds.items()}
    layout = {"status": (np.dtype(np.int8), ()), "failure": (WORDS, ()), **columns}
    for name, (kind, shape) in layout.items():
        dimensions = ("case", *(f"{name}_{k}" for k in range(len(shape))))
        stored = words if kind == WORDS else np.dtype(np.int8) if kind.kind == "b" else kind
        checked = {} if kind == WORDS else {"fletcher32": True}
        file.create_variable(name, dimensions, stored, chunks=(length, *shape), **checked)
