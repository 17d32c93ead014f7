"""The interval-Wahba paper in short: its printed numbers, each study's claims, and that no method can see the truth."""

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import davenport_matrix, rotation_matrix
from optsat.campaign.claim import Verdict
from optsat.campaign.interleaved import InterleavedTimes
from optsat.campaign.runner import run_study
from optsat.campaign.study import Study
from optsat.models.draws import rotations
from optsat.simulation.orbit_scenario import OrbitScenario
from optsat.solvers.nsga2 import Nsga2, pymoo_is_installed
from optsat.studies import (
    _interval_scenario,
    interval_wahba_leak_audit,
    interval_wahba_orbit,
    interval_wahba_table1,
    interval_wahba_timing,
    worst_case_wahba_boxes,
)

needs_pymoo = pytest.mark.skipif(not pymoo_is_installed(), reason="pymoo is not installed (extra `peers`)")


def _drawn(study: Study, rows: Any, path: Path) -> None:
    assert study.figure is not None
    study.figure(rows, path)
    assert "</svg>" in path.read_text(encoding="utf-8")


def test_printed_quaternion_is_the_q_methods_scalar_first_and_negated() -> None:
    raw = davenport_matrix(_interval_scenario.PRINTED_B_B, _interval_scenario.PRINTED_R_N, np.array([0.5, 0.5]))
    np.testing.assert_allclose(np.linalg.eigvalsh(raw), [-0.99657533, -0.90865114, 0.90865114, 0.99657533], atol=5e-9)
    exact = _interval_scenario.exact_attitude()
    np.testing.assert_allclose(exact, [-0.07073959, 0.21220963, 0.01253971, 0.97457978], atol=5e-9)
    np.testing.assert_allclose(-np.roll(exact, 1), _interval_scenario.PRINTED_Q, atol=2e-4)


def test_printed_vectors_contradict_each_other_by_eight_degrees() -> None:
    b, r = (
        _interval_scenario.unit(_interval_scenario.PRINTED_B_B),
        _interval_scenario.unit(_interval_scenario.PRINTED_R_N),
    )
    between = np.degrees(np.arccos([b[0] @ b[1], r[0] @ r[1]]))
    np.testing.assert_allclose(between, [28.78, 20.39], atol=0.01)
    A = rotation_matrix(_interval_scenario.exact_attitude())
    np.testing.assert_allclose(np.degrees(np.arccos(np.sum(b * (r @ A.T), axis=1))), 4.19, atol=0.01)
    consistent = _interval_scenario.consistent_b_B()
    np.testing.assert_allclose(
        _interval_scenario.q_method(consistent, r), _interval_scenario.exact_attitude(), atol=1e-12
    )


def test_table_1_over_a_few_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interval_wahba_table1, "SEARCH_DRAWS", 0)
    monkeypatch.setattr(interval_wahba_table1, "MIN_MAX_DRAWS", 8)
    result = run_study(interval_wahba_table1.study, 400, seed=0)
    verdicts = {claim.id: claim.verdict for claim in result.claims}
    assert not result.failures
    assert verdicts["quaternion"] is verdicts["degeneracy"] is verdicts["q-mean-bar"] is Verdict.HOLDS
    assert verdicts["q-mean"] is Verdict.REPRODUCED
    assert verdicts["min-max-mean"] is verdicts["min-max-variance"] is Verdict.NOT_REPRODUCED
    assert "nsga2-mean" not in verdicts
    assert result.metrics["min_max_draws"] == result.metrics["min_max_signed_draws"] == 8
    assert result.metrics["min_max_raw_draws"] == 8 - result.metrics["box_misses_sphere"]
    _drawn(interval_wahba_table1.study, result.rows, tmp_path / "table.svg")


def test_a_draw_that_was_not_solved_fails_the_bar_and_is_not_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    def unsolved(boxes: object, *, absolute: bool = True, search_fraction: float | None = None) -> Array | None:
        return _interval_scenario.exact_attitude() if absolute else None

    monkeypatch.setattr(_interval_scenario, "min_max", unsolved)
    row = interval_wahba_table1.run({"optimise": True, "search": False}, np.random.default_rng(0))
    figures = interval_wahba_table1.metrics([{**row, "min_max_from_q_deg": 0.0}])
    assert figures["min_max_not_solved"] == 1
    verdicts = {claim.id: claim.verdict for claim in interval_wahba_table1.claims(figures)}
    assert verdicts["degeneracy"] is Verdict.FAILS


def test_leak_audit_over_a_few_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(interval_wahba_leak_audit, "SEARCH_DRAWS", 0)
    result = run_study(interval_wahba_leak_audit.study, 12, seed=0)
    assert not result.failures
    figures = result.metrics
    assert figures["LEAK_range_mean_deg"] < 3.5 < 8 < figures["honest_range_mean_deg"]
    assert figures["LEAK_random_mean_deg"] < 3.5
    assert figures["LEAK_middles_mean_deg"] < 1e-5
    verdicts = {claim.id: claim.verdict for claim in result.claims}
    assert verdicts["honest-min-max-mean"] is Verdict.NOT_REPRODUCED
    assert all("LEAK" in claim.says for claim in result.claims if claim.id.startswith("LEAK"))
    _drawn(interval_wahba_leak_audit.study, result.rows, tmp_path / "audit.svg")


