"""`optsat bench`: lists the timing studies, runs a group or one of them, and says which names there are."""

import json
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from typer.testing import CliRunner

from optsat.campaign import catalogue
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.cli import app


def toy(name: str, ratio: float) -> Study:
    def cases(count: int) -> Sequence[Case]:
        return [{}] * count

    def run(case: Case, rng: np.random.Generator) -> Row:
        return {"ratio": ratio}

    def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
        return {"ratio": float(np.median([row["ratio"] for row in rows]))}

    def claims(figures: Mapping[str, float]) -> Sequence[Claim]:
        return [judge_bar("fast", "ten times", measured=figures["ratio"], holds=figures["ratio"] >= 10)]

    return Study(name, f"Title of {name}", cases, run, metrics, claims, default_cases=3)


@pytest.fixture(autouse=True)
def toys(monkeypatch: pytest.MonkeyPatch) -> None:
    studies = {name: toy(name, ratio) for name, ratio in [("toys-a-timing", 12.0), ("toys-b-timing", 40.0)]}
    studies["slow-timing"] = toy("slow-timing", 2.0)
    monkeypatch.setattr(
        catalogue, "list_studies", lambda: {**{n: f"About {n}" for n in studies}, "toys-c": "no timing"}
    )
    monkeypatch.setattr(catalogue, "load_study", lambda name: studies[name])


def bench(*arguments: str, expected: int = 0) -> str:
    done = CliRunner().invoke(app, ["bench", *arguments])
    assert done.exit_code == expected, done.output
    return done.output


def test_without_a_name_the_benchmarks_are_listed() -> None:
    lines = bench().splitlines()
    assert [line.split()[:2] for line in lines] == [
        *(["toys", "toys-a-timing"], ["toys", "toys-b-timing"], ["slow", "slow-timing"]),
    ]
    assert [row["group"] for row in json.loads(bench("--json"))] == ["toys", "toys", "slow"]


def test_a_group_runs_all_its_studies() -> None:
    output = bench("toys")
    assert "About toys-a-timing" in output
    assert output.count("HOLDS") == 2
    assert "3 cases" in output
    results = json.loads(bench("toys", "--cases", "2", "--json"))
    assert [result["study"] for result in results] == ["toys-a-timing", "toys-b-timing"]
    assert results[1]["metrics"] == {"ratio": 40.0}


def test_a_bar_that_fails_is_a_finding() -> None:
    assert "FAILS" in bench("slow-timing", expected=1)


def test_an_unknown_name_offers_the_nearest() -> None:
    assert "no benchmark `toy`. Did you mean `toys`?" in bench("toy", expected=2)
