"""The bound figure: what is drawn, and that violations cannot be missed."""

import sys
from typing import Any

import numpy as np
import pytest

from optsat.errors import InputError
from optsat.estimators.attitude_series import AttitudeSeries, Window, certify_record
from optsat.plots.bound_figure import bound_figure, figure_format, rendered, shades_of
from optsat.records.record import Record
from optsat.simulation.orbit_scenario import OrbitScenario
from optsat.simulation.sensor_fault import SensorFault


@pytest.fixture(scope="module")
def record() -> Record:
    faults = (SensorFault("magnetometer", 8, 11, "offset", 0.1), SensorFault("sun", 20, 26, "dead"))
    return OrbitScenario(duration=30.0, gyro_bound_rad_s=3e-5, faults=faults).simulate(np.random.default_rng(1))


@pytest.fixture(scope="module")
def series(record: Record) -> AttitudeSeries:
    return certify_record(record, Window(20.0, 5.0))


def labels(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_bounds_and_errors_are_drawn_in_degrees(record: Record, series: AttitudeSeries) -> None:
    figure = bound_figure({"window": series}, record.q_BN_true, "a finding", shades_of(record, series))
    (axes,) = figure.axes
    assert labels(figure) == ["window: guaranteed bound", "window: true error"]
    bound_deg, error_deg = (np.asarray(line.get_ydata(), dtype=float) for line in axes.lines[:2])
    np.testing.assert_allclose(bound_deg, np.degrees(series.bound_rad))
    assert record.q_BN_true is not None
    np.testing.assert_allclose(error_deg, np.degrees(series.error_rad(record.q_BN_true)))
    assert [text.get_text() for text in axes.texts] == ["no sun", "magnetometer rejected"]
    assert (axes.get_yscale(), axes.get_title(loc="left")) == ("log", "a finding")
    assert "[deg]" in axes.get_ylabel()
    assert "[s]" in axes.get_xlabel()


def test_violations_are_crossed_and_counted(record: Record, series: AttitudeSeries) -> None:
    assert record.q_BN_true is not None
    wrong = np.array(record.q_BN_true)
    wrong[[3, 5]] = [0, 0, 0, 1]
    figure = bound_figure({"window": series}, wrong, "")
    assert labels(figure)[-1] == "error beyond its bound (2)"
    crosses = figure.axes[0].lines[2]
    assert list(np.asarray(crosses.get_xdata())) == [3.0, 5.0]


def test_without_truth_and_with_a_single_epoch(record: Record) -> None:
    one = OrbitScenario(duration=0.0).simulate(np.random.default_rng(0))
    figure = bound_figure({"frame": certify_record(one)}, None, "")
    assert labels(figure) == ["frame: guaranteed bound"]
    assert rendered(figure, "png").startswith(b"\x89PNG")


def test_rendering_touches_no_global_state(record: Record, series: AttitudeSeries) -> None:
    svg = rendered(bound_figure({"window": series}, record.q_BN_true, ""), "svg")
    assert svg.startswith(b"<?xml")
    assert b"dc:date" not in svg
    assert "matplotlib.pyplot" not in sys.modules


def test_formats() -> None:
    assert [figure_format(name) for name in ("a.svg", "b/c.PNG")] == ["svg", "png"]
    for name in ("a.pdf", "png", "folder.d/a"):
        with pytest.raises(InputError, match=r"a figure is written as \.svg or \.png"):
            figure_format(name)
