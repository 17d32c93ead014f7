"""Telemetry logs: any readings, missing samples and spacing of time read back to the bit; damage never crashes."""

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from optsat.errors import RecordError
from optsat.records.telemetry import CHANNELS, Telemetry
from optsat.records.telemetry_csv import read_telemetry, write_telemetry


@st.composite
def telemetries(draw: st.DrawFn) -> Telemetry:
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    t = np.array(sorted(draw(st.sets(st.floats(-1e12, 1e12), min_size=1, max_size=6))))
    values = {}
    for name, (width, _) in CHANNELS.items():
        if name != "command_torque_B" and draw(st.booleans()):
            continue
        reading = rng.normal(size=(len(t), width)) * 10 ** rng.uniform(-200, 200, (len(t), width))
        if name != "command_torque_B":
            reading[rng.random(reading.shape) < 0.3] = np.nan
        values[name] = reading if width > 1 else reading[:, 0]
    return Telemetry(t, **values, source=draw(st.text()))  # type: ignore[arg-type]


def write(folder: str, telemetry: Telemetry) -> Path:
    path = Path(folder) / "log.csv"
    write_telemetry(path, telemetry)
    return path


@given(telemetries())
@settings(max_examples=60)
def test_round_trip(telemetry: Telemetry) -> None:
    with tempfile.TemporaryDirectory() as folder:
        assert read_telemetry(write(folder, telemetry), strict=True).equals(telemetry)


@given(telemetries(), st.data())
@settings(max_examples=60)
def test_a_damaged_log_is_refused_or_sound(telemetry: Telemetry, data: st.DataObject) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = write(folder, telemetry)
        content = bytearray(path.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        path.write_bytes(content)
        try:
            damaged = read_telemetry(path)
        except RecordError:
            return
        assert np.isfinite(damaged.command_torque_B).all()
        assert (np.diff(damaged.t) > 0).all()
