"""The isolability study at full length: every figure within its bar, the figure drawn."""

from pathlib import Path

import numpy as np

from optsat.campaign.claim import Verdict
from optsat.campaign.runner import run_study
from optsat.studies import fault_isolability


def test_every_figure_of_the_table_holds(tmp_path: Path) -> None:
    result = run_study(fault_isolability.study, 7, seed=0)
    assert not result.failures
    assert len(result.claims) == 27
    assert {claim.verdict for claim in result.claims} == {Verdict.HOLDS}
    fault_isolability.figure(result.rows, tmp_path / "isolability.svg")
    assert "svg" in (tmp_path / "isolability.svg").read_text(encoding="utf-8")[:400]


def test_a_wrong_figure_fails() -> None:
    rows = [dict(fault_isolability.run({"sensors": name}, np.random.default_rng(0))) for name in ("star_gyro", "gyro")]
    rows[0]["torque_others"], rows[1]["torque_detected"] = 2e-6, 8.9 * 1.06
    verdicts = {claim.id: claim.verdict for claim in fault_isolability.claims(fault_isolability.metrics(rows))}
    failed = [name for name, verdict in verdicts.items() if verdict is Verdict.FAILS]
    assert failed == ["star-gyro-torque-others", "gyro-torque-detected"]
