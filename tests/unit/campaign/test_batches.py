"""Batches: the bits of single cases, failures found among many, disagreement noticed."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import batch_study
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optsat.campaign import runner
from optsat.campaign.case_runs import run_cases
from optsat.campaign.designs import Columns, Layout
from optsat.campaign.draws import Draws
from optsat.campaign.runner import run_study
from optsat.campaign.seeds import campaign_key, case_generator
from optsat.campaign.study import Study
from optsat.errors import InputError

KEY = campaign_key("batch-study", 3)


@given(st.lists(st.integers(0, 2**40), min_size=1, max_size=4), st.lists(st.integers(0, 9), min_size=1, max_size=4))
def test_draws_of_many_cells_are_those_of_each(cells: list[int], counts: list[int]) -> None:
    many = Draws.of_cells(KEY, np.array(cells))
    each = [Draws.of_case(case_generator(KEY, cell)) for cell in cells]
    for count in counts:
        np.testing.assert_array_equal(many.uniforms(count), np.concatenate([one.uniforms(count) for one in each]))
        np.testing.assert_array_equal(many.normals(count, 2), np.concatenate([one.normals(count, 2) for one in each]))


def test_uniforms_are_those_that_the_generator_of_the_case_gives() -> None:
    draws = Draws.of_cells(KEY, np.array([5]))
    rng = case_generator(KEY, 5)
    np.testing.assert_array_equal(draws.uniforms(2)[0], rng.random(2))
    np.testing.assert_array_equal(draws.uniforms(3, 2)[0], rng.random((3, 2)))


def final_bytes(folder: Path) -> tuple[bytes, ...]:
    return tuple((folder / name).read_bytes() for name in ("result.nc", "summary.csv", "complete.json"))


def test_no_byte_depends_on_how_many_are_computed_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Chunks of one case are single cases; the whole campaign in one chunk is one batch with failures in it."""
    found = []
    for size in (1, 7, 20, 60):
        monkeypatch.setattr(runner, "_chunk_size", lambda *_, size=size: size)
        result = run_study(batch_study.study, seed=3, out=tmp_path / str(size))
        found.append(final_bytes(tmp_path / str(size)))
    assert len(set(found)) == 1
    assert result.failures, "some share is unlucky"
    alone = run_study(dataclasses.replace(batch_study.study, run_batch=None), seed=3)
    for one, other in zip(result.rows, alone.rows, strict=True):
        np.testing.assert_equal(dict(one), dict(other))
    assert result.failures == alone.failures
    monkeypatch.setattr(runner, "_chunk_size", lambda *_: 7)
    run_study(batch_study.study, seed=3, out=tmp_path / "workers", workers=2)
    assert final_bytes(tmp_path / "workers") == found[0]


def test_a_batch_gets_chunks_as_long_as_it_is_fast(tmp_path: Path) -> None:
    layout = Layout.of("batch-study", batch_study.study.cases, 100_000, KEY)
    assert runner._chunk_size(batch_study.study, layout, 1) > 256


def variant(change: Callable[[Columns], Any]) -> Study:
    return dataclasses.replace(
        batch_study.study, run_batch=lambda cases, draws: change(batch_study._run_batch(cases, draws))
    )


def outcomes_of(study: Study) -> Any:
    return run_cases(study, Layout.of(study.name, study.cases, 2, KEY), range(2))


def test_a_batch_that_disagrees_with_a_single_case_is_refused() -> None:
    with pytest.raises(InputError, match=r"`share` of case 0 is .* alone and .* in a batch"):
        outcomes_of(variant(lambda c: {**c, "share": np.nextafter(c["share"], 1)}))
    with pytest.raises(InputError, match="`word` of case 0"):
        outcomes_of(variant(lambda c: {**c, "word": np.full(len(c["word"]), "other")}))
    with pytest.raises(InputError, match="`is_fast` of case 0"):
        outcomes_of(variant(lambda c: {**c, "is_fast": c["is_fast"].astype(int)}))
    with pytest.raises(InputError, match="must return the same columns in the same order"):
        outcomes_of(variant(lambda c: {"share": c["share"]}))


def test_a_case_that_raises_only_alone_is_a_disagreement() -> None:
    def run(_case: object, _rng: object) -> Any:
        raise ValueError("not alone")

    with pytest.raises(InputError, match=r"case 0 ran in a batch, and alone it raises .*not alone"):
        outcomes_of(dataclasses.replace(batch_study.study, run=run))


@pytest.mark.parametrize("wrong", [np.zeros(3), np.float64(0.0), np.zeros(2, dtype=complex)])
def test_columns_of_another_length_or_kind_are_refused(wrong: Any) -> None:
    with pytest.raises(InputError, match="`run_batch` returned `share` of type"):
        outcomes_of(variant(lambda c: {**c, "share": wrong}))
