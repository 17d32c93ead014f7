"""Record: only valid pairs come out, and no inconsistent record can be made."""

from typing import Any

import numpy as np
import pytest

from optsat.errors import InputError
from optsat.records.record import BadRow, Record, VectorChannel

EYE = np.eye(3)


def channel(name: str = "sun", **changes: Any) -> VectorChannel:
    fields: dict[str, Any] = {
        "frame": "S1",
        "b_B": EYE,
        "r_N": EYE[::-1],
        "angle_bound_rad": np.array([0.1, 0.2, 0.3]),
        "valid": np.array([True, False, True]),
    }
    return VectorChannel(name, **(fields | changes))


def record(**changes: Any) -> Record:
    fields: dict[str, Any] = {
        "t": np.array([0.0, 1.0, 2.0]),
        "channels": (channel(), channel("mag", valid=np.ones(3, bool))),
    }
    return Record(**(fields | changes))


def test_pairs_returns_valid_samples_only() -> None:
    b_B, r_N, bound, names = record().pairs(1)
    np.testing.assert_array_equal(b_B, EYE[1:2])
    np.testing.assert_array_equal(r_N, EYE[1:2])
    assert (bound.tolist(), names) == ([0.2], ("mag",))
    assert record().pairs(2)[3] == ("sun", "mag")
    assert [part.shape for part in Record(t=np.array([0.0])).pairs(0)[:3]] == [(0, 3), (0, 3), (0,)]


def test_invalid_samples_are_nan_and_arrays_are_frozen_copies() -> None:
    own = EYE.copy()
    sun = channel(b_B=own)
    assert np.isnan(sun.b_B[1]).all()
    assert np.isnan(sun.angle_bound_rad[1])
    assert own[1, 1] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        sun.b_B[0, 0] = 2.0


def test_truth_is_signed_and_masked() -> None:
    q = np.array([[0, 0, 0.6, -0.8], [np.nan] * 4, [-1, 0, 0, 0]])
    made = record(q_BN_true=q)
    np.testing.assert_array_equal(made.q_BN_true, [[0, 0, -0.6, 0.8], [np.nan] * 4, [1, 0, 0, 0]])
    assert made.has_truth.tolist() == [True, False, True]
    assert not made.has_rate.any()


def test_repr_and_len() -> None:
    made = record(bad_rows=(BadRow("f", 1, "t", "why"),), omega_BN_B=np.zeros((3, 3)))
    assert repr(made) == "Record(3 epochs, 0 to 2 s, sun 2 valid, mag 3 valid, gyro, 1 bad rows)"
    assert repr(made.channel("sun")) == "VectorChannel('sun', frame='S1', 2 of 3 valid)"
    assert len(made) == 3


BAD_CHANNELS: list[tuple[dict[str, Any], str]] = [
    ({"name": "gyro"}, "`name` of a channel"),
    ({"name": "a b"}, "`name` of a channel"),
    ({"frame": ""}, "`frame` of channel sun"),
    ({"valid": np.array([1, 0, 1])}, "`valid` of channel sun"),
    ({"b_B": EYE[:2]}, r"`sun.b_B` must have shape \(3, 3\)"),
    ({"b_B": 2 * EYE}, "`sun.b_B` must be of length 1: row 0"),
    ({"r_N": EYE * [1, 1, np.nan]}, "`sun.r_N` must be of length 1: row 0"),
    ({"angle_bound_rad": np.array([0.1, 0.1, -0.1])}, "`sun.angle_bound_rad` must be a bound in .* row 2"),
    ({"angle_bound_rad": np.array([4, 0.1, 0.1])}, "row 0 holds 4"),
    ({"angle_bound_rad": np.array([np.nan, 0.1, 0.1])}, "row 0 holds nan"),
]
BAD_RECORDS: list[tuple[dict[str, Any], str]] = [
    ({"t": np.array([])}, "at least one epoch"),
    ({"t": np.array([0.0, 1.0, 1.0])}, "row 2 holds 1"),
    ({"t": np.array([0.0, np.nan, 1.0])}, "row 1 holds nan"),
    ({"t": np.array([0.0, 1.0])}, "channel sun holds 3 samples"),
    ({"channels": (channel(), channel())}, "different names"),
    ({"omega_BN_B": np.zeros((3, 2))}, r"\(3, 3\) \[rad/s\]"),
    ({"omega_BN_B": EYE * [1, 1, np.nan]}, "`omega_BN_B` must be finite, or NaN in all"),
    ({"gyro_bound_rad_s": np.zeros(3)}, "without `omega_BN_B`"),
    ({"omega_BN_B": EYE, "gyro_bound_rad_s": np.array([0, np.inf, 0])}, "row 1 holds inf"),
    ({"q_BN_true": np.ones((3, 4))}, "`q_BN_true` must be of length 1: row 0"),
]


@pytest.mark.parametrize(("changes", "message"), BAD_CHANNELS)
def test_bad_channel(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        channel(**changes)


@pytest.mark.parametrize(("changes", "message"), BAD_RECORDS)
def test_bad_record(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        record(**changes)


def test_unknown_channel() -> None:
    with pytest.raises(InputError, match="it has sun, mag"):
        record().channel("star")
