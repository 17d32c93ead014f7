"""Kernel: one definition made fast, called by sample or by batch on arrays, however this machine can run it."""

import threading
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from optsat.errors import InputError, OptsatError
from optsat.kernels.arguments import Arguments, Reals, check_threads, data_type
from optsat.kernels.form import Form, Kind
from optsat.kernels.record import KernelRecord
from optsat.kernels.request import Request
from optsat.kernels.tiles import checked_tiles, described, rows_of, tiles_of

LEAST_OF_THREAD = 1024
"""Samples below which another thread costs more than it saves."""

Layout = Literal["rows", "tiles"]


class Kernel:
    """A kernel ready to run; make one with `open_kernel`, `make_kernel` or `GeneratedFunction.kernel`.

    Called with arrays by position or by name, one for each of `record.inputs`: fresh results, unpacked where there is
    one, and after them the status where it has one. Every form of a kernel returns the same bits where `record.libm` is
    empty. Pickles by key: a worker loads it from its cache, or makes it again.
    """

    def __init__(self, record: KernelRecord, form: Form, origin: Any, text: Callable[[], str | None]) -> None:
        """origin : the request that it answers, what an interpreted one was made of, or None; text : its C text."""
        self.record = record
        self._form, self._origin, self._text = form, origin, text
        self._arguments = Arguments(record.name, record.inputs, record.real)

    def __new__(cls, record: KernelRecord, form: Form, *_rest: Any) -> "Kernel":
        """Return a kernel of a class of its own, in which the interpreter finds the call in C without a detour."""
        return object.__new__(type("Kernel", (cls,), {"__call__": form.call, "__doc__": cls.__doc__}))

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Return the results of one sample.

        Raises
        ------
        InputError : an argument is missing, not finite or of the wrong shape; the message names the port.
        UnknownOptionError : a keyword is no port.
        """
        return self._form.call(*args, **kwargs)

    @property
    def form(self) -> Kind:
        """How it runs: "extension", "cached extension" or "ctypes" compiled, "casadi" or "python" interpreted."""
        return self._form.kind

    @property
    def is_compiled(self) -> bool:
        """Whether a C compiler made it."""
        return bool(self.record.key)

    @property
    def c_text(self) -> str:
        """The C text that it was, or would be, compiled from.

        Raises
        ------
        OptsatError : it has been removed from the cache.
        """
        text = self._text()
        if text is None:
            raise OptsatError(f"The C text of {self.record.name} is no longer in the cache. Make the kernel again.")
        return text

    def batch(
        self,
        *args: Any,
        threads: int = 1,
        layout: Layout = "rows",
        out: Reals | Sequence[Reals] | None = None,
        **kwargs: Any,
    ) -> Any:
        """Return the results (N, *shape) of N samples, and their status (N,) after them where it has one.

        Arguments are (N, *shape), or (*shape) where all samples share one.
        threads : how many compute, at least 1024 samples each; the results do not depend on it
        layout : "tiles" takes and returns arrays (tiles, size, width) as `to_tiles` makes them, or (size, width) shared
        out : one array for each result, not the status, to write to instead of fresh ones

        Raises
        ------
        InputError : as for a call; also no argument has a sample axis, their lengths differ, or `out` does not fit.
        """
        if layout not in ("rows", "tiles"):
            raise InputError(f"{self.record.name}.batch: `layout` must be 'rows' or 'tiles', got {layout!r}.")
        check_threads(self.record.name, threads)
        in_tiles = layout == "tiles"
        count, arrays = checked_tiles(self.record, args, kwargs) if in_tiles else self._arguments.batch(args, kwargs)
        width = self.record.width if in_tiles else 1
        shapes = [(count, *((port.size, width) if in_tiles else port.shape)) for port in self.record.outputs]
        results = self._fresh(shapes) if out is None else self._given(out, shapes, arrays)
        statuses = np.empty(count * width, np.int32) if self.record.has_status else None
        if count:
            self._run(in_tiles, count, arrays, results, statuses, threads)
        found = [*results] if statuses is None else [*results, statuses]
        return found[0] if len(found) == 1 else tuple(found)

    def to_tiles(self, *args: Any, **kwargs: Any) -> tuple[Reals, ...]:
        """Return arguments of a batch as tiles (tiles, size, width), or (size, width) where all samples share one.

        The last tile is filled up with the last sample.

        Raises
        ------
        InputError : as for a batch.
        """
        _, arrays = self._arguments.batch(args, kwargs)
        self._arguments.refuse_not_finite(arrays)
        width = self.record.width
        return tuple(tiles_of(port, width, array) for port, array in zip(self.record.inputs, arrays, strict=True))

    def from_tiles(self, *results: Reals, count: int) -> Any:
        """Return the results of a batch in tiles as rows (count, *shape), unpacked where there is one.

        Raises
        ------
        InputError : not one array (tiles, size, width) for each result, or fewer samples than `count`.
        """
        outputs, width = self.record.outputs, self.record.width
        rows = []
        if len(results) != len(outputs):
            raise InputError(f"{self.record.name}.from_tiles takes {len(outputs)} results, got {len(results)}.")
        for port, tiles in zip(outputs, results, strict=True):
            if tiles.ndim != 3 or tiles.shape[1:] != (port.size, width) or len(tiles) * width < count:
                raise InputError(
                    f"{self.record.name}.from_tiles: `{port.name}` must have shape (tiles, {port.size}, {width}) with "
                    f"{count} samples, got {tiles.shape}."
                )
            rows.append(rows_of(port, tiles)[:count].copy())
        return rows[0] if len(rows) == 1 else tuple(rows)

    def _fresh(self, shapes: Sequence[tuple[int, ...]]) -> tuple[Reals, ...]:
        return tuple(np.empty(shape, data_type(self.record.real)) for shape in shapes)

    def _given(
        self, out: Reals | Sequence[Reals], shapes: Sequence[tuple[int, ...]], arrays: Sequence[Reals]
    ) -> tuple[Reals, ...]:
        given = (out,) if isinstance(out, np.ndarray) else tuple(out)
        ports, real = self.record.outputs, data_type(self.record.real)
        if len(given) != len(ports):
            raise InputError(f"{self.record.name}.batch: `out` must hold {len(ports)} arrays, got {len(given)}.")
        for k, (port, array, shape) in enumerate(zip(ports, given, shapes, strict=True)):
            fits = isinstance(array, np.ndarray) and (array.dtype, array.shape) == (real, shape) and array.flags.carray
            if not fits:
                raise InputError(
                    f"{self.record.name}.batch: `out` for `{port.name}` must be a contiguous, writable array {shape} "
                    f"of {real}, got {described(array)}."
                )
            if any(np.may_share_memory(array, other) for other in (*arrays, *given[:k])):
                raise InputError(
                    f"{self.record.name}.batch: `out` for `{port.name}` shares memory with an argument or another "
                    "result; give it an array of its own."
                )
        return given

    def _run(
        self,
        in_tiles: bool,
        count: int,
        arrays: tuple[Reals, ...],
        results: tuple[Reals, ...],
        statuses: Reals | None,
        threads: int,
    ) -> None:
        if in_tiles and not self.record.has_tiles:
            # a tile is one sample here, and what is computed by samples has rows
            ports = (*self.record.inputs, *self.record.outputs)
            rows = [a.reshape((*a.shape[:-2], *port.shape)) for port, a in zip(ports, (*arrays, *results), strict=True)]
            arrays, results = tuple(rows[: len(arrays)]), tuple(rows[len(arrays) :])
            in_tiles = False
        least = max(1, LEAST_OF_THREAD // self.record.width) if in_tiles else LEAST_OF_THREAD
        parts = min(threads, max(1, count // least))
        edges = [count * k // parts for k in range(parts + 1)]
        outcome: list[int | BaseException] = [0] * parts

        def compute(part: int) -> None:
            try:
                _, outcome[part] = self._form.run(
                    in_tiles, edges[part], edges[part + 1], count, (*arrays, *results), statuses
                )
            except BaseException as error:  # raised in the caller's thread
                outcome[part] = error

        others = [threading.Thread(target=compute, args=(part,)) for part in range(1, parts)]
        for thread in others:
            thread.start()
        compute(0)
        for thread in others:
            thread.join()
        for found in outcome:
            if isinstance(found, BaseException):
                raise found
        if any(found != -1 for found in outcome):
            self._refuse_not_finite(in_tiles, arrays)

    def _refuse_not_finite(self, in_tiles: bool, arrays: tuple[Reals, ...]) -> None:
        if in_tiles:
            arrays = tuple(rows_of(port, array) for port, array in zip(self.record.inputs, arrays, strict=True))
        self._arguments.refuse_not_finite(arrays)

    def __reduce__(self) -> tuple[Any, ...]:
        from optsat.kernels.open_kernel import reopen

        key, source = self.record.key, self.record.source
        if isinstance(self._origin, Request):
            return reopen, (key, source, self._origin, None)
        return reopen, (key, source, None, (self.record, self.c_text) if key else self._origin)

    def __repr__(self) -> str:
        return f"<kernel {self.record}, {self.form}>"
