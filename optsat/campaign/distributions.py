"""Distributions of one parameter of a design: from numbers in (0, 1) to values, one each, so that order is kept."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError


class Distribution(Protocol):
    """How one parameter is spread."""

    def quantile(self, u: Array) -> Array:
        """Return the values below which the shares `u` in (0, 1) of the parameter lie."""
        ...


@dataclass(frozen=True)
class Uniform:
    """Between `low` and `high`, everywhere alike."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _check_ends("Uniform", self.low, self.high)

    def quantile(self, u: Array) -> Array:
        """Return low + u (high - low)."""
        return np.asarray(self.low + u * (self.high - self.low))


@dataclass(frozen=True)
class LogUniform:
    """Between `low` > 0 and `high`, every decade alike."""

    low: float
    high: float

    def __post_init__(self) -> None:
        _check_ends("LogUniform", self.low, self.high)
        if self.low <= 0:
            raise InputError(f"`low` of LogUniform must be above zero, got {self.low}.")

    def quantile(self, u: Array) -> Array:
        """Return low (high / low)^u."""
        return np.asarray(self.low * np.exp(u * np.log(self.high / self.low)))


@dataclass(frozen=True)
class Normal:
    """Normal with `mean` and `deviation` > 0."""

    mean: float
    deviation: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mean) and np.isfinite(self.deviation) and self.deviation > 0):
            raise InputError(
                f"Normal needs a finite `mean` and a finite `deviation` above zero, got {self.mean} and "
                f"{self.deviation}."
            )

    def quantile(self, u: Array) -> Array:
        """Return mean + deviation z, where z is the standard normal quantile of u."""
        from scipy.special import ndtri

        return np.asarray(self.mean + self.deviation * ndtri(u))


def _check_ends(name: str, low: float, high: float) -> None:
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise InputError(f"`low` of {name} must be below `high` and both finite, got {low} and {high}.")
