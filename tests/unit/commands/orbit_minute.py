"""A minute in orbit with everything in it, a magnetometer failure, an eclipse, a gyro, and a way to run commands."""

from pathlib import Path

from typer.testing import CliRunner, Result

from optsat.cli import app

# the Sun is lost at t = 40 s
SCENARIO = """
duration_s = 60
[orbit]
argument_of_latitude_deg = 115
[sun]
eclipse = true
[gyro]
bound_deg_s = 0.002
[[faults]]
channel = "magnetometer"
start_s = 20
stop_s = 25
angle_deg = 5
"""


def invoke(*arguments: object) -> Result:
    """Run `optsat` with the given arguments."""
    return CliRunner().invoke(app, [str(each) for each in arguments], prog_name="optsat")


def write_scenario(folder: Path) -> Path:
    """Return the file of the scenario."""
    path = folder / "minute.toml"
    path.write_text(SCENARIO)
    return path


def write_log(folder: Path) -> Path:
    """Return the log of the minute."""
    path = folder / "log.csv"
    assert invoke("simulate", write_scenario(folder), "--out", path).exit_code == 0
    return path
