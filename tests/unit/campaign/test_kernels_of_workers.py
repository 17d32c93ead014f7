"""Kernels travel to workers by cache key: what the runner has compiled no worker compiles again."""

from pathlib import Path

import kernel_study
import numpy as np
import pytest

from optsat.campaign.runner import run_study


def test_workers_open_what_the_runner_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPTSAT_CACHE", str(tmp_path))
    kernel_study.kernel.cache_clear()
    serial = run_study(kernel_study.study)
    compiled = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.so")}
    assert compiled
    spread = run_study(kernel_study.study, workers=2)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.so")} == compiled, "a worker compiled"
    assert (
        {row["form"] for row in spread.rows}
        == {row["form"] for row in serial.rows}
        <= {"extension", "cached extension", "ctypes"}
    )
    np.testing.assert_array_equal([row["q"] for row in spread.rows], [row["q"] for row in serial.rows])
