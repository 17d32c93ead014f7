"""Draws depend on study, seed and place, and on nothing else."""

import hashlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optsat.campaign.seeds import campaign_key, case_generator
from optsat.errors import InputError

numbers = st.integers(min_value=0, max_value=2**32)


def test_key_is_the_first_eight_bytes_of_the_digest() -> None:
    digest = hashlib.blake2b(b'["toy-study",7]').digest()
    assert campaign_key("toy-study", 7) == int.from_bytes(digest[:8], "little")


def _mulhilo(a: int, b: int) -> tuple[int, int]:
    return (a * b) >> 64, (a * b) & (2**64 - 1)


def _philox4x64(counter: list[int], key: list[int]) -> list[int]:
    # Salmon et al., Parallel random numbers: as easy as 1, 2, 3 (2011), ten rounds
    for _ in range(10):
        high0, low0 = _mulhilo(0xD2E7470EE14C6C93, counter[0])
        high1, low1 = _mulhilo(0xCA5A826395121157, counter[2])
        counter = [high1 ^ counter[1] ^ key[0], low1, high0 ^ counter[3] ^ key[1], low0]
        key = [(key[0] + 0x9E3779B97F4A7C15) % 2**64, (key[1] + 0xBB67AE8584CAA73B) % 2**64]
    return counter


@given(numbers, numbers, st.integers(min_value=0, max_value=9))
def test_words_are_those_of_philox_written_out(key: int, cell: int, stream: int) -> None:
    words = case_generator(key, cell, stream).bit_generator.random_raw(4)
    # NumPy raises the counter before its first block
    assert [int(word) for word in np.asarray(words)] == _philox4x64([1, 0, stream, 0], [key, cell])


@given(numbers, numbers)
def test_neighbours_are_different_streams(seed: int, cell: int) -> None:
    key, next_key = campaign_key("toy-study", seed), campaign_key("toy-study", seed + 1)
    draws = {
        case_generator(key, cell).random(),
        case_generator(key, cell + 1).random(),
        case_generator(next_key, cell).random(),
        case_generator(key, cell, stream=1).random(),
        case_generator(campaign_key("other-study", seed), cell).random(),
    }
    assert len(draws) == 5


@pytest.mark.parametrize(("cell", "stream"), [(-1, 0), (0, -1)])
def test_negative_places_are_refused(cell: int, stream: int) -> None:
    with pytest.raises(InputError, match=f"{cell} and {stream}"):
        case_generator(0, cell, stream)
