"""The page of an attitude series: which instants it offers, how they are stored, how large it gets."""

import base64
import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner
from viewed_record import record, series

from optsat.arrays import Array
from optsat.cli import app
from optsat.errors import InputError
from optsat.records.csv_log import write_csv_log
from optsat.records.record import Record, VectorChannel
from optsat.view.packing import LEAST_ANGLE_RAD, packed_angles, packed_components, packed_directions
from optsat.view.positions import slider_positions
from optsat.view.scene import scene
from optsat.view.view_page import view_page


def _unpacked(text: str, kind: str) -> NDArray[Any]:
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def _directions(text: str) -> Array:
    square = _unpacked(text, "<i2").reshape(-1, 2) / 32767
    z = 1 - np.abs(square).sum(axis=1)
    unfolded = (1 - np.abs(square[:, ::-1])) * np.where(square < 0, -1.0, 1.0)
    rows = np.column_stack((np.where((z < 0)[:, None], unfolded, square), z))
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def _angles(text: str) -> Array:
    codes = _unpacked(text, "<u2").astype(float)
    angle = LEAST_ANGLE_RAD * np.exp((codes - 1) / 65534 * np.log(np.pi / LEAST_ANGLE_RAD))
    return np.where(codes == 0, np.nan, angle)


def test_directions_come_back_within_the_width_of_a_hair() -> None:
    rows = np.random.default_rng(1).normal(size=(20_000, 3))
    rows = np.concatenate((rows, np.eye(3), -np.eye(3), [[0, 1, -1], [1, 1, 0], [-1, -1, -1]]))
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    back = _directions(packed_directions(rows))
    assert np.max(np.linalg.norm(np.cross(rows, back), axis=1)) < 7e-5
    assert np.min(np.sum(rows * back, axis=1)) > 0.99
    assert len(base64.b64decode(packed_directions(np.full((2, 3), np.nan)))) == 8


def test_angles_come_back_in_three_digits() -> None:
    angles = np.geomspace(LEAST_ANGLE_RAD, np.pi, 1000)
    assert np.max(np.abs(_angles(packed_angles(angles)) / angles - 1)) < 2e-4
    special = _angles(packed_angles(np.array([0.0, np.pi, np.nan])))
    assert special[0] == pytest.approx(LEAST_ANGLE_RAD)
    assert special[1] == pytest.approx(np.pi)
    assert np.isnan(special[2])
    assert np.max(np.abs(_unpacked(packed_components(np.array([1.0, -1.0, 0.5])), "<i2") / 32767 - [1, -1, 0.5])) < 2e-5


def test_a_short_record_is_offered_whole() -> None:
    assert slider_positions(np.zeros((7, 1), np.int8), np.zeros(7, bool), 7).tolist() == list(range(7))


def test_changes_and_faults_come_before_even_steps() -> None:
    count, most = 100_000, 2000
    state, marked = np.zeros((count, 2), np.int8), np.zeros(count, bool)
    marked[[5, 777]] = True
    marked[40_000:40_100] = True
    state[marked, 0] = 2
    state[60_000:, 1] = 1
    chosen = slider_positions(state, marked, most)
    assert len(chosen) == most
    assert np.all(np.diff(chosen) > 0)
    kept = set(chosen.tolist())
    assert set(np.flatnonzero(marked).tolist()) <= kept
    assert {0, 4, 6, 776, 778, 39_999, 40_100, 59_999, 60_000, count - 1} <= kept
    assert np.diff(chosen).max() < 2 * count / (most - 110)


def test_where_all_is_fault_the_positions_are_spread() -> None:
    state = np.arange(10_000, dtype=np.int64)[:, None] % 2
    chosen = slider_positions(state.astype(np.int8), state[:, 0] == 1, 100)
    assert len(chosen) == 100
    assert chosen[0] < 100
    assert chosen[-1] > 9_900