@needs_pymoo
def test_the_genetic_algorithm_does_not_reach_the_printed_figure(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for module in (interval_wahba_table1, interval_wahba_leak_audit):
        monkeypatch.setattr(module, "Nsga2", functools.partial(Nsga2, 30, 20))
    table = run_study(interval_wahba_table1.study, 2, seed=0)
    audit = run_study(interval_wahba_leak_audit.study, 2, seed=0)
    assert not table.failures
    assert not audit.failures
    assert {claim.id: claim.verdict for claim in table.claims}["nsga2-mean"] is Verdict.NOT_REPRODUCED
    assert audit.metrics["LEAK_nsga2_choice_mean_deg"] <= audit.metrics["honest_nsga2_mean_deg"]
    assert audit.metrics["LEAK_nsga2_double_mean_deg"] < 4
    _drawn(interval_wahba_leak_audit.study, audit.rows, tmp_path / "audit.svg")


def test_orbit_over_two_minutes(tmp_path: Path) -> None:
    study = interval_wahba_orbit.study
    rows: list[Mapping[str, Any]] = [
        {**study.run({**case, "duration_s": 120.0}, np.random.default_rng(k)), "case": k}
        for k, case in enumerate(interval_wahba_orbit.cases(9))
        if k in (0, 4, 8)
    ]
    figures = study.metrics(rows)
    verdicts = {claim.id: claim.verdict for claim in study.claims(figures)}
    assert verdicts == {
        "min-max-gain": Verdict.NOT_REPRODUCED,
        "certified-gain": Verdict.NOT_REPRODUCED,
        "min-max-is-q": Verdict.HOLDS,
        "no-violation": Verdict.HOLDS,
    }
    assert {"lvlh_cap_q_deg", "lvlh_angle_q_deg", "inertial_cap_q_deg"} <= set(figures)
    assert figures["certified_deg"] < figures["bound_deg"]
    _drawn(study, rows, tmp_path / "orbit.svg")


def test_worst_case_over_a_few_boxes(tmp_path: Path) -> None:
    result = run_study(worst_case_wahba_boxes.study, 12, seed=0)
    assert not result.failures
    assert {claim.verdict for claim in result.claims} == {Verdict.HOLDS}
    _drawn(worst_case_wahba_boxes.study, result.rows, tmp_path / "boxes.svg")


@needs_pymoo
def test_every_timed_alternative_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    def once(alternatives: Mapping[str, Callable[[], object]], rounds: int) -> InterleavedTimes:
        for function in alternatives.values():
            function()
        return InterleavedTimes({name: np.ones(1) for name in alternatives})

    monkeypatch.setattr(interval_wahba_timing, "time_interleaved", once)
    result = run_study(interval_wahba_timing.study, 1)
    verdicts = {claim.id: claim.verdict for claim in result.claims}
    assert verdicts["proven"] is Verdict.HOLDS
    assert verdicts["min-max"] is verdicts["certify"] is Verdict.FAILS


def test_no_public_call_takes_the_true_attitude() -> None:
    # a record may carry the truth beside the measurements, to be compared with afterwards
    carriers = {"Record"}
    for name in set(optsat.__all__) - carriers:
        called = getattr(optsat, name)
        if callable(called) and not (inspect.isclass(called) and issubclass(called, Exception)):
            for parameter in inspect.signature(called).parameters:
                assert not {"true", "truth"} & set(parameter.split("_")), f"{name} takes {parameter}"
    audit = interval_wahba_leak_audit
    own = {name for name, value in vars(audit).items() if getattr(value, "__module__", "") == audit.__name__}
    assert {name for name in own if not name.startswith("_")} == {"cases", "run", "metrics", "claims", "figure"}
    for name in ("q_method", "min_max"):
        parameters = set(inspect.signature(getattr(_interval_scenario, name)).parameters)
        assert parameters <= {"b_B", "r_N", "boxes", "absolute", "search_fraction"}


def test_another_truth_beside_the_same_data_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    record = OrbitScenario(duration=20.0).simulate(rng)
    assert record.q_BN_true is not None
    other = replace(record, q_BN_true=rotations(rng, len(record.t)))
    first, second = optsat.certify_record(record), optsat.certify_record(other)
    np.testing.assert_array_equal(first.q_BN, second.q_BN)
    np.testing.assert_array_equal(first.bound_rad, second.bound_rad)


def test_methods_give_the_same_wherever_the_errors_are_counted_from(monkeypatch: pytest.MonkeyPatch) -> None:
    case = {"optimise": True, "search": False}
    seen: list[Array] = []

    def watched(q_BN: Array | None, reference_BN: Array) -> float:
        seen.append(np.full(4, np.nan) if q_BN is None else q_BN)
        return 0.0

    monkeypatch.setattr(interval_wahba_table1, "_apart_deg", watched)
    interval_wahba_table1.run(case, np.random.default_rng(3))
    first, seen = seen, []
    # the consistent draw is made from the exact attitude, so it is the only row that may move
    moved = quaternion.compose(np.array([0, 0, np.sin(0.3), np.cos(0.3)]), _interval_scenario.exact_attitude())
    consistent = _interval_scenario.consistent_b_B()
    monkeypatch.setattr(_interval_scenario, "consistent_b_B", lambda: consistent)
    monkeypatch.setattr(_interval_scenario, "exact_attitude", lambda: moved)
    interval_wahba_table1.run(case, np.random.default_rng(3))
    np.testing.assert_array_equal(first, seen)
