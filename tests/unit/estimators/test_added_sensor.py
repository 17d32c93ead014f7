"""The cheapest sensor to add, and the table of an isolability."""

from dataclasses import replace

import numpy as np
import pytest

from optsat.errors import InputError
from optsat.estimators.added_sensor import cheapest_added_sensor
from optsat.estimators.isolability import AdditiveFault, isolability
from optsat.estimators.isolability_table import markdown_table, text_table
from optsat.models.linear_discrete import LinearDiscreteModel, LinearSensor
from optsat.models.single_axis import AXIS_SENSORS, single_axis

TORQUE = AdditiveFault("torque", {"torque": 3.0})
GYRO = AdditiveFault("gyro", {"gyro": 0.3})
STAR = AdditiveFault("star", {"star": 0.01})
SECOND = AdditiveFault("second gyro", {"second gyro": 0.3})


def offered(*names: str) -> list[LinearSensor]:
    return [AXIS_SENSORS[name] for name in names]


def test_a_second_gyro_is_the_cheapest_with_the_star_tracker_out() -> None:
    answer = cheapest_added_sensor(
        single_axis(("gyro",)), [TORQUE, GYRO], 5.0, offered("star", "pressure", "second gyro")
    )
    assert (answer.sensors, answer.cost) == (("second gyro",), 1.0)
    assert answer.says == "Cheapest that tells the faults apart: second gyro, cost 1."
    assert answer.isolability.sensors == ("gyro", "second gyro")
    assert {name: bool(r.indistinguishable.any()) for name, r in answer.alone.items()} == {
        "star": False,
        "pressure": False,
        "second gyro": False,
    }


def test_a_second_gyro_that_may_fail_too_leaves_double_faults() -> None:
    model, faults = single_axis(("gyro",)), [TORQUE, GYRO, SECOND]
    single = cheapest_added_sensor(model, faults, 5.0, offered("second gyro", "pressure"))
    assert single.sensors == ("second gyro",)
    assert single.isolability.faults == ("torque", "gyro", "second gyro")
    both = cheapest_added_sensor(model, faults, 5.0, offered("second gyro", "pressure"), simultaneous=True)
    assert (both.sensors, both.cost) == (("pressure",), 3.0)


def test_two_sensors_where_one_is_not_enough() -> None:
    model = single_axis(("gyro",)).with_sensors(LinearSensor("valve", [0.0, 0.0], 1.0, [0.0]))
    faults = [TORQUE, GYRO, AdditiveFault("valve", {"valve": 1.0}), AdditiveFault("box", {"valve": 2.0})]
    witness = LinearSensor("second valve", [0.0, 0.0], 1.0, [0.0], cost=0.5)
    other = LinearSensor("box witness", [0.0, 0.0], 1.0, [0.0], cost=0.7)
    unhelped = cheapest_added_sensor(model, faults, 5.0, [witness, other, *offered("second gyro")])
    assert (unhelped.sensors, unhelped.cost) == (None, float("inf"))
    assert unhelped.says.startswith(
        "No sensor on offer removes the zeros, nor do all together. Faults of valve and box"
    )
    assert unhelped.isolability.sensors == ("gyro", "valve", "second valve", "box witness", "second gyro")


def test_two_independent_gaps_need_two_sensors() -> None:
    # two axes, each with one gyro and one thruster; a sensor of one axis says nothing about the other
    zero, one = np.zeros((2, 2)), single_axis(("gyro",))
    A, Q = np.block([[one.A, zero], [zero, one.A]]), np.block([[one.Q, zero], [zero, one.Q]])
    B = np.kron(np.eye(2), np.asarray(one.B, dtype=np.float64))
    rates = ([0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
    gyros = tuple(LinearSensor(f"gyro {k}", rates[k], 0.01) for k in range(2))
    model = LinearDiscreteModel(A, B, Q, ("torque 0", "torque 1"), gyros, one.dt)
    faults = [AdditiveFault(f"{kind} {k}", {f"{kind} {k}": 1.0}) for kind in ("torque", "gyro") for k in range(2)]
    spare = [LinearSensor(f"spare {k}", rates[k], 0.01, cost=1.0 + k) for k in range(2)]
    skewed = LinearSensor("both stars", [1.0, 0.0, 1.0, 0.0], 1e-3, cost=2.5)
    answer = cheapest_added_sensor(model, faults, 2.0, [skewed, *spare])
    assert (answer.sensors, answer.cost) == (("both stars",), 2.5)
    dear = cheapest_added_sensor(model, faults, 2.0, [replace(skewed, cost=4.0), *spare])
    assert (dear.sensors, dear.cost) == (("spare 0", "spare 1"), 3.0)
    assert dear.says == "Cheapest that tells the faults apart: spare 0 and spare 1, cost 3."
    assert dear.alone["spare 0"].groups() == (("torque 1", "gyro 1"),)


def test_nothing_is_added_where_nothing_is_missing() -> None:
    answer = cheapest_added_sensor(single_axis(), [TORQUE, GYRO, STAR], 5.0, offered("pressure"))
    assert (answer.sensors, answer.cost) == ((), 0.0)
    assert answer.says == "No sensor is missing: the faults are told apart already."


def test_a_least_of_nats_asks_for_more() -> None:
    model, faults = single_axis(("star", "gyro")), [TORQUE, GYRO, STAR]
    answer = cheapest_added_sensor(model, faults, 5.0, offered("second gyro", "pressure"), least=10.0)
    assert answer.sensors == ("second gyro",)
    assert cheapest_added_sensor(model, faults, 5.0, offered("second gyro"), least=12.0).sensors is None


@pytest.mark.parametrize("count", [0, 11])
def test_how_many_candidates(count: int) -> None:
    candidates = [LinearSensor(f"c{k}", [0.0, 1.0], 1.0) for k in range(count)]
    with pytest.raises(InputError, match=f"1 to 10 sensors, got {count}"):
        cheapest_added_sensor(single_axis(), [TORQUE], 5.0, candidates)


def test_tables() -> None:
    result = isolability(single_axis(("gyro",)), [TORQUE, GYRO], 5.0)
    text = text_table(result).splitlines()
    assert text[0].split("  ")[0] == "fault [nats]"
    assert text[2].split() == ["torque", "8.93", "-", "0", "(!)", "0", "(!)"]
    assert text[3].split() == ["gyro", "1942", "0", "(!)", "-", "0", "(!)"]
    assert text[4:] == list(result.says)
    marked = markdown_table(result).splitlines()
    assert marked[:2] == [
        "| fault [nats] | detected | from torque | from gyro | from all others |",
        "|---|---:|---:|---:|---:|",
    ]
    assert marked[-1] == f"- {result.says[0]}"
    told = isolability(single_axis(), [TORQUE, AdditiveFault("a|b", {"gyro": 0.3})], 5.0)
    assert np.all([line.count("|") - line.count("\\|") == 6 for line in markdown_table(told).splitlines()])
    assert len(text_table(told).splitlines()) == 4
