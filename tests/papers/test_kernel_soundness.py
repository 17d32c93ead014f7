"""The campaign over the compiled certified attitude: the bits of single calls, claims as at full length."""

from pathlib import Path

import numpy as np
import pytest

from optsat.campaign import runner
from optsat.campaign.claim import Verdict
from optsat.campaign.designs import Layout
from optsat.campaign.draws import Draws
from optsat.campaign.runner import run_study
from optsat.campaign.seeds import campaign_key, case_generator
from optsat.determine import certify_attitude
from optsat.studies.certified_kernel_soundness import poses, study


def test_chunks_of_any_length_give_the_bits_of_single_calls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    for size in (48, 13):
        monkeypatch.setattr(runner, "_chunk_size", lambda *_, size=size: size)
        result = run_study(study, 48, seed=2, out=tmp_path / str(size))
        found.append((tmp_path / str(size) / "result.nc").read_bytes())
    assert found[0] == found[1]
    key = campaign_key(study.name, 2)
    cases = Layout.of(study.name, study.cases, 48, key).cases(range(48))
    for case, row in zip(cases, result.rows, strict=True):
        alone = study.run(case, case_generator(key, row["case"]))
        assert {name: float(value) for name, value in alone.items()} == {n: row[n] for n in row if n != "case"}
    assert {claim.verdict for claim in result.claims} == {Verdict.HOLDS}


def test_the_poses_are_admissible_and_the_bounds_those_of_the_array_path() -> None:
    key = campaign_key(study.name, 5)
    layout = Layout.of(study.name, study.cases, 16, key)
    columns, cells = layout.columns(range(16)), np.arange(16)
    q_BN, b_B, r_N, eps = poses(Draws.of_cells(key, cells), np.deg2rad(columns["bound_deg"]))
    assert study.run_batch is not None
    found = study.run_batch(columns, Draws.of_cells(key, cells))
    for k in range(16):
        m = int(columns["vectors"][k])
        attitude = certify_attitude(b_B[k, :m], r_N[k, :m], eps[k, :m], norm_policy="silent")
        assert found["answer"][k] == 0
        assert np.deg2rad(found["bound_deg"][k]) <= attitude.bound_rad * 1.01
        assert np.linalg.norm(q_BN[k]) == pytest.approx(1.0)
    assert np.max(found["ratio"]) > 0.5, "errors on the boundary come close to the bound"
