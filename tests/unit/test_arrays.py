"""Checked conversions: what comes out is float64, finite, a copy, and of length one."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from optsat.arrays import cross_rows, finite_array, normalise_rows, pair_weights
from optsat.errors import InputError

bounded = settings(derandomize=True, max_examples=60)


def test_numbers_of_any_kind_become_float64_copies() -> None:
    source = np.eye(3)
    for value in (
        source,
        source.tolist(),
        source.astype(np.float32),
        source.astype(np.int8),
        np.asfortranarray(source),
    ):
        array = finite_array("a", value, (None, 3))
        assert array.dtype == np.float64
        np.testing.assert_array_equal(array, np.eye(3))
    finite_array("a", source)[0, 0] = 7.0
    assert source[0, 0] == 1.0


@pytest.mark.parametrize(
    ("value", "shape", "expected"),
    [
        (np.nan, None, "the value holds nan"),
        ([1.0, np.inf], None, "index 1 holds inf"),
        (np.full((2, 2), np.nan), None, r"row 0 holds nan \(4 such entries in all\)"),
        ([1.0], (3,), r"must have shape \(3,\) \[m\], got \(1,\)"),
        (
            np.zeros((3, 2)),
            (None, 3),
            r"must have shape \(m, 3\) \[m\], got \(3, 2\). Did you pass columns\? Use `.T`.",
        ),
        (np.zeros(3), (None, None, 3), r"must have shape \(n, m, 3\)"),
        (np.datetime64("2020-01-01"), None, "must hold numbers"),
        (b"x", None, "must hold numbers"),
        (object(), None, "must hold numbers"),
    ],
)
def test_refusals(value: object, shape: tuple[int | None, ...] | None, expected: str) -> None:
    with pytest.raises(InputError, match=f"`a`.*{expected}"):
        finite_array("a", value, shape, "m")  # type: ignore[arg-type] # the user's mistake


@bounded
@given(st.lists(st.floats(-1, 1), min_size=3, max_size=3), st.floats(-299, 299))
def test_rows_of_any_length_become_unit(direction: list[float], decade: float) -> None:
    vector = np.array([direction])
    if np.max(np.abs(vector)) < 1e-3:
        return
    unit = normalise_rows("a", vector * 10.0**decade)
    assert np.linalg.norm(unit) == pytest.approx(1.0, abs=4e-16)
    np.testing.assert_allclose(unit, vector / np.linalg.norm(vector), atol=1e-13)


@bounded
@given(st.lists(st.floats(0, 1), min_size=1, max_size=6), st.integers(-1000, 1000))
def test_weights_of_any_scale_sum_to_one(shares: list[float], power: int) -> None:
    shares[0] = 1.0
    weights = pair_weights("w", np.ldexp(shares, power), len(shares))
    assert weights.sum() == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(weights, np.array(shares) / np.sum(shares), atol=1e-15 if power > -900 else 1e-6)


def test_no_weights_are_equal_weights() -> None:
    np.testing.assert_array_equal(pair_weights("w", None, 4), np.full(4, 0.25))


def test_cross_rows_is_the_cross_product() -> None:
    a, b = np.random.default_rng(0).standard_normal((2, 5, 7, 3))
    np.testing.assert_allclose(cross_rows(a, b), np.cross(a, b), atol=1e-15)
    np.testing.assert_allclose(cross_rows(a, b[0, 0]), np.cross(a, b[0, 0]), atol=1e-15)
