"""Parts, faults and thrusters: what each kind does, and what is refused with which words."""

import math

import numpy as np
import pytest

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import ACCELEROMETER, GYRO, PRESSURE, THRUSTERS, Part
from optsat.models.schedule import Schedule, constant
from optsat.models.spacecraft import Spacecraft
from optsat.models.thrusters import ThrusterPairs

T: Array = np.arange(6, dtype=np.float64) * 0.1
COMMAND = np.array([1.0, 2.0, 5.0])


def torque(thrusters: ThrusterPairs, *faults: Fault) -> list[list[float]]:
    condition = thrusters.condition(T, faults)
    result: list[list[float]] = thrusters.torque().batch(np.tile(COMMAND, (6, 1)), *condition).tolist()
    return result


def test_parts_know_their_device_and_axis() -> None:
    assert [part.axis for part in (*GYRO, *THRUSTERS)] == [0, 1, 2, 0, 1, 2]
    assert {part.device for part in ACCELEROMETER} == {"accelerometer"}
    assert (Part.STAR.axis, Part.STAR.device, Part.STAR.is_thruster) == (None, "star", False)
    assert all(part.is_thruster for part in THRUSTERS)
    assert [part.value for part in PRESSURE] == ["pressure.x", "pressure.y", "pressure.z"]


@pytest.mark.parametrize(
    ("kind", "value", "expected"),
    [
        (ThrusterFaultKind.REDUCED, (0.4,), 2.0),
        (ThrusterFaultKind.LOCKED, (7.0,), 7.0),
        (ThrusterFaultKind.OPEN, (), 12.0),
        (ThrusterFaultKind.CLOSED, (), 0.0),
    ],
)
def test_thruster_faults(kind: ThrusterFaultKind, value: tuple[float, ...], expected: float) -> None:
    fault = Fault(Part.THRUSTER_Z, kind, 0.1, 0.3, value)
    healthy = [1.0, 2.0, 5.0]
    assert torque(ThrusterPairs(), fault) == [healthy, *2 * [[1.0, 2.0, expected]], *3 * [healthy]]


def test_the_later_of_two_thruster_faults_counts_and_sensors_are_no_thrusters() -> None:
    faults = (
        Fault(Part.THRUSTER_X, ThrusterFaultKind.OPEN, 0.0),
        Fault(Part.THRUSTER_X, ThrusterFaultKind.CLOSED, 0.2),
        Fault(Part.GYRO_Y, SensorFaultKind.DEAD, 0.0),
    )
    assert [row[0] for row in torque(ThrusterPairs(), *faults)] == [12.0, 12.0, 0.0, 0.0, 0.0, 0.0]
    assert [row[1] for row in torque(ThrusterPairs(), *faults)] == 6 * [2.0]


def test_thruster_numbers() -> None:
    assert ThrusterPairs().nominal_torque == 5.0
    with pytest.raises(InputError, match="`greatest_torque` must be >= 5"):
        ThrusterPairs(greatest_torque=4.0)
    with pytest.raises(InputError, match="`arm` must be > 0"):
        ThrusterPairs(arm=0.0)


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ([0, 0, 13], r"from 0 to 12 \[N m\]: axis z holds 13\.$"),
        ([[0, 0, 0], [0, -1, 0]], "axis y of row 1 holds -1. Set `signed`"),
        ([1, 2], r"shape \(\.\.\., 3\)"),
        (3.0, r"shape \(\.\.\., 3\)"),
        ([0, 0, math.nan], "must be finite"),
    ],
)
def test_commands_are_checked(command: object, says: str) -> None:
    with pytest.raises(InputError, match=says):
        ThrusterPairs().check_command("command", command)


