"""Port: one named argument or result with its shape, unit and frame."""

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.errors import InputError
from optsat.port_checks import fault_of_checks, safe_values

_NAME = re.compile(r"[A-Za-z](_?[A-Za-z0-9])*")


@dataclass(frozen=True)
class Port:
    """One argument or result of a generated function.

    name : letters, digits and single underscores; shape : (), (n,) or (n, m); unit : SI, "-" for none
    frame : letter of the frame of the components, where the name does not carry it

    The rest is what flight code checks beyond finite numbers, of arguments and of results:
    unit_norm : by how much the length of the vector, or of each row of a matrix, may differ from 1
    lower, upper : range of every entry, ends included
    positive_definite : a covariance: symmetric, diagonal positive, no entry larger than its diagonal allows
    direction : rows of any length but zero, which flight code scales to length 1; it counts those whose length differed
        from 1 by more than this number
    verdict : a result that is 1 where the others can be trusted; where it is not, flight code refuses them
    counted : how many of the rows hold data is told at run time; the others repeat row 0, or hold `padding`
    safe : what a result holds when a check failed, one number or one for each entry; unless given the identity
        quaternion, matrix or first axis where `unit_norm`, the identity where `positive_definite`, else 0 within range

    Raises
    ------
    InputError : the name is not one, the shape has more than two axes, or the checks do not fit shape or safe value.
    """

    name: str
    shape: tuple[int, ...]
    unit: str
    frame: str = ""
    unit_norm: float | None = None
    lower: float | None = None
    upper: float | None = None
    positive_definite: bool = False
    direction: float | None = None
    verdict: bool = False
    counted: bool = False
    padding: float | None = None
    safe: float | tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not _NAME.fullmatch(self.name):
            raise InputError(f"`{self.name}` is no name of a port: use letters, digits and single underscores.")
        if len(self.shape) > 2 or any(n < 1 for n in self.shape):
            raise InputError(f"Port `{self.name}` must have shape (), (n,) or (n, m), got {self.shape}.")
        if fault := fault_of_checks(self):
            raise InputError(f"Port `{self.name}` {self.shape}: {fault}.")

    @property
    def size(self) -> int:
        """Number of scalars."""
        return math.prod(self.shape)

    @property
    def rows(self) -> int:
        """Rows of the CasADi matrix."""
        return self.shape[0] if self.shape else 1

    @property
    def columns(self) -> int:
        """Columns of the CasADi matrix."""
        return self.shape[1] if len(self.shape) == 2 else 1

    @property
    def row_length(self) -> int:
        """Scalars of one vector: of the port itself, or of a row of its matrix."""
        return self.shape[-1] if self.shape else 1

    @property
    def safe_values(self) -> tuple[float, ...]:
        """What a result holds when a check failed, matrices counted by rows."""
        return safe_values(self)

    def __str__(self) -> str:
        frame = f" in {self.frame}" if self.frame else ""
        return f"{self.name} {self.shape} [{self.unit}]{frame}"

    def sample(self, function: str, value: Any) -> Array:
        """Return one finite value of this port's shape.

        Raises
        ------
        InputError : names the function and the port.
        """
        array = self._finite(function, value)
        if array.shape != self.shape:
            hint = " Use `.batch` for many samples." if array.shape[1:] == self.shape and array.ndim else ""
            raise InputError(
                f"{function}: `{self.name}` must have shape {self.shape} [{self.unit}], got {array.shape}.{hint}"
            )
        return array

    def samples(self, function: str, value: Any) -> Array:
        """Return finite values (N, *shape), or one value (*shape) that all samples share.

        Raises
        ------
        InputError : names the function and the port.
        """
        array = self._finite(function, value)
        if array.shape != self.shape and (array.ndim == 0 or array.shape[1:] != self.shape):
            expected = ", ".join(["N", *map(str, self.shape)]) + ("," if not self.shape else "")
            raise InputError(
                f"{function}.batch: `{self.name}` must have shape ({expected}) or, for one value that all samples "
                f"share, {self.shape} [{self.unit}], got {array.shape}."
            )
        return array

    def _finite(self, function: str, value: Any) -> Array:
        try:
            return finite_array(self.name, value, unit=self.unit)
        except InputError as error:
            raise InputError(f"{function}: {error}") from None

    def to_columns(self, samples: Array) -> Array:
        """Return samples (N, *shape) side by side as CasADi wants them (rows, N * columns)."""
        return np.moveaxis(samples.reshape(-1, self.rows, self.columns), 0, 1).reshape(self.rows, -1)

    def from_columns(self, columns: Array) -> Array:
        """Return samples (N, *shape) from a CasADi result (rows, N * columns)."""
        samples = np.moveaxis(columns.reshape(self.rows, -1, self.columns), 1, 0)
        return np.ascontiguousarray(samples.reshape(-1, *self.shape))