def test_the_scene_holds_what_was_determined() -> None:
    one, rec = series(windowed=True), record()
    document = scene(rec, one)
    assert (document["epochs"], document["count"]) == (61, 61)
    assert np.allclose(_unpacked(document["t"], "<f4"), rec.t)
    assert np.allclose(_unpacked(document["q"], "<i2").reshape(-1, 4) / 32767, one.q_BN, atol=2e-5)
    assert np.allclose(_angles(document["bound"]), one.bound_rad, rtol=3e-4)
    assert rec.q_BN_true is not None
    assert np.allclose(_angles(document["error"]), one.error_rad(rec.q_BN_true), rtol=3e-4, atol=1e-8)
    sun, magnetometer = document["channels"]
    assert sun["name"] == "sun"
    assert _unpacked(sun["state"], "i1").tolist() == [1] * 40 + [0] * 21
    assert np.flatnonzero(_unpacked(magnetometer["state"], "i1") == 2).tolist() == [20, 21, 22, 23, 24]
    valid = rec.channel("sun").valid
    assert np.allclose(_directions(sun["r"])[valid], rec.channel("sun").r_N[valid], atol=1e-4)
    residual = _angles(magnetometer["residual"])
    assert np.all(np.degrees(residual[20:25]) > 4)
    assert np.all(residual[:20] <= rec.channel("magnetometer").angle_bound_rad[:20])


def test_a_strided_series_and_a_record_without_truth() -> None:
    from optsat.estimators.attitude_series import certify_record

    plain = dataclasses.replace(record(), q_BN_true=None)
    document = scene(plain, certify_record(plain, every=7), every=7)
    assert document["count"] == 9
    assert document["truth"] is document["error"] is None
    assert "Crosses" not in view_page(plain, certify_record(plain, every=7), "x", every=7)
    with pytest.raises(InputError, match="not of this record"):
        scene(plain, certify_record(plain, every=7))


def test_the_same_series_gives_the_same_page_and_words_stay_words() -> None:
    page = view_page(record(), series(windowed=False), "<script>alert(1)</script>")
    assert page == view_page(record(), series(windowed=False), "<script>alert(1)</script>")
    assert "<script>alert" not in page
    assert not re.search(r'(?:src|href)="(?!#|data:)', page)
    found = re.search(r'id="scene">(.*?)</script>', page, re.S)
    assert found is not None
    assert json.loads(found[1])["statuses"] == ["ok", "unbounded", "inconsistent"]


def _long(epochs: int, channels: int) -> Record:
    generator = np.random.default_rng(2)
    rows = generator.normal(size=(channels, epochs, 3))
    rows /= np.linalg.norm(rows, axis=2, keepdims=True)
    q = generator.normal(size=(epochs, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    made = [
        VectorChannel(f"s{k}", "B", rows[k], rows[k], np.full(epochs, 1e-3), generator.random(epochs) < 0.9)
        for k in range(channels)
    ]
    return Record(np.linspace(0.0, 0.1 * epochs, epochs), tuple(made), q_BN_true=q)


@pytest.mark.parametrize("channels", [1, 2, 5])
def test_a_long_record_keeps_below_150_kilobytes(channels: int) -> None:
    from optsat.estimators.attitude_series import AttitudeSeries

    rec = _long(20_000, channels)
    assert rec.q_BN_true is not None
    status = np.zeros(20_000, dtype=np.int8)
    status[[123, 19_000]] = 2
    rejected = np.zeros((20_000, channels), dtype=bool)
    names = tuple(channel.name for channel in rec.channels)
    one = AttitudeSeries(
        rec.t, rec.q_BN_true, np.full(20_000, 0.01), status, status.astype(np.int64), rejected, names, False
    )
    page = view_page(rec, one, "long")
    assert len(page.encode()) < 150_000
    document = scene(rec, one)
    assert document["count"] <= 2000
    assert np.sum(_unpacked(document["status"], "i1") == 2) == 2
    assert f"{document['count']:,} of 20,000 instants" in page


def test_the_command(tmp_path: Path) -> None:
    write_csv_log(tmp_path / "log.csv", record())
    run = CliRunner()
    result = run.invoke(app, ["view", str(tmp_path / "log.csv"), "--window", "30", "--spacing", "5"])
    assert (result.exit_code, result.stdout) == (0, "")
    assert "window of 30 s, one epoch every 5 s" in (tmp_path / "log.html").read_text()
    result = run.invoke(
        app, ["view", str(tmp_path / "log.csv"), "--stride", "10", "--out", str(tmp_path / "a.html"), "--json"]
    )
    assert json.loads(result.stdout) == {
        "log": str(tmp_path / "log.csv"),
        "epochs": 7,
        "file": str(tmp_path / "a.html"),
    }
    assert "single frames" in (tmp_path / "a.html").read_text()
    for arguments in (
        [str(tmp_path / "none.csv")],
        [str(tmp_path / "log.csv"), "--out", str(tmp_path / "no" / "x.html")],
    ):
        assert run.invoke(app, ["view", *arguments]).exit_code == 2
