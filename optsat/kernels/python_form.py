"""Python form: the twin of a kernel with loops, where nothing is compiled; hundreds of times slower, the same bits."""

from typing import Any

import numpy as np

from optsat.kernels.arguments import Arguments, Reals
from optsat.kernels.form import Kind, first_not_finite, unpacked
from optsat.kernels.record import KernelRecord
from optsat.kernels.source import Twin
from optsat.kernels.status import Status


class PythonForm:
    """See `Form`; the numbers are doubles."""

    kind: Kind = "python"

    def __init__(self, twin: Twin, record: KernelRecord) -> None:
        self._twin, self._record = twin, record
        self._arguments = Arguments(record.name, record.inputs, "double")
        self._cuts = np.cumsum([port.size for port in record.outputs])[:-1]

    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Return the results of one sample."""
        status, results = self._computed(self._arguments.sample(args, kwargs))
        return unpacked(self._record, results, status)

    def run(
        self, in_tiles: bool, begin: int, end: int, count: int, arrays: tuple[Reals, ...], statuses: Reals | None
    ) -> tuple[int, int]:
        """See `Form`; tiles hold one sample."""
        inputs = self._record.inputs
        found = first_not_finite(inputs, arrays, begin, end)
        if found >= 0:
            return 0, found
        failed = 0
        given, into = arrays[: len(inputs)], arrays[len(inputs) :]
        for k in range(begin, end):
            sample = [
                array if array.shape == port.shape else array[k] for port, array in zip(inputs, given, strict=True)
            ]
            status, results = self._computed(sample)
            failed += status != Status.OK
            if statuses is not None:
                statuses[k] = status
            for array, result in zip(into, results, strict=True):
                array[k] = result
        return failed, -1

    def _computed(self, arrays: Any) -> tuple[int, list[Reals]]:
        x = np.concatenate([np.reshape(array, -1) for array in arrays]) if len(arrays) else np.zeros(0)
        status, y = self._twin(x)
        parts = np.split(y, self._cuts)
        return int(status), [part.reshape(port.shape) for port, part in zip(self._record.outputs, parts, strict=True)]
