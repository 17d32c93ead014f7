"""A minute in orbit to be looked at: a magnetometer that fails, an eclipse, a true attitude."""

import functools

import numpy as np

from optsat.estimators.attitude_series import AttitudeSeries, Window, certify_record
from optsat.records.record import Record
from optsat.simulation.scenario_file import parse_scenario

_SCENARIO = """
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


@functools.cache
def record() -> Record:
    """Return the record: the fault from 20 s to 24 s, the Sun lost at 40 s."""
    return parse_scenario(_SCENARIO, "minute").simulate(np.random.default_rng(0))


@functools.cache
def series(windowed: bool) -> AttitudeSeries:
    """Return its attitudes, of each instant by itself or with half a minute of memory."""
    return certify_record(record(), Window(30.0, 5.0) if windowed else None)
