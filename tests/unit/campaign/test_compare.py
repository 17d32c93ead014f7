"""Two runs side by side: the same bits first, then what chance explains and what it does not."""

import dataclasses
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from optsat.campaign.compare import Comparison, compare_runs
from optsat.campaign.effect import Effect
from optsat.campaign.finished_run import FinishedRun, read_run
from optsat.campaign.runner import run_study
from optsat.campaign.study import Case, Row, Study
from optsat.cli import app
from optsat.commands.study_compare import _words
from optsat.errors import InputError


def _rows(shift: float) -> Callable[[Case, np.random.Generator], Row]:
    def run(case: Case, rng: np.random.Generator) -> Row:
        if case["number"] % 40 == 11 and shift:
            raise InputError("only the second fails")
        common, own = rng.normal(size=2)
        return {
            "group": case["number"] % 3,
            "angle": 5 * common + shift * (0.5 + 0.1 * own),
            "path": np.array([common, shift]),
            "good": bool(common < 0.3 + shift),
            "word": "high" if common > 1 else "low",
            "nothing": float("nan"),
        }

    return run


def _metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    return {
        "mean_angle": float(np.mean([row["angle"] for row in rows])),
        "largest": max(row["angle"] for row in rows),
        "path": float(np.mean([row["path"][0] for row in rows])),
        "rows": float(len(rows)),
    }


def _study(shift: float, **changes: Any) -> Study:
    plain = Study(
        name="shifted",
        title="Shifted",
        cases=lambda count: [{"number": number} for number in range(count)],
        run=_rows(shift),
        metrics=_metrics,
        claims=lambda metrics: [],
        default_cases=300,
    )
    return dataclasses.replace(plain, **changes)


def _run(folder: Path, shift: float, cases: int = 300, seed: int = 0) -> FinishedRun:
    run_study(_study(shift), cases, seed, out=folder)
    return read_run(folder)


def _effect(found: Comparison, what: str, of: str) -> Effect:
    (effect,) = [effect for effect in found.effects if (effect.what, effect.of) == (what, of)]
    return effect


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[FinishedRun, FinishedRun]:
    folder = tmp_path_factory.mktemp("pair")
    return _run(folder / "a", 0.0), _run(folder / "b", 1.0)


def test_the_same_run_is_the_same_bits(tmp_path: Path) -> None:
    found = compare_runs(_run(tmp_path / "a", 0.0), _run(tmp_path / "b", 0.0))
    assert found.same_bits == {"result.nc": True, "summary.csv": True}
    assert found.effects == ()
    assert found.identical == ("group", "angle", "good", "word", "nothing")
    assert found.arrays == {"path": 0.0}


def test_the_same_values_in_files_of_other_versions(tmp_path: Path) -> None:
    a, b = _run(tmp_path / "a", 0.0), _run(tmp_path / "b", 0.0)
    resealed = dataclasses.replace(b, digests={**b.digests, "result.nc": {"bytes": 1, "sha256": "0"}})
    found = compare_runs(a, resealed)
    assert found.same_bits == {"result.nc": False, "summary.csv": True}
    assert found.same_content
    assert "The same values to the bit in every case" in "\n".join(_words((a, resealed), found))


def test_mixed_machines_and_other_arithmetic_are_said(pair: tuple[FinishedRun, FinishedRun]) -> None:
    a, b = pair
    found = compare_runs(a, dataclasses.replace(b, numerics=(*b.numerics, "f" * 16)))
    assert (found.mixed, found.same_arithmetic, found.same_content) == (("B",), False, False)
    assert "Mixed machines computed B" in "\n".join(_words(pair, found))
    found = compare_runs(a, dataclasses.replace(b, numerics=("f" * 16,)))
    assert (found.mixed, found.same_arithmetic) == ((), False)
    assert "A and B were computed with other last bits" in "\n".join(_words(pair, found))


def test_pairs_find_what_samples_do_not(pair: tuple[FinishedRun, FinishedRun], tmp_path: Path) -> None:
    found = compare_runs(*pair, _study(1.0))
    assert found.pairing == ""
    assert found.identical == ("group", "word", "nothing")
    assert found.arrays == {"path": 1.0}
    mean = _effect(found, "mean", "angle")
    assert mean.interval is not None
    assert mean.interval.low == pytest.approx(0.5, abs=0.04)
    assert mean.interval.high - mean.interval.low == pytest.approx(2 * 1.96 * 0.1 / np.sqrt(292), rel=0.15)
    assert mean.significant
    assert (mean.by, mean.cases_a, mean.cases_b) == ("bootstrap, BCa", 292, 292)
    other = compare_runs(pair[0], _run(tmp_path / "other", 1.0, seed=1))
    assert other.pairing == "seed differs"
    unpaired = _effect(other, "mean", "angle")
    assert unpaired.interval is not None
    assert unpaired.interval.high - unpaired.interval.low > 1
    assert not unpaired.significant
    assert other.identical == ()


