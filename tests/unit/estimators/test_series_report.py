"""Figures of an attitude series, against counts by hand."""

import csv
import io

import numpy as np
import pytest

from optsat.estimators.attitude_series import AttitudeSeries
from optsat.estimators.series_csv import HEADER, series_csv
from optsat.estimators.series_report import TimeSpan, report_series, time_spans, violations

OK, UNBOUNDED, INCONSISTENT, NOTHING = 0, 1, 2, -1


def made(status: list[int], bound_rad: list[float], angle_rad: list[float], rejected: list[bool]) -> AttitudeSeries:
    """A series that is off the identity by the given angles about x."""
    half = np.array(angle_rad) / 2
    q_BN = np.stack((np.sin(half), 0 * half, 0 * half, np.cos(half)), axis=1)
    count = len(status)
    return AttitudeSeries(
        np.arange(float(count)),
        q_BN,
        np.array(bound_rad),
        np.array(status, dtype=np.int8),
        np.full(count, 2),
        np.array(rejected)[:, None],
        ("sun",),
        True,
    )


@pytest.fixture
def series() -> AttitudeSeries:
    nan = float("nan")
    return made(
        [OK, OK, INCONSISTENT, UNBOUNDED, NOTHING, OK],
        [0.1, 0.3, nan, np.pi, nan, 0.2],
        [0.05, 0.3, 0.0, 0.0, 0.0, 0.21],
        [False, False, True, True, False, False],
    )


IDENTITY = np.tile([0.0, 0.0, 0.0, 1.0], (6, 1))


def test_figures(series: AttitudeSeries) -> None:
    report = report_series(series, IDENTITY)
    assert (report.epochs, report.start_s, report.stop_s) == (6, 0.0, 5.0)
    assert report.counts == {"ok": 3, "unbounded": 1, "inconsistent": 1, "no measurement": 1}
    assert (report.median_bound_rad, report.largest_bound_rad) == (0.2, 0.3)
    assert report.inconsistent == (TimeSpan(2.0, 2.0, 1),)
    assert report.rejected == {"sun": (TimeSpan(2.0, 3.0, 2),)}
    assert report.contradiction
    accuracy = report.accuracy
    assert accuracy is not None
    assert (accuracy.compared, accuracy.violations) == (3, 1)
    assert accuracy.median_rad == pytest.approx(0.21)
    assert accuracy.rms_rad == pytest.approx(np.sqrt((0.05**2 + 0.3**2 + 0.21**2) / 3))
    assert accuracy.largest_rad == pytest.approx(0.3)
    assert accuracy.containment == pytest.approx(2 / 3)
    assert np.flatnonzero(violations(series, IDENTITY)).tolist() == [5]


def test_nothing_determined_or_nothing_known(series: AttitudeSeries) -> None:
    assert report_series(series).accuracy is None
    assert report_series(series, np.full((6, 4), np.nan)).accuracy is None
    lost = made([UNBOUNDED], [np.pi], [0.0], [False])
    report = report_series(lost, IDENTITY[:1])
    assert (report.median_bound_rad, report.largest_bound_rad, report.accuracy) == (None, None, None)
    assert not report.contradiction


def test_spans_bridge_short_gaps_only() -> None:
    t = np.arange(0.0, 20.0, 0.5)
    meant = np.zeros(40, dtype=bool)
    assert time_spans(t, meant) == ()
    meant[[3, 4, 14, 26]] = True
    assert time_spans(t, meant) == (TimeSpan(1.5, 7.0, 3), TimeSpan(13.0, 13.0, 1))


def test_csv(series: AttitudeSeries) -> None:
    header, *rows = csv.reader(io.StringIO(series_csv(series)))
    assert tuple(header) == HEADER
    assert all(len(row) == len(header) for row in rows)
    assert [row[6] for row in rows] == ["ok", "ok", "inconsistent", "unbounded", "no measurement", "ok"]
    assert [float(cell) for cell in rows[1][1:5]] == series.q_BN[1].tolist()
    assert float(rows[1][5]) == np.degrees(0.3)
    assert rows[2][1:6] == [""] * 5
    assert [row[8] for row in rows] == ["", "", "sun", "sun", "", ""]
