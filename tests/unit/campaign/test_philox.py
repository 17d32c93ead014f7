"""Philox words: NumPy's own bits for every cell, whatever cells come along, and draws that look independent."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from optsat.campaign.philox import normals, philox_words, uniforms
from optsat.campaign.seeds import campaign_key, case_generator
from optsat.errors import InputError

KEYS = st.integers(0, 2**64 - 1)
CELLS = st.lists(st.integers(0, 2**63 - 1), min_size=1, max_size=5)


@given(KEYS, CELLS, st.integers(0, 13), st.integers(0, 3))
def test_words_and_uniforms_are_numpys_own(key: int, cells: list[int], count: int, stream: int) -> None:
    words = philox_words(key, np.array(cells), count, stream)
    assert words.shape == (len(cells), count)
    for row, cell in zip(words, cells, strict=True):
        np.testing.assert_array_equal(row, case_generator(key, cell, stream).bit_generator.random_raw(count))
        np.testing.assert_array_equal(uniforms(row), case_generator(key, cell, stream).random(count))


def test_golden_words() -> None:
    """The words of three cells of seed 7: they may never change, or results of old campaigns would."""
    words = philox_words(campaign_key("golden", 7), np.array([0, 1, 2**40]), 1)
    assert [f"{word:016x}" for word in words[:, 0]] == GOLDEN


GOLDEN: list[str] = ["92d4ff46a54e7a30", "7a3ca0c70429c33b", "0556c975bfa9cc9a"]


def test_neighbouring_cells_are_independent() -> None:
    x = uniforms(philox_words(campaign_key("statistics", 0), np.arange(200_000), 1))[:, 0]
    assert stats.kstest(x, "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(x[:-1], x[1:])[0, 1]) * np.sqrt(len(x)) < 4.0
    pairs = np.histogram2d(x[::2], x[1::2], bins=32, range=[[0, 1], [0, 1]])[0]
    assert stats.chisquare(pairs.ravel()).pvalue > 1e-3


def test_neighbouring_seeds_share_no_word() -> None:
    words = [philox_words(campaign_key("statistics", seed), np.arange(5000), 2).ravel() for seed in (7, 8)]
    assert len(np.unique(np.concatenate(words))) == 20_000


def test_normals_are_normal_and_finite_at_the_ends() -> None:
    x = normals(philox_words(1, np.arange(200_000), 1))[:, 0]
    assert stats.kstest(x, "norm").pvalue > 1e-3
    ends = normals(np.array([0, 2**64 - 1], dtype=np.uint64))
    assert np.all(np.isfinite(ends))
    assert ends[0] == pytest.approx(-ends[1], rel=1e-9)


@pytest.mark.parametrize(
    "arguments", [(-1, [0], 1, 0), (2**64, [0], 1, 0), (0, [-1], 1, 0), (0, [0], -1, 0), (0, [0], 1, -1)]
)
def test_what_has_no_words(arguments: Any) -> None:
    key, cells, count, stream = arguments
    with pytest.raises(InputError, match="must be >= 0"):
        philox_words(key, np.array(cells), count, stream)
