"""Each study in a short version: it runs, workers change nothing, its claims are judged as at full length."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from optsat.attitude.admissible_set import AdmissibleSet
from optsat.campaign.claim import Verdict
from optsat.campaign.result import StudyResult
from optsat.campaign.runner import run_study
from optsat.campaign.study import Study
from optsat.determine import certify_attitude
from optsat.solvers.scaled_semidefinite import pivot_chart, pivot_weights
from optsat.studies import (
    attitude_depot,
    broad_trial,
    certified_attitude_orbit,
    certified_attitude_soundness,
    certified_attitude_tightness,
    certified_attitude_timing,
)


def _verdicts(result: StudyResult) -> dict[str, Verdict]:
    assert not result.failures
    return {claim.id: claim.verdict for claim in result.claims}


def _drawn(study: Study, result: StudyResult, path: Path) -> str:
    assert study.figure is not None
    study.figure(result.rows, path)
    return path.read_text(encoding="utf-8")


def test_orbit_over_three_minutes() -> None:
    study = certified_attitude_orbit
    rows = [
        {**study.run({"julian_date": day, "duration_s": 180.0}, np.random.default_rng(seed)), "case": seed}
        for seed, day in enumerate(study.JULIAN_DATES)
    ]
    figures = study.metrics(rows)
    verdicts = {claim.id: claim.verdict for claim in study.claims(figures)}
    assert verdicts["memoryless-gain"] is Verdict.NOT_REPRODUCED
    assert verdicts["windowed-gain"] is Verdict.BEATEN
    assert verdicts["no-violation"] is Verdict.HOLDS
    assert figures["epoch1_certified_deg"] <= figures["epoch1_q_equal_deg"]
    assert figures["epoch1_certified_deg"] == pytest.approx(figures["epoch1_q_weighted_deg"], rel=0.01)


def test_orbit_figure_is_drawn(tmp_path: Path) -> None:
    study = certified_attitude_orbit
    case = {"julian_date": study.JULIAN_DATES[0], "duration_s": 70.0}
    rows = [{**study.run(case, np.random.default_rng(0)), "case": 0}]
    study.figure(rows, tmp_path / "orbit.svg")
    assert "svg" in (tmp_path / "orbit.svg").read_text(encoding="utf-8")[:400]


def test_soundness_holds_and_workers_change_nothing() -> None:
    study = certified_attitude_soundness.study
    alone = run_study(study, 2, seed=5)
    assert set(_verdicts(alone).values()) == {Verdict.HOLDS}
    assert alone.metrics["many_vector_ratio"] > 0.9, "errors on the boundary come close to the bound"
    assert alone.metrics["pairs_above"] > 100
    assert run_study(study, 2, seed=5, workers=2).rows == alone.rows


def test_tightness_on_one_round(tmp_path: Path) -> None:
    result = run_study(certified_attitude_tightness.study, 10, seed=1)
    verdicts = _verdicts(result)
    assert verdicts["two-vectors"] is Verdict.HOLDS
    assert verdicts["verified"] is Verdict.HOLDS
    for row in result.rows:
        assert row["order_1"] >= row["refined"] >= 1 - 1e-6
    assert "brute-force radius" in _drawn(certified_attitude_tightness.study, result, tmp_path / "tightness.svg")


def test_timing_solves_the_same_programme_as_its_peer() -> None:
    study = certified_attitude_timing
    (row,) = run_study(study.study, 1, seed=2).rows
    assert all(row[name] > 0 for name in row if "_over_" in name)
    b, r, eps = (part[0] for part in study._poses(np.random.default_rng(3), 1, 4))
    known = AdmissibleSet(b, r, eps)
    chart = pivot_chart(known, pivot_weights(known))
    theirs = np.array([float(np.squeeze(dual)) for dual in study._cvxpy_as_written(b, r, eps)]) / chart.size
    ours = certify_attitude(b, r, eps).weights
    assert theirs / theirs.sum() == pytest.approx(ours, abs=1e-4)


def test_depot_has_no_silent_wrong_answer(shared_data: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPTSAT_DATA", str(shared_data("depot").parent))
    result = run_study(attitude_depot.study)
    assert set(_verdicts(result).values()) == {Verdict.HOLDS}
    assert result.metrics["davenport_right"] == result.metrics["svd_right"] == 55
    assert result.metrics["certificate_given_right"] == result.metrics["certificate_best_right"] == 55


def test_depot_that_is_absent_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPTSAT_DATA", str(tmp_path))
    attitude_depot._problems.cache_clear()
    result = run_study(attitude_depot.study, 1)
    attitude_depot._problems.cache_clear()
    assert "OPTSAT_DATA" in result.failures[0].message


def test_broad_trial_lies_within_its_bounds(
    shared_data: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("OPTSAT_DATA", str(shared_data(f"broad/{broad_trial.TRIAL}").parents[1]))
    monkeypatch.setattr(broad_trial, "EVERY", 57 * 20)
    broad_trial._series.cache_clear()
    result = run_study(broad_trial.study, 49)
    broad_trial._series.cache_clear()
    assert set(_verdicts(result).values()) == {Verdict.HOLDS}
    assert 2 < result.metrics["plain_median_deg"] < 4.5
    assert "BROAD" in _drawn(broad_trial.study, result, tmp_path / "broad.svg")
