"""ctypes form: a compiled kernel where the binding could not be built; a call costs several times as much."""

import threading
from typing import Any

import numpy as np

from optsat.kernels.arguments import Arguments, Reals, data_type
from optsat.kernels.form import Kind, Sample, unpacked
from optsat.kernels.record import KernelRecord
from optsat.kernels.unit import ABI


class CtypesForm:
    """See `Form`."""

    kind: Kind = "ctypes"

    def __init__(self, library: str, record: KernelRecord) -> None:
        """Load the library.

        Raises
        ------
        OSError : the system does not load it, or it holds another kernel or ABI.
        """
        import ctypes

        loaded = ctypes.CDLL(library)
        try:
            found = ctypes.c_uint32.in_dll(loaded, "os_abi").value
            self._call_address, self._batch = loaded[f"{record.name}_call"], loaded[f"{record.name}_batch"]
            self._tiles = loaded[f"{record.name}_tiles"] if record.has_tiles else None
        except (AttributeError, ValueError) as error:
            raise OSError(f"{library} holds no kernel {record.name}: {error}") from None
        if found != ABI:
            raise OSError(f"{library} speaks ABI {found}, not {ABI}")
        self._batch.restype = ctypes.c_int64
        self._record = record
        self._arguments = Arguments(record.name, record.inputs, record.real)
        self._of_thread = threading.local()

    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Return the results of one sample."""
        own = self._of_thread.__dict__ or self._prepared()
        own["sample"].take(self._arguments, args, kwargs)
        status = self._call_address(own["in"], own["out"])
        return unpacked(self._record, [result.copy() for result in own["outputs"]], status)

    def run(
        self, in_tiles: bool, begin: int, end: int, count: int, arrays: tuple[Reals, ...], statuses: Reals | None
    ) -> tuple[int, int]:
        """See `Form`."""
        import ctypes

        record, inputs = self._record, len(self._record.inputs)
        unit = [port.size * (record.width if in_tiles else 1) for port in (*record.inputs, *record.outputs)]
        shared = [k < inputs and array.size == unit[k] and count != 1 for k, array in enumerate(arrays)]
        for k, array in enumerate(arrays[:inputs]):
            if not np.isfinite(array if shared[k] else array.reshape(count, -1)[begin:end]).all():
                return 0, k
        first = [0 if shared[k] else begin * unit[k] * array.itemsize for k, array in enumerate(arrays)]
        address = [array.ctypes.data + offset for array, offset in zip(arrays, first, strict=True)]
        pointers = (ctypes.c_void_p * len(arrays))(*address)
        strides = (ctypes.c_int64 * len(arrays))(*(0 if shared[k] else unit[k] for k in range(len(arrays))))
        results = ctypes.byref(pointers, inputs * ctypes.sizeof(ctypes.c_void_p))
        number = ctypes.c_int64(end - begin)
        if in_tiles and self._tiles is not None:
            self._tiles(number, pointers, strides, results)
            return 0, -1
        into = None if statuses is None else ctypes.c_void_p(statuses.ctypes.data + begin * statuses.itemsize)
        return self._batch(number, pointers, strides, results, into), -1

    def _prepared(self) -> dict[str, Any]:
        # addresses cost more than the call, so each thread keeps arrays whose addresses were taken once
        import ctypes

        kind, record = data_type(self._record.real), self._record
        sample = Sample(record.inputs, record.real)
        outputs = [np.zeros(port.shape, kind) for port in record.outputs]
        own = self._of_thread.__dict__
        own["sample"], own["outputs"] = sample, outputs
        own["in"] = (ctypes.c_void_p * max(1, len(sample.arrays)))(*(array.ctypes.data for array in sample.arrays))
        own["out"] = (ctypes.c_void_p * len(outputs))(*(array.ctypes.data for array in outputs))
        return own
