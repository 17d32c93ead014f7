"""Every case once, the same rows for any number of workers, failures kept."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
import toy_study

from optsat.campaign.claim import Claim, Verdict, judge_bar
from optsat.campaign.runner import run_study
from optsat.campaign.seeds import campaign_key, case_generator
from optsat.campaign.study import Case, Study
from optsat.campaign.threads import THREAD_VARIABLES, one_thread_each
from optsat.errors import InputError


def test_rows_hold_the_draws_of_their_place() -> None:
    result = run_study(toy_study.study, seed=5)
    key = campaign_key("toy-study", 5)
    assert [row["case"] for row in result.rows] == [0, 1, 2]
    assert [row["draw"] for row in result.rows] == [case_generator(key, cell).random() for cell in range(3)]
    assert result.metrics["mean_draw"] == np.mean([row["draw"] for row in result.rows])
    assert result.passed


def test_scalars_of_numpy_become_plain() -> None:
    row = run_study(toy_study.study, cases=1).rows[0]
    assert [type(row[name]) for name in ("case", "draw", "shifted", "even")] == [int, float, float, bool]


def test_a_failed_case_is_kept_with_its_message() -> None:
    result = run_study(toy_study.study, cases=6)
    assert [row["case"] for row in result.rows] == [0, 1, 2, 4, 5]
    (failure,) = result.failures
    assert (failure.case, failure.error, failure.message) == (3, "InputError", "the offset is unlucky")
    assert not result.passed
    assert result.summary()["failures"] == 1


def test_more_cases_leave_the_first_ones_alone() -> None:
    few, many = run_study(toy_study.study, cases=3), run_study(toy_study.study, cases=5)
    assert many.rows[:3] == few.rows


def test_worker_processes_change_nothing() -> None:
    seen: list[tuple[int, int]] = []
    serial = run_study(toy_study.study, cases=40, seed=1)
    spread = run_study(toy_study.study, cases=40, seed=1, workers=2, progress=lambda *at: seen.append(at))
    assert serial.failures
    # a dictionary compares NaN by identity, which does not survive a process
    assert dataclasses.replace(spread, metrics={}) == dataclasses.replace(serial, metrics={})
    np.testing.assert_equal(dict(spread.metrics), dict(serial.metrics))
    assert seen == sorted(seen)
    assert seen[-1] == (40, 40)


def test_a_study_that_workers_cannot_import_is_refused() -> None:
    with pytest.raises(InputError, match="toy_study holds another object"):
        run_study(dataclasses.replace(toy_study.study, title="a copy"), workers=2)


@pytest.mark.parametrize("wrong", [{"cases": 0}, {"workers": 0}, {"seed": -1}])
def test_counts_are_checked(wrong: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=f"{next(iter(wrong))}="):
        run_study(toy_study.study, **wrong)


def _variant(**changes: Any) -> Study:
    return dataclasses.replace(toy_study.study, **changes)


def test_a_design_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(InputError, match="laid out 1 cases where 2"):
        run_study(_variant(cases=lambda _count: [{}]), cases=2)


def test_rows_hold_scalars_and_arrays_of_numbers_only() -> None:
    with pytest.raises(InputError, match="case 0 returned `q_BN` of type list"):
        run_study(_variant(run=lambda _case, _rng: {"q_BN": [0.0] * 4}))
    with pytest.raises(InputError, match="case 0 returned `names` of type ndarray"):
        run_study(_variant(run=lambda _case, _rng: {"names": np.array(["a"])}))
    with pytest.raises(InputError, match="`q_BN` must have one shape in all cases"):
        run_study(_variant(run=lambda case, _rng: {"q_BN": np.zeros(1 + int(case["offset"]))}), cases=2, workers=1)


@pytest.mark.parametrize("name", ["case", "status", "failure"])
def test_names_that_the_result_needs_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"returns `{name}`, under which the result keeps"):
        run_study(_variant(run=lambda _case, _rng: {"a": 1.0, name: 0}))
    batch = _variant(run_batch=lambda _cases, draws: {name: np.zeros(draws.cases)})
    with pytest.raises(InputError, match=f"returns `{name}`, under which the result keeps"):
        run_study(batch)


def test_columns_must_agree() -> None:
    def run(case: Case, _rng: np.random.Generator) -> dict[str, float]:
        return {"b" if case["offset"] == 2.0 else "a": 0.0}

    with pytest.raises(InputError, match=r"case 0 returned \['a'\], case 2 returned \['b'\]"):
        run_study(_variant(run=run))


def test_a_mistake_in_the_study_is_not_a_failed_case() -> None:
    def run(case: Case, _rng: np.random.Generator) -> dict[str, float]:
        return {"a": case["misspelt"]}

    with pytest.raises(KeyError, match="misspelt"):
        run_study(_variant(run=run))


def test_without_a_single_row_there_is_nothing_to_claim() -> None:
    def run(_case: Case, _rng: np.random.Generator) -> dict[str, float]:
        raise np.linalg.LinAlgError("singular")

    result = run_study(_variant(run=run))
    assert (result.rows, result.metrics, result.claims, len(result.failures)) == ((), {}, (), 3)


def test_only_a_bar_of_our_own_fails_a_study() -> None:
    def claims(_metrics: Mapping[str, float]) -> Sequence[Claim]:
        return [Claim("paper", "says", 1.0, 2.0, Verdict.NOT_REPRODUCED)]

    assert run_study(_variant(claims=claims)).passed
    assert not run_study(_variant(claims=lambda _m: [judge_bar("bar", "says", measured=1.0, holds=False)])).passed


def test_figures_that_json_lacks_become_none() -> None:
    assert run_study(toy_study.study).summary()["metrics"]["worst"] is None


@pytest.mark.parametrize("name", ["Toy", "toy_study", "toy--study", "", "-toy"])
def test_study_names_are_hyphened_words(name: str) -> None:
    with pytest.raises(InputError, match="lower-case words"):
        _variant(name=name)


def test_a_study_has_at_least_one_case() -> None:
    with pytest.raises(InputError, match="at least 1, got 0"):
        _variant(default_cases=0)


def test_workers_get_one_thread_and_the_caller_keeps_his(monkeypatch: pytest.MonkeyPatch) -> None:
    first, second, _ = THREAD_VARIABLES
    monkeypatch.setenv(first, "7")
    monkeypatch.delenv(second, raising=False)
    with one_thread_each():
        assert {os.environ[name] for name in THREAD_VARIABLES} == {"1"}
    assert os.environ[first] == "7"
    assert second not in os.environ
