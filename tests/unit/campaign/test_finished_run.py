"""A complete run read back: all of it, checked, and refused where it does not hold together."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import toy_study

from optsat.campaign.finished_run import read_run
from optsat.campaign.runner import run_study
from optsat.campaign.study import Study
from optsat.errors import InputError, OptsatError


def test_it_is_what_was_run(tmp_path: Path) -> None:
    result = run_study(toy_study.study, cases=5, seed=3, out=tmp_path)
    run = read_run(tmp_path)
    assert (run.identity.study, run.identity.cases, run.identity.seed) == ("toy-study", 5, 3)
    assert (run.title, run.claims, run.failures) == ("A toy", result.claims, result.failures)
    assert run.metrics["mean_draw"] == result.metrics["mean_draw"]
    assert np.isnan(run.metrics["worst"])
    assert run.columns["case"].tolist() == [0, 1, 2, 4]
    for name in ("draw", "shifted", "even"):
        assert run.columns[name].tolist() == [row[name] for row in result.rows]
    assert run.columns["even"].dtype == np.bool_
    assert run.command == "optsat study run toy-study --cases 5 --seed 3"
    assert run.figure == b"<svg><!-- 4 rows --></svg>"
    assert set(run.digests) == {"summary.csv", "result.nc", "figure.svg"}


def test_a_mixture_of_machines_is_said(tmp_path: Path) -> None:
    from optsat.campaign.manifest import Manifest
    from optsat.report.content import caution

    run_study(toy_study.study, cases=3, out=tmp_path)
    alone = read_run(tmp_path)
    assert len(alone.numerics) == 1
    assert caution(alone) == ""
    Manifest(tmp_path / "manifest").append("other numerics", print="f" * 16, chunk=0)
    mixed = read_run(tmp_path)
    assert mixed.numerics == (*alone.numerics, "f" * 16)
    assert "not comparable bit by bit" in caution(mixed)


def test_arrays_come_from_the_final_file(tmp_path: Path) -> None:
    def run(case: Any, rng: np.random.Generator) -> Any:
        if case["offset"] == 1:
            raise InputError("no")
        return {"path": rng.random((2, 3)), "x": 1.0}

    study = Study(**{**vars(toy_study.study), "run": run, "metrics": lambda rows: {}, "claims": lambda m: []})
    result = run_study(study, cases=4, out=tmp_path)
    arrays = read_run(tmp_path).arrays()
    assert list(arrays) == ["path"]
    assert np.array_equal(arrays["path"], [row["path"] for row in result.rows])


@pytest.mark.parametrize(
    ("cells", "dtype"),
    [
        (["1", "2"], "int64"),
        (["1", "2.5"], "float64"),
        (["nan", "-inf"], "float64"),
        (["True", "False"], "bool"),
        (["True", "1"], "<U4"),
        ([str(2**70), "1"], "float64"),
        (["a", ""], "<U1"),
    ],
)
def test_a_column_is_of_the_kind_of_all_its_cells(cells: list[str], dtype: str) -> None:
    from optsat.campaign.finished_run import _typed

    assert _typed(cells).dtype == np.dtype(dtype)


def test_what_is_not_a_complete_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no run of a study"):
        read_run(tmp_path)
    run_study(toy_study.study, cases=5, out=tmp_path)
    (tmp_path / "complete.json").unlink()
    with pytest.raises(InputError, match=r"not complete.*toy-study --cases 5 --seed 0 --out .* --resume"):
        read_run(tmp_path)


def _without(name: str) -> Callable[[dict[str, Any]], None]:
    return lambda document: document.pop(name)


def _elsewhere(document: dict[str, Any]) -> None:
    document["files"]["../secret"] = {"bytes": 0, "sha256": ""}


def _other_seed(document: dict[str, Any]) -> None:
    document["identity"]["seed"] = 9


def _odd_verdict(document: dict[str, Any]) -> None:
    document["claims"][0]["verdict"] = "PERHAPS"


@pytest.mark.parametrize(
    ("name", "change", "error"),
    [
        ("run.json", _without("identity"), InputError),
        ("run.json", _other_seed, OptsatError),
        ("complete.json", _without("claims"), InputError),
        ("complete.json", _odd_verdict, InputError),
        ("complete.json", _elsewhere, InputError),
    ],
)
def test_documents_that_were_changed_are_refused(
    tmp_path: Path, name: str, change: Callable[[dict[str, Any]], None], error: type[Exception]
) -> None:
    run_study(toy_study.study, cases=3, out=tmp_path)
    document = json.loads((tmp_path / name).read_text())
    change(document)
    (tmp_path / name).write_text(json.dumps(document))
    with pytest.raises(error, match=name):
        read_run(tmp_path)
