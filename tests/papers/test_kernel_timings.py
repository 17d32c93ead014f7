"""The timing studies of the kernels without the time: every alternative runs and answers as its peer does."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from optsat.campaign.catalogue import load_study
from optsat.campaign.designs import Layout
from optsat.campaign.interleaved import InterleavedTimes

STUDIES = [f"kernels-{name}-timing" for name in ("certified", "filter", "rigid-body", "wahba")]


def _once(alternatives: Mapping[str, Callable[[], object]], rounds: int = 1) -> InterleavedTimes:
    for function in alternatives.values():
        function()
    return InterleavedTimes({name: np.ones(1) for name in alternatives})


@pytest.mark.parametrize("name", STUDIES)
def test_every_alternative_runs_and_agrees(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    study = load_study(name)
    module = study.run.__module__
    monkeypatch.setattr(f"{module}.time_interleaved", _once)
    if name != "kernels-certified-timing":
        monkeypatch.setattr(f"{module}.measured_peak", lambda: 1e10)
    (case,) = Layout.of(study.name, study.cases, 1, 0).cases(range(1))
    row: dict[str, Any] = {"case": 0, **study.run(case, np.random.default_rng(0))}
    figures = study.metrics([row])
    assert all(np.isfinite(value) for value in figures.values())
    for figure, value in figures.items():
        if "difference" in figure:
            assert value < 1e-8
    if name == "kernels-certified-timing":
        assert (row["answered"], row["within_1_001"], row["violations"]) == (row["problems"], row["problems"], 0)
    ratios = [claim for claim in study.claims(figures) if "ratio >= " in claim.says]
    # every ratio of this clock is one, or the size of the batch: a call alone meets no bar
    assert all(claim.verdict.value == "FAILS" for claim in ratios if claim.measured == 1.0)