def test_signed_pairs_take_negative_commands() -> None:
    assert ThrusterPairs(signed=True).check_command("command", [0, -12, 12]).tolist() == [0, -12, 12]
    with pytest.raises(InputError, match="from -12 to 12"):
        ThrusterPairs(signed=True).check_command("command", [0, -12.5, 12])


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((Part.GYRO_X, ThrusterFaultKind.OPEN, 0, 1), "fault of gyro.x is 'open'. Known: dead, stuck"),
        (
            (Part.THRUSTER_X, SensorFaultKind.DEAD, 0, 1),
            "fault of thruster.x is 'dead'. Known: reduced, locked, open, closed",
        ),
        ((Part.THRUSTER_X, "opn", 0, 1), "is 'opn'. Did you mean `open`"),
        ((Part.GYRO_X, SensorFaultKind.DEAD, 1, 1), "`stop_s` must be > 1"),
        ((Part.GYRO_X, SensorFaultKind.DEAD, math.nan, 1), "`start_s` must be finite"),
        ((Part.GYRO_X, SensorFaultKind.DEAD, 0, math.nan), "`stop_s` must be finite"),
        ((Part.GYRO_X, SensorFaultKind.BIAS, 0, 1), "fault bias of gyro.x must hold 1 number, got no number"),
        ((Part.GPS, SensorFaultKind.DRIFT, 0, 1, (1.0,)), "drift of gps must hold 3 numbers, got 1 number"),
        ((Part.STAR, SensorFaultKind.STUCK, 0, 1, (1.0, 2.0)), "stuck of star must hold 4 numbers, got 2 numbers"),
        ((Part.STAR, SensorFaultKind.DEAD, 0, 1, (1.0,)), "dead of star must hold no number, got 1 number"),
        ((Part.GYRO_X, SensorFaultKind.NOISE, 0, 1, (-1.0,)), "`value` must be >= 0"),
        ((Part.GYRO_X, SensorFaultKind.STUCK, 0, 1, (math.inf,)), "`value` must be finite"),
        ((Part.THRUSTER_X, ThrusterFaultKind.REDUCED, 0, 1, (1.0,)), "`value` must be > 0 and < 1"),
    ],
)
def test_faults_are_checked(arguments: tuple[object, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Fault(*arguments)  # type: ignore[arg-type]


def test_windows_take_the_start_and_not_the_end_whatever_the_rounding() -> None:
    t = 0.1 * np.arange(700, dtype=np.float64)
    for k in range(1, 600, 7):
        active = Fault(Part.GPS, SensorFaultKind.DEAD, k / 10, (k + 50) / 10).active(t)
        assert np.flatnonzero(active).tolist() == list(range(k, k + 50))
    assert Fault(Part.GPS, SensorFaultKind.DEAD, 1.0).active(np.array([0.9, 1.0, 1e9])).tolist() == [False, True, True]


def test_schedule() -> None:
    pulses = Schedule((0.5, 1.0), ((1, 2, 3), (0, 0, 4)), period_s=2.0)
    at = pulses.at(np.array([[0.0, 0.5, 0.99], [1.0, 2.0, 2.5]]))
    assert at.tolist() == [[[0, 0, 0], [1, 2, 3], [1, 2, 3]], [[0, 0, 4], [0, 0, 0], [1, 2, 3]]]
    # 29 * 0.1 s is a little less than 2.9 s
    assert Schedule((2.9,), ((1, 0, 0),)).at(np.array(29 * 0.1)).tolist() == [1, 0, 0]
    assert constant(1, 2, 3).at(np.array(1e9)).tolist() == [1, 2, 3]
    assert Schedule((), ()).at(T).tolist() == 6 * [[0, 0, 0]]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (((0, 1), ((1, 2, 3),)), "one vector for each of the 2 starts, got 1"),
        (((1, 1), ((1, 2, 3), (1, 2, 3))), r"must increase from 0 s on, got \[1.0, 1.0\]"),
        (((-1,), ((1, 2, 3),)), "must increase"),
        (((0,), ((1, 2),)), r"must have shape \(m, 3\)"),
        (((0, 2), ((1, 2, 3), (1, 2, 3)), 2.0), "`period_s` must be > 2"),
    ],
)
def test_schedules_are_checked(arguments: tuple[object, ...], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Schedule(*arguments)  # type: ignore[arg-type]


def test_the_spacecraft_knows_its_parts() -> None:
    assert Spacecraft().parts == (*GYRO, Part.STAR, *ACCELEROMETER, Part.GPS, *THRUSTERS)
    assert Spacecraft(gyro=None, star=None, accelerometer=None).parts == (Part.GPS, *THRUSTERS)
    with pytest.raises(InputError, match="belongs to no mass distribution"):
        Spacecraft(inertia_B=np.diag([1.0, 1.0, 3.0]))