def test_rates_failures_and_metrics(pair: tuple[FinishedRun, FinishedRun]) -> None:
    found = compare_runs(*pair, _study(1.0))
    failed = _effect(found, "rate", "cases that failed")
    assert (failed.a, failed.b) == (0.0, 8 / 300)
    good = _effect(found, "rate", "good")
    assert good.by == "Newcombe, McNemar"
    assert good.significant
    assert good.b > good.a
    mean = _effect(found, "metric", "mean_angle")
    assert mean.interval is not None
    assert mean.significant
    largest = _effect(found, "metric", "largest")
    assert (largest.interval, largest.by, largest.significant) == (None, "an extreme of the cases", False)
    # by the same draws of the cases, the interval of the metric is about that of the column's mean
    column = _effect(found, "mean", "angle").interval
    assert column is not None
    assert mean.interval.high - mean.interval.low == pytest.approx(column.high - column.low, rel=0.35)


def test_metrics_are_not_judged_without_their_study(pair: tuple[FinishedRun, FinishedRun], tmp_path: Path) -> None:
    def by(study: Study | None, runs: tuple[FinishedRun, FinishedRun] = pair) -> str:
        effect = _effect(compare_runs(*runs, study), "metric", "mean_angle")
        assert effect.interval is None
        return effect.by

    assert by(None) == "the study is not here"
    assert by(_study(1.0, metrics=lambda rows: {"mean_angle": 0.0})) == "the study of today gives other metrics"
    assert by(_study(1.0), (_run(tmp_path / "a", 0.0, 2001), pair[1])) == "more than 2000 cases"


def test_different_numbers_of_cases_are_not_paired(pair: tuple[FinishedRun, FinishedRun], tmp_path: Path) -> None:
    found = compare_runs(pair[0], _run(tmp_path / "short", 1.0, cases=120))
    assert found.pairing == "cases differ"
    assert _effect(found, "mean", "angle").by == "Welch's t"
    assert _effect(found, "median", "angle").by == "bootstrap, percentiles"
    assert _effect(found, "rate", "good").by == "Newcombe, Fisher"
    assert _effect(found, "mean", "nothing").by == "too few cases"


def test_a_comparison_is_the_same_each_time(pair: tuple[FinishedRun, FinishedRun]) -> None:
    first, again = compare_runs(*pair, _study(1.0)), compare_runs(*pair, _study(1.0))
    assert [e for e in first.effects if e.of != "nothing"] == [e for e in again.effects if e.of != "nothing"]


def test_large_runs_are_judged_quickly_by_student(pair: tuple[FinishedRun, FinishedRun]) -> None:
    generator = np.random.default_rng(1)
    columns = {"case": np.arange(30_000), "x": generator.normal(size=30_000)}
    many = dataclasses.replace(pair[0], columns=columns, metrics={}, digests={})
    moved = dataclasses.replace(
        many, columns={**columns, "x": columns["x"] + 0.1 + 0.1 * generator.normal(size=30_000)}
    )
    found = compare_runs(many, moved)
    assert _effect(found, "mean", "x").by == "Student's t"
    for what in ("mean", "median", "95 % quantile"):
        effect = _effect(found, what, "x")
        assert effect.interval is not None
        assert effect.interval.low < 0.1 < effect.interval.high
        assert effect.significant


def test_by_chance_hardly_anything_is_found(tmp_path: Path) -> None:
    """Of forty pairs of runs that differ by their seed only, adjusted p values call few different."""
    runs = [_run(tmp_path / str(seed), 0.0, cases=60, seed=seed) for seed in range(9)]
    found = [compare_runs(a, b) for k, a in enumerate(runs) for b in runs[k + 1 :]]
    assert sum(any(effect.significant for effect in each.effects) for each in found) <= 5


def _compare(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["study", "compare", *map(str, arguments)], prog_name="optsat")


def test_the_command_in_words(pair: tuple[FinishedRun, FinishedRun], tmp_path: Path) -> None:
    a, b = (run.path for run in pair)
    result = _compare(a, b)
    assert result.exit_code == 0
    for says in (
        *("Not the same bits: result.nc, summary.csv differ.", "Cases are paired", "B is larger (bootstrap, BCa)"),
        *("The same in every case: group, word, nothing.", "Largest difference in path: 1.", "not judged"),
        *("are more than chance", "cases that failed, A: none in 300 cases, so below 0.0099."),
    ):
        assert says in result.stdout
    assert _compare(a, b, "--check").exit_code == 1
    same = _run(tmp_path / "same", 0.0)
    result = _compare(a, same.path, "--check")
    assert result.exit_code == 0
    assert "The same bits: result.nc, summary.csv. There is nothing to compare." in result.stdout


def test_the_command_in_json(pair: tuple[FinishedRun, FinishedRun]) -> None:
    document = json.loads(_compare(*(run.path for run in pair), "--json").stdout)
    assert document["paired"] is True
    assert document["same_bits"] == {"result.nc": False, "summary.csv": False}
    (mean,) = [e for e in document["effects"] if (e["what"], e["of"]) == ("mean", "angle")]
    assert mean["interval"][0] < mean["difference"] < mean["interval"][1]
    assert mean["significant"] is True


def test_different_studies_are_refused(pair: tuple[FinishedRun, FinishedRun]) -> None:
    other = dataclasses.replace(pair[1], identity=dataclasses.replace(pair[1].identity, study="other"))
    with pytest.raises(InputError, match=r"a run of shifted, .* of other"):
        compare_runs(pair[0], other)
