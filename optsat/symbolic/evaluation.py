"""Evaluation: how a generated function is computed, interpreted at first and compiled once that pays.

CasADi's machine needs a few microseconds and no preparation; a compiled kernel needs some tenths of a second once, for
all later processes too, and then a tenth of the time or less. Both give the same bits: the compiled form calls the same
library functions. So a function starts interpreted and is compiled when it has computed `COMPILE_AFTER` samples.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

from optsat.errors import OptsatError
from optsat.kernels.arguments import Arguments, check_threads
from optsat.kernels.casadi_form import CasadiForm
from optsat.kernels.lowering import LARGE
from optsat.kernels.record import KernelRecord
from optsat.port import Port

if TYPE_CHECKING:
    from optsat.kernels.elementary import Math
    from optsat.kernels.kernel import Kernel
    from optsat.kernels.unit import Real

COMPILE_AFTER = 10_000
"""Samples that take about as long interpreted as a kernel takes to compile."""


class Evaluation:
    """The state of one generated function."""

    def __init__(self, name: str, inputs: tuple[Port, ...], outputs: tuple[Port, ...], function: Any) -> None:
        self._name, self._inputs, self._outputs, self._function = name, inputs, outputs, function
        self._arguments = Arguments(name, inputs, "double")
        self._form = CasadiForm(function, KernelRecord(name, "double", inputs, outputs))
        self._samples = 0
        self._compiled: Any = None
        self._kernels: dict[tuple[Real, Math], Kernel] = {}

    def call(self, *args: Any, **kwargs: Any) -> Any:
        """Return the results of one sample, checked as `Kernel` does."""
        if self._compiled is None:
            self._count(1)
            return self._form.call(*args, **kwargs)
        return self._compiled(*args, **kwargs)

    def batch(self, threads: int, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
        """Return the results of many samples."""
        check_threads(self._name, threads)
        count, arrays = self._arguments.batch(args, kwargs)
        self._count(count)
        if self._compiled is not None:
            return self._compiled.batch(*arrays, threads=threads)
        results = tuple(np.empty((count, *port.shape)) for port in self._outputs)
        _, not_finite = self._form.run(False, 0, count, count, (*arrays, *results), None)
        if not_finite >= 0:
            self._arguments.refuse_not_finite(arrays)
        return results[0] if len(results) == 1 else results

    def kernel(self, real: "Real", math: "Math") -> "Kernel":
        """Return the kernel, made once of each kind."""
        from optsat.kernels.open_kernel import make_kernel

        if (real, math) not in self._kernels:
            self._kernels[real, math] = make_kernel(self, real, math)
        return self._kernels[real, math]

    def _count(self, samples: int) -> None:
        if self._compiled is not None or self._samples >= COMPILE_AFTER:
            return
        self._samples += samples
        # above that size compilation takes long enough that somebody must ask for it
        if self._samples < COMPILE_AFTER or self._function.n_instructions() > LARGE:
            return
        try:
            kernel = self.kernel("double", "libm")
        except OptsatError:
            # an operation that no kernel knows: CasADi goes on with it
            return
        if kernel.is_compiled:
            self._compiled = kernel

    @property
    def name(self) -> str:
        """See `Definition`."""
        return self._name

    @property
    def inputs(self) -> tuple[Port, ...]:
        """See `Definition`."""
        return self._inputs

    @property
    def outputs(self) -> tuple[Port, ...]:
        """See `Definition`."""
        return self._outputs

    @property
    def casadi(self) -> Any:
        """See `Definition`."""
        return self._function
