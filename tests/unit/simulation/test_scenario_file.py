"""Scenario files: the example says what it does, and every fault is named with file, entry and allowed range."""

import math
from pathlib import Path

import numpy as np
import pytest

from optsat.errors import InputError
from optsat.simulation.orbit_scenario import OrbitScenario
from optsat.simulation.scenario_file import example_text, parse_scenario, read_scenario
from optsat.simulation.sensor_fault import SensorFault

DEG = math.pi / 180


def test_an_empty_file_is_the_papers_run() -> None:
    assert parse_scenario("") == OrbitScenario()


def test_the_example() -> None:
    scenario = parse_scenario(example_text())
    assert scenario.argument_of_latitude == pytest.approx(70 * DEG)
    assert scenario.gyro_bound_rad_s == pytest.approx(0.002 * DEG)
    assert scenario.faults == (SensorFault("magnetometer", 300, 350, "offset", 5 * DEG),)
    # the remark in the file
    dark = scenario.times()[scenario.in_shadow()]
    assert (dark[0], dark[-1]) == (797.0, 1200.0)


def test_every_entry_reaches_the_scenario() -> None:
    text = """
        epoch = 2022-01-02T03:04:05Z
        duration_s = 10
        dt_s = 0.5
        noise = "boundary"
        faults = [{channel = "sun", kind = "dead", start_s = 1, stop_s = 2}]
        orbit = {altitude_km = 500, inclination_deg = 10, raan_deg = 20, argument_of_latitude_deg = 30}
        sun = {bound_deg = 1, eclipse = true}
        magnetometer = {bound_deg = 2}
        gyro = {bound_deg_s = 3, error = "random"}
        [body]
        inertia_kg_m2 = [[2, 0, 0], [0, 2, 0], [0, 0, 1.5]]
        yaw_deg = 1
        pitch_deg = 2
        roll_deg = 3
        rate = "inertial"
    """
    s = parse_scenario(text)
    assert (s.altitude, s.inclination, s.raan) == (500e3, 10 * DEG, 20 * DEG)
    assert s.argument_of_latitude == 30 * DEG
    assert (s.duration, s.dt, s.noise, s.rate, s.eclipse) == (10.0, 0.5, "boundary", "inertial", True)
    assert (s.sun_bound_rad, s.magnetometer_bound_rad, s.gyro_bound_rad_s) == (1 * DEG, 2 * DEG, 3 * DEG)
    assert s.gyro_error == "random"
    assert s.yaw_pitch_roll == (1 * DEG, 2 * DEG, 3 * DEG)
    assert s.faults == (SensorFault("sun", 1, 2, "dead"),)
    assert s.epoch.days_since_j2000 == pytest.approx(8036.627835648, abs=1e-9)
    np.testing.assert_array_equal(s.inertia_B, np.diag([2, 2, 1.5]))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[orbit]\naltitude = 5", "`orbit.altitude` is no known entry. Did you mean `altitude_km`?"),
        ("altitude_km = 5", "`altitude_km` is no known entry. Did you mean `orbit.altitude_km`?"),
        ("[sun]\nxyz = 5", "`sun.xyz` is no known entry. Known here: bound_deg, eclipse."),
        ("[magnetmeter]\nbound_deg = 1", "Did you mean `magnetometer`?"),
        ("[orbit]\ninclination_deg = 200", "`orbit.inclination_deg` must be a number >= 0 and <= 180, got 200."),
        ("dt_s = 0", "`dt_s` must be a number > 0 and <= 3600, got 0."),
        ("dt_s = true", "`dt_s` must be a number > 0 and <= 3600, got true."),
        ("dt_s = '1'", "`dt_s` must be a number > 0 and <= 3600, got '1'."),
        ("dt_s = nan", "`dt_s` must be a number > 0 and <= 3600, got nan."),
        ("noise = 'gauss'", '`noise` must be one of "cap", "angle", "boundary", got \'gauss\'.'),
        ("[sun]\neclipse = 1", "`sun.eclipse` must be true or false, got 1."),
        ("sun = 3", "`sun` must be a table, got 3."),
        ("faults = 3", "`faults` must be a list, got 3."),
        ("[gyro]\nerror = 'constant'", "`gyro.bound_deg_s` is missing; it must be a number >= 0 and <= 1000."),
        ("gyro = 1", "`gyro` must be a table, got 1."),
        ("epoch = 7", "`epoch` must be a text, got 7."),
        ("epoch = 'yesterday'", "ISO 8601"),
        ("[[faults]]\nchannel = 'star'\nstart_s = 1\nstop_s = 2", "`faults[0].channel` must be one of"),
        ("[[faults]]\nchannel = 'sun'\nstart_s = 2\nstop_s = 1\nkind = 'dead'", "`stop_s` must be > 2"),
        ("[body]\ninertia_kg_m2 = [[1, 0, 0], [0, 1, 0]]", "`inertia_B` must have shape (3, 3)"),
        ("[body]\ninertia_kg_m2 = [[1, 0, 'x'], [0, 1, 0]]", "`body.inertia_kg_m2[0][2]` must be a number, got 'x'."),
        ("[body\n", "this is not TOML"),
    ],
)
def test_faults_are_sentences(text: str, says: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_scenario(text, "my.toml")
    message = str(caught.value)
    assert says in message
    assert message.startswith("my.toml: ")
    assert len(message.splitlines()) == 1
    assert "pydantic" not in message


def test_all_faults_are_listed_at_once() -> None:
    with pytest.raises(InputError) as caught:
        parse_scenario("dt_s = 0\nduration_s = -1\nnoise = 3", "my.toml")
    assert [line.split("`")[1] for line in str(caught.value).splitlines()] == ["duration_s", "dt_s", "noise"]


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: the scenario cannot be opened: No such file"):
        read_scenario(tmp_path / "none.toml")
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"bytes\.toml: this is not text"):
        read_scenario(tmp_path / "bytes.toml")
