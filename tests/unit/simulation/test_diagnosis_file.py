"""Diagnosis files: the example is scenario S1, every entry counts, and each mistake is named with its cure."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from pydantic import BaseModel

from optsat.errors import InputError
from optsat.models.accelerometer import Axes, Sensed
from optsat.models.faults import Fault, SensorFaultKind, ThrusterFaultKind
from optsat.models.parts import Part
from optsat.models.spacecraft import Spacecraft
from optsat.simulation.diagnosis_file import (
    _Scenario,
    diagnosis_example,
    parse_diagnosis_scenario,
    read_diagnosis_scenario,
)
from optsat.simulation.diagnosis_run import simulate
from optsat.simulation.diagnosis_scenario import (
    AttitudeTruth,
    DiagnosisScenario,
    OrbitTruth,
    Sampling,
    scenario_s0,
    scenario_s1,
)
from optsat.simulation.scenario_file import ScenarioKind, kind_of_scenario, parse_scenario

HEAD = 'kind = "diagnosis"\n'


def test_nothing_but_the_kind_is_s0() -> None:
    assert simulate(parse_diagnosis_scenario(HEAD), 1).telemetry.equals(simulate(scenario_s0(), 1).telemetry)


def test_the_example_is_s1() -> None:
    scenario = parse_diagnosis_scenario(diagnosis_example())
    assert (scenario.name, scenario.faults) == ("S1", scenario_s1().faults)
    mine, its = simulate(scenario, 1).telemetry, simulate(scenario_s1(), 1).telemetry
    # the file rounds mu and the accelerometer's sigma to ten digits
    for name in its.sensors:
        np.testing.assert_allclose(getattr(mine, name), getattr(its, name), rtol=1e-8, atol=1e-8, err_msg=name)


def test_the_example_shows_every_entry() -> None:
    defaults = parse_diagnosis_scenario(HEAD)
    text = diagnosis_example()
    without_faults = text[: text.index("[[faults]]")].replace('name = "S1"', "")
    shown = parse_diagnosis_scenario(without_faults)
    for name in ("duration", "dt", "q_BN", "omega_BN_B", "r_N", "v_N", "orbit", "attitude", "sampling", "gaps_s"):
        assert getattr(shown, name) == getattr(defaults, name), name
    assert shown.spacecraft.thrusters == defaults.spacecraft.thrusters
    fields = {name for table in _tables(_Scenario) for name in table.model_fields}
    assert {name for name in fields if not re.search(rf"^(# |\[+)?{name}\b", text, re.MULTILINE)} == {"value"}


def _tables(model: type[BaseModel]) -> list[type[BaseModel]]:
    inner = [field.annotation for field in model.model_fields.values()]
    inner += [get_args(annotation)[0] for annotation in inner if get_args(annotation)]
    found = [each for each in inner if isinstance(each, type) and issubclass(each, BaseModel)]
    return [model, *(table for each in found for table in _tables(each))]


def test_every_entry_reaches_the_scenario() -> None:
    text = """
        kind = "diagnosis"
        name = "mine"
        duration_s = 5
        dt_s = 0.5
        time_jitter_s = 0.1
        gaps_s = [[1, 2]]
        [motion]
        q_BN = [0, 0, 1, 0]
        omega_BN_B_rad_s = [1, 2, 3]
        r_N_m = [7e6, 0, 0]
        v_N_m_s = [0, 7.6e3, 0]
        orbit = "nine_state"
        attitude = "euler"
        rate_noise_rad_s = 2
        acceleration_noise_m_s2 = 3
        disturbance_torque_N_m = [4, 5, 6]
        gravitational_parameter_m3_s2 = 4e14
        [body]
        inertia_kg_m2 = [[2, 0, 0], [0, 2, 0], [0, 0, 1.5]]
        [thrusters]
        force_N = 1
        arm_m = 2
        greatest_torque_N_m = 5
        signed = true
        [commands]
        start_s = [0, 1]
        torque_N_m = [[1, -1, 0], [0, 0, 0]]
        period_s = 2
        [gyro]
        sigma_rad_s = 0.1
        bias_rad_s = [7, 8, 9]
        bias_walk_rad_s = 10
        every = 2
        dropout = 0.5
        [star]
        variance = [1, 2, 3, 4]
        [gps]
        present = false
        [accelerometer]
        sigma_m_s2 = 2
        sensed = "specific_force"
        axes = "body"
        [skewed_gyro]
        present = true
        axis = [0, 0, 2]
        sigma_rad_s = 0.3
        [pressure]
        present = true
        sigma_N_m = 0.7
        [[faults]]
        part = "gyro.x"
        kind = "bias"
        start_s = 1
        value = 0.1
        [[faults]]
        part = "thruster.y"
        kind = "locked"
        start_s = 1
        stop_s = 2
        value = [7]
    """
    s = parse_diagnosis_scenario(text)
    craft = s.spacecraft
    assert (s.name, s.duration, s.dt, s.time_jitter_s, s.gaps_s) == ("mine", 5, 0.5, 0.1, ((1, 2),))
    assert (s.q_BN, s.omega_BN_B, s.r_N, s.v_N) == ((0, 0, 1, 0), (1, 2, 3), (7e6, 0, 0), (0, 7.6e3, 0))
    assert (s.orbit, s.attitude) == (OrbitTruth.NINE_STATE, AttitudeTruth.EULER)
    assert (s.rate_variance, s.acceleration_variance, s.disturbance_torque_B) == (4, 9, (4, 5, 6))
    assert craft.gravitational_parameter == 4e14
    np.testing.assert_array_equal(craft.inertia_B, np.diag([2, 2, 1.5]))
    thrusters = craft.thrusters
    assert (thrusters.force, thrusters.arm, thrusters.greatest_torque, thrusters.signed) == (1, 2, 5, True)
    assert s.command_torque_B.at(np.array([0.5, 1.5, 2.5])).tolist() == [[1, -1, 0], [0, 0, 0], [1, -1, 0]]
    assert craft.gyro is not None
    assert craft.star is not None
    assert craft.accelerometer is not None
    assert craft.skewed_gyro is not None
    assert craft.pressure is not None
    np.testing.assert_allclose(craft.gyro.R, 0.01 * np.eye(3))
    assert (craft.gyro.bias, craft.gyro.bias_walk) == ((7, 8, 9), 10)
    np.testing.assert_array_equal(craft.star.R, np.diag([1, 2, 3, 4]))
    assert craft.gps is None
    np.testing.assert_array_equal(craft.accelerometer.R, 4 * np.eye(3))
    assert (craft.accelerometer.sensed, craft.accelerometer.axes) == (Sensed.SPECIFIC_FORCE, Axes.BODY)
    assert (craft.skewed_gyro.axis_B, craft.skewed_gyro.sigma, craft.pressure.sigma) == ((0, 0, 1), 0.3, 0.7)
    assert s.sampling["gyro"] == Sampling(2, 0.5)
    assert s.faults == (
        Fault(Part.GYRO_X, SensorFaultKind.BIAS, 1, math.inf, (0.1,)),
        Fault(Part.THRUSTER_Y, ThrusterFaultKind.LOCKED, 1, 2, (7.0,)),
    )
    forced = parse_diagnosis_scenario(HEAD + "[forces]\nstart_s = [1]\nacceleration_m_s2 = [[1, 2, 3]]\nperiod_s = 4")
    assert forced.specific_force_B.at(np.array([0.5, 5.5])).tolist() == [[0, 0, 0], [1, 2, 3]]


FAULT = '[[faults]]\npart = "{}"\nkind = "{}"\nstart_s = 1\n{}'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("dt = 0.1", "f.toml: `dt` is no known entry. Did you mean `dt_s`?"),
        ("sigma_m = 1", "`sigma_m` is no known entry. Did you mean `gps.sigma_m`?"),
        ("dt_s = 0", "`dt_s` must be a number > 0 and <= 3600, got 0."),
        ("[gyro]\nevery = 0", "`gyro.every` must be a whole number >= 1, got 0."),
        ("[gyro]\nevery = 1.5", "`gyro.every` must be a whole number >= 1, got 1.5."),
        ("[commands]\nperiod_s = -1", "`commands.period_s` must be a number > 0, got -1."),
        ("[motion]\nq_BN = [1, 2]", "`motion.q_BN` must be a list of 4 numbers, got [1, 2]."),
        ("[motion]\nq_BN = [1, 2, 3, 4]", "`motion.q_BN` must be a unit quaternion (scalar last): norm was 5.47723"),
        ("[motion]\nr_N_m = [1, 2, 'x']", "`motion.r_N_m[2]` must be a number, got 'x'."),
        (
            "[motion]\nv_N_m_s = [1800, 4300, 6100]",
            "f.toml: `motion.v_N_m_s` leads into the Earth: flight-path angle 27.44 deg",
        ),
        ("[motion]\norbit = 'two-body'", "got 'two-body'. Did you mean \"two_body\"?"),
        ("gaps_s = [[1]]", "`gaps_s[0]` must be a list of 2 numbers, got [1]."),
        ("gaps_s = [[2, 1]]", "`gaps_s (stop)` must be > 2"),
        ("gaps_s = [[0, 1]]", "`gaps_s (start)` must be > 0"),
        ("time_jitter_s = 0.05", "`time_jitter_s` must be >= 0 and < 0.05"),
        (
            "[body]\ninertia_kg_m2 = [[1, 0, 0], [0, 1, 0], [0, 0, 5]]",
            "`body.inertia_kg_m2` belongs to no mass distribution",
        ),
        ("[thrusters]\ngreatest_torque_N_m = 1", "[thrusters] `greatest_torque_N_m` must be >= 5"),
        ("[commands]\nstart_s = [0, 0]", "[commands] there must be one vector for each of the 2 starts, got 1."),
        (
            "[commands]\ntorque_N_m = [[0, 0, -2]]",
            "`commands.torque_N_m` must be from 0 to 12 [N m]: axis z of row 0 holds -2. Set `signed`",
        ),
        ("[commands]\ntorque_N_m = [[0, 0, 13]]", "must be from 0 to 12 [N m]: axis z of row 0 holds 13."),
        ("[skewed_gyro]\npresent = true\naxis = [0, 0, 0]", "[skewed_gyro] `axis` is the zero vector"),
        ("[star]\nvariance = [1, 1, 1, 0]", "[star] `variance` must be > 0 in all components"),
        (FAULT.format("gyro.w", "dead", ""), "got 'gyro.w'. Did you mean \"gyro.z\"?"),
        (FAULT.format("gyro.x", "frezze", ""), "got 'frezze'. Did you mean \"freeze\"?"),
        (FAULT.format("gyro.x", "open", ""), "[faults[0]] `kind` of a fault of gyro.x is 'open'. Known: dead, stuck"),
        (FAULT.format("gyro.x", "bias", ""), "[faults[0]] `value` of the fault bias of gyro.x must hold 1 number"),
        (FAULT.format("gyro.x", "bias", "value = 'a'"), "`faults[0].value` must be a list, got 'a'."),
        (FAULT.format("gyro.x", "bias", "value = true"), "`faults[0].value` must be a list, got true."),
        (FAULT.format("gyro.x", "dead", "stop_s = 1"), "[faults[0]] `stop_s` must be > 1"),
        (FAULT.format("pressure.x", "dead", ""), "entry 0 is of pressure.x, which the spacecraft does not have. It"),
        ("[forces]\nstart_s = [0]\nacceleration_m_s2 = [[1, 0, 0]]\n[motion]\norbit = 'nine_state'", "draws its own"),
        ("x = = 1", "f.toml: this is not TOML"),
    ],
)
def test_mistakes_are_named(text: str, says: str) -> None:
    with pytest.raises(InputError) as refused:
        parse_diagnosis_scenario(HEAD + text, "f.toml")
    assert says in str(refused.value)
    assert str(refused.value).startswith("f.toml: ")
    assert not str(refused.value).startswith("f.toml: f.toml")


def test_all_mistakes_at_once() -> None:
    with pytest.raises(InputError) as refused:
        parse_diagnosis_scenario(HEAD + "dt = 1\n[gyro]\nevery = 0\n[star]\ndropout = 2", "f.toml")
    assert len(str(refused.value).splitlines()) == 3


def test_the_kind_of_a_file(tmp_path: Path) -> None:
    assert kind_of_scenario("") is ScenarioKind.ORBIT
    assert kind_of_scenario('kind = "orbit"') is ScenarioKind.ORBIT
    assert kind_of_scenario(HEAD) is ScenarioKind.DIAGNOSIS
    with pytest.raises(InputError, match=r"f\.toml: `kind` is 'diagnose'. Did you mean `diagnosis`"):
        kind_of_scenario('kind = "diagnose"', "f.toml")
    assert parse_scenario('kind = "orbit"') == parse_scenario("")
    with pytest.raises(InputError, match="`kind` must be \"orbit\", got 'diagnosis'"):
        parse_scenario(HEAD)
    with pytest.raises(InputError, match="`kind` is missing"):
        parse_diagnosis_scenario("")
    (tmp_path / "s.toml").write_text(HEAD)
    assert read_diagnosis_scenario(tmp_path / "s.toml").name == "S0"


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"dt": 0.0}, "`dt` must be > 0"),
        ({"duration": 2e6}, "`duration` must be >= 0 and <= 1e"),
        ({"sampling": {"pressure": Sampling()}}, "`sampling` is of pressure, which is no sensor of the spacecraft"),
        ({"rate_variance": -1.0}, "`rate_variance` must be >= 0"),
        ({"omega_BN_B": (1.0,)}, "`omega_BN_B` must have shape"),
    ],
)
def test_scenarios_are_checked(changes: dict[str, object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        replace(scenario_s0(), **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize("every", [0, True, 1.5])
def test_sampling_is_checked(every: object) -> None:
    with pytest.raises(InputError, match="`every` must be a whole number >= 1"):
        Sampling(every)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`dropout` must be >= 0 and <= 1"):
        Sampling(1, 1.5)


def test_a_scenario_without_sensors_has_only_commands() -> None:
    bare = Spacecraft(gyro=None, star=None, gps=None, accelerometer=None)
    telemetry = simulate(DiagnosisScenario(spacecraft=bare, duration=1.0), 1).telemetry
    assert telemetry.sensors == ()
    assert len(telemetry) == 11
