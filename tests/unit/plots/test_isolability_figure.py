"""The isolability figure: every number and every zero of the matrix is in it."""

import sys

from optsat.estimators.isolability import AdditiveFault, isolability
from optsat.models.single_axis import single_axis
from optsat.plots.bound_figure import rendered
from optsat.plots.isolability_figure import isolability_figure


def test_numbers_and_zeros_are_written() -> None:
    faults = [AdditiveFault("torque", {"torque": 3.0}), AdditiveFault("gyro", {"gyro": 0.3})]
    figure = isolability_figure(isolability(single_axis(("gyro",)), faults, 5.0), "star out")
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.texts] == ["8.93", "", "x", "x", "1942", "x", "", "x"]
    assert len(axes.patches) == 4
    assert axes.get_title(loc="left") == "star out"
    assert [label.get_text() for label in axes.get_yticklabels()] == ["torque", "gyro"]
    assert "[nats]" in figure.get_supxlabel()
    assert rendered(figure, "svg").startswith(b"<?xml")
    assert "matplotlib.pyplot" not in sys.modules
