"""CSV logs: what is written reads back bit for bit; damage makes a RecordError or a sound record, never a crash."""

import tempfile
from itertools import combinations
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from optsat.arrays import Array
from optsat.errors import RecordError
from optsat.records.csv_log import read_csv_log, write_csv_log
from optsat.records.record import Record, VectorChannel

WORDS = st.from_regex(r"[A-Za-z][A-Za-z0-9_-]{0,8}", fullmatch=True).filter(lambda w: w not in ("t", "gyro", "truth"))


def unit(generator: np.random.Generator, count: int, width: int) -> Array:
    vectors = generator.normal(size=(count, width))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


@st.composite
def records(draw: st.DrawFn) -> Record:
    generator = np.random.default_rng(draw(st.integers(0, 2**32)))
    count = draw(st.integers(1, 6))
    times = st.floats(-1e12, 1e12)
    t = np.array(sorted(draw(st.sets(times, min_size=count, max_size=count))))
    channels = tuple(
        VectorChannel(
            name=name,
            frame="B",
            b_B=unit(generator, count, 3),
            r_N=unit(generator, count, 3),
            angle_bound_rad=10 ** generator.uniform(-12, 0.4, count),
            valid=generator.random(count) < 0.7,
        )
        for name in draw(st.lists(WORDS, max_size=3, unique=True))
    )
    gone = generator.random(count) < 0.3
    rate = np.where(gone[:, None], np.nan, generator.normal(size=(count, 3))) if draw(st.booleans()) else None
    bound = generator.random(count) if rate is not None and draw(st.booleans()) else None
    truth = np.where(gone[:, None], np.nan, unit(generator, count, 4)) if draw(st.booleans()) else None
    epoch = draw(st.none() | st.datetimes().map(lambda d: d.isoformat()))
    return Record(t, channels, rate, bound, truth, epoch, draw(st.text()))


def write(record: Record) -> tuple[Record, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        write_csv_log(path, record)
        return read_csv_log(path, strict=True), path.read_bytes()


def read(data: bytes) -> Record | None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(data)
        try:
            return read_csv_log(path)
        except RecordError:
            return None


@settings(max_examples=60)
@given(records())
def test_round_trip_is_exact(record: Record) -> None:
    back, _ = write(record)
    for name in ("t", "omega_BN_B", "gyro_bound_rad_s", "q_BN_true"):
        ours, theirs = getattr(record, name), getattr(back, name)
        assert (ours is None) == (theirs is None)
        if ours is not None:
            np.testing.assert_array_equal(ours, theirs, strict=True)
    assert (back.epoch, back.source) == (record.epoch, record.source)
    assert [channel.name for channel in back.channels] == [channel.name for channel in record.channels]
    for ours, theirs in zip(record.channels, back.channels, strict=True):
        for name in ("b_B", "r_N", "angle_bound_rad", "valid"):
            np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), strict=True)


@settings(max_examples=60)
@given(records(), st.data())
def test_damaged_bytes_never_crash_the_reader(record: Record, data: st.DataObject) -> None:
    _, log = write(record)
    damaged = bytearray(log)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged) - 1))
        damaged[at : at + data.draw(st.integers(0, 2))] = data.draw(
            st.binary(max_size=2) | st.sampled_from([b"\n", b'"', b",", b";", b"[", b"#"])
        )
    read(bytes(damaged))


@given(st.binary(max_size=200), st.booleans())
def test_garbage_is_refused(garbage: bytes, magic: bool) -> None:
    read((b"# optsat-log 1\n" if magic else b"") + garbage)


@given(st.lists(st.integers(0, 8), min_size=1, max_size=9))
def test_time_order_costs_the_fewest_rows(times: list[int]) -> None:
    record = read("".join(["# optsat-log 1\nt [s]\n", *(f"{t}\n" for t in times)]).encode())
    assert record is not None
    most = max(
        n for n in range(1, len(times) + 1) for some in combinations(times, n) if list(some) == sorted(set(some))
    )
    assert len(record) == most
    assert len(record.bad_rows) == len(times) - most
    dropped = {bad.line - 3 for bad in record.bad_rows}
    np.testing.assert_array_equal(record.t, [t for i, t in enumerate(times) if i not in dropped])


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3).filter(lambda v: np.linalg.norm(v) > 1e-3),
    st.integers(0, 2**32),
    st.sampled_from([1e-290, 1.0, 1e290]),
)
def test_sensor_frames_and_lengths(b_S: list[float], seed: int, length: float) -> None:
    mounting = Rotation.random(rng=np.random.default_rng(seed))  # SciPy's matrix is A(q)^T: it takes S to B for q_SB
    cells = ",".join(repr(length * x) for x in b_S)
    heading = ",".join(f"s.{side}.{axis} [T]" for side in ("measured", "reference") for axis in "xyz")
    head = f'# optsat-log 1\n# [frames.S1]\n# q_SB = {mounting.as_quat().tolist()}\n# [vectors.s]\n# frame = "S1"\n'
    record = read(f"{head}# bound_deg = 1\nt [s],{heading}\n0,{cells},0,0,1\n".encode())
    assert record is not None
    assert not record.bad_rows
    expected = mounting.apply(np.array(b_S) / np.linalg.norm(b_S))
    np.testing.assert_allclose(record.channels[0].b_B[0], expected, atol=1e-14)
