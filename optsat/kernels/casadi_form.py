"""CasADi form: straight-line code run by CasADi's virtual machine, where nothing is compiled."""

import threading
from typing import Any

import numpy as np

from optsat.kernels.arguments import Arguments, Reals
from optsat.kernels.form import Kind, Sample, first_not_finite, unpacked
from optsat.kernels.record import KernelRecord
from optsat.port import Port


class CasadiForm:
    """See `Form`; the numbers are doubles."""

    kind: Kind = "casadi"

    def __init__(self, function: Any, record: KernelRecord) -> None:
        self._function, self._record = function, record
        self._arguments = Arguments(record.name, record.inputs, "double")
        self._places_in = [_places(port, function.sparsity_in(k)) for k, port in enumerate(record.inputs)]
        self._places_out = [_places(port, function.sparsity_out(k)) for k, port in enumerate(record.outputs)]
        self._of_thread = threading.local()

    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Return the results of one sample."""
        # a buffer is one workspace: each thread has its own
        own = self._of_thread.__dict__ or self._prepared()
        own["sample"].take(self._arguments, args, kwargs)
        for kept, places, array in own["moved"]:
            kept[...] = array[places]
        own["trigger"]()
        results = []
        for port, kept, places in zip(self._record.outputs, own["outputs"], self._places_out, strict=True):
            if places is None:
                results.append(kept.copy().reshape(port.shape))
            else:
                result = np.zeros(port.size)
                result[places] = kept
                results.append(result.reshape(port.shape))
        return unpacked(self._record, results, 0)

    def run(
        self, in_tiles: bool, begin: int, end: int, count: int, arrays: tuple[Reals, ...], statuses: Reals | None
    ) -> tuple[int, int]:
        """See `Form`; tiles hold one sample."""
        inputs, outputs = self._record.inputs, self._record.outputs
        found = first_not_finite(inputs, arrays, begin, end)
        if found >= 0 or begin == end:
            return 0, found
        columns = [
            port.to_columns(array if array.shape == port.shape else array[begin:end])
            for port, array in zip(inputs, arrays, strict=False)
        ]
        results = self._function.call(columns)
        for port, result, array in zip(outputs, results, arrays[len(inputs) :], strict=True):
            # with shared arguments alone there is one sample
            array[begin:end] = port.from_columns(result.full())
        return 0, -1

    def _prepared(self) -> dict[str, Any]:
        function = self._function
        buffer, trigger = function.buffer()
        sample = Sample(self._record.inputs, "double")
        inputs, moved = [], []
        for places, array in zip(self._places_in, sample.arrays, strict=True):
            flat = array.reshape(-1)
            inputs.append(flat if places is None else np.zeros(len(places)))
            if places is not None:
                moved.append((inputs[-1], places, flat))
        outputs = [np.zeros(function.nnz_out(k)) for k in range(function.n_out())]
        for arrays, give in ((inputs, buffer.set_arg), (outputs, buffer.set_res)):
            for k, array in enumerate(arrays):
                # of no numbers there is no address, which CasADi takes for an error
                if array.size:
                    give(k, memoryview(array))  # type: ignore[arg-type, unused-ignore]
        own = self._of_thread.__dict__
        own.update(sample=sample, inputs=inputs, moved=moved, outputs=outputs, trigger=trigger, buffer=buffer)
        return own


def _places(port: Port, sparsity: Any) -> Any:
    """Where each non-zero stands among all entries counted by rows; None where they are the same in the same order."""
    row, column = np.array(sparsity.get_triplet(), dtype=np.intp).reshape(2, -1)
    places = row * port.columns + column
    return None if np.array_equal(places, np.arange(port.size)) else places
