"""Series report: what an attitude series found out, in figures; against the true attitude where it is known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.attitude.status import AttitudeStatus
from optsat.estimators.attitude_series import AttitudeSeries

_ROUNDING_RAD = 1e-12
_SAME_SPAN = 10


@dataclass(frozen=True)
class TimeSpan:
    """From start_s to stop_s [s], both included; `epochs` of them are meant."""

    start_s: float
    stop_s: float
    epochs: int


@dataclass(frozen=True)
class Accuracy:
    """Errors against the true attitude, over the epochs where both are known.

    compared : epochs; median_rad, rms_rad, largest_rad : of the error [rad]
    violations : epochs with an error beyond its guaranteed bound
    """

    compared: int
    median_rad: float
    rms_rad: float
    largest_rad: float
    violations: int

    @property
    def containment(self) -> float:
        """Share of the errors that are within their bounds [-]."""
        return 1.0 - self.violations / self.compared


@dataclass(frozen=True)
class SeriesReport:
    """Figures of an attitude series.

    counts : epochs by status; median_bound_rad, largest_bound_rad : of the determined epochs, None without any [rad]
    inconsistent : when no attitude fitted; rejected : channel to the times at which it was left out
    accuracy : None without truth or without a determined epoch
    """

    start_s: float
    stop_s: float
    epochs: int
    counts: dict[str, int]
    median_bound_rad: float | None
    largest_bound_rad: float | None
    inconsistent: tuple[TimeSpan, ...]
    rejected: dict[str, tuple[TimeSpan, ...]]
    accuracy: Accuracy | None

    @property
    def contradiction(self) -> bool:
        """Whether some measurement contradicted its bound."""
        return bool(self.inconsistent or self.rejected)


def report_series(series: AttitudeSeries, q_BN_true: Array | None = None) -> SeriesReport:
    """Return the figures of a series; q_BN_true (T, 4), NaN rows where unknown."""
    bound = series.bound_rad[series.ok]
    spans = {name: time_spans(series.t, series.rejected[:, i]) for i, name in enumerate(series.channels)}
    inconsistent = series.status_index == series.statuses.index(AttitudeStatus.INCONSISTENT)
    return SeriesReport(
        start_s=float(series.t[0]),
        stop_s=float(series.t[-1]),
        epochs=len(series.t),
        counts=series.counts(),
        median_bound_rad=float(np.median(bound)) if len(bound) else None,
        largest_bound_rad=float(bound.max()) if len(bound) else None,
        inconsistent=time_spans(series.t, inconsistent),
        rejected={name: found for name, found in spans.items() if found},
        accuracy=None if q_BN_true is None else _accuracy(series, q_BN_true),
    )


def violations(series: AttitudeSeries, q_BN_true: Array) -> NDArray[np.bool_]:
    """Return the epochs (T,) whose error exceeds the guaranteed bound by more than rounding."""
    with np.errstate(invalid="ignore"):
        return np.asarray(series.error_rad(q_BN_true) > series.bound_rad + _ROUNDING_RAD)


def time_spans(t: Array, meant: NDArray[np.bool_]) -> tuple[TimeSpan, ...]:
    """Return the spans of the epochs that are meant (T,); up to ten epochs in between do not end a span."""
    index = np.flatnonzero(meant)
    if len(index) == 0:
        return ()
    groups = np.split(index, np.flatnonzero(np.diff(index) > _SAME_SPAN) + 1)
    return tuple(TimeSpan(float(t[group[0]]), float(t[group[-1]]), len(group)) for group in groups)


def _accuracy(series: AttitudeSeries, q_BN_true: Array) -> Accuracy | None:
    error = series.error_rad(q_BN_true)
    known = error[np.isfinite(error)]
    if len(known) == 0:
        return None
    return Accuracy(
        compared=len(known),
        median_rad=float(np.median(known)),
        rms_rad=float(np.sqrt(np.mean(known**2))),
        largest_rad=float(known.max()),
        violations=int(np.sum(violations(series, q_BN_true))),
    )
