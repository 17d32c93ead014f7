"""`optsat verify`: accepts what is proven, rejects what is not, and needs no solver for it."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from orbit_minute import invoke, write_log

from optsat.determine import certify_attitude, worst_case_wahba
from optsat.problems.component_box import ComponentBox


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_log(tmp_path_factory.mktemp("log"))


@pytest.fixture(scope="module")
def certificates(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One a line: determined, contradictory and undetermined single frames."""
    path = tmp_path_factory.mktemp("certificates") / "frames.jsonl"
    assert invoke("attitude", log, "--stride", 11, "--certificates", path).exit_code == 1
    return path


def changed(text: str, **fields: object) -> str:
    return json.dumps({**json.loads(text), **fields})


def test_one_certificate(tmp_path: Path) -> None:
    file = tmp_path / "certificate.json"
    certificate = certify_attitude([[1, 0, 0], [0, 1, 0]], [[1, 0, 0], [0, 1, 0]], 0.01).certificate
    file.write_text(certificate.to_json())
    result = invoke("verify", file)
    assert (result.exit_code, result.stderr) == (0, "")
    assert result.stdout.startswith(f"claim    {certificate.claim}\nverdict  accepted: recomputed bound")
    assert "\nmargin   " in result.stdout
    document = json.loads(invoke("verify", file, "--json").stdout)
    assert list(document) == ["file", "accepted", "rejected", "certificates"]
    assert list(document["certificates"][0]) == ["line", "claim", "accepted", "reason", "margin"]


def test_a_line_each(certificates: Path) -> None:
    lines = [json.loads(line) for line in certificates.read_text().splitlines()]
    assert [line["t"] for line in lines] == [0.0, 11.0, 22.0, 33.0, 44.0, 55.0]
    assert {line["status"] for line in lines} == {"ok", "inconsistent", "unbounded"}
    result = invoke("verify", certificates)
    assert result.exit_code == 0
    assert "6 certificates accepted, 0 rejected" in result.stdout


def test_a_smaller_bound_is_rejected(certificates: Path, tmp_path: Path) -> None:
    first, second, *_ = certificates.read_text().splitlines()
    bound = json.loads(second)["bound_rad"]
    forged = tmp_path / "forged.jsonl"
    forged.write_text(f"{first}\n\n{changed(second, bound_rad=0.999 * bound)}\n")
    result = invoke("verify", forged)
    assert result.exit_code == 1
    assert "1 certificates accepted, 1 rejected\nline 3 rejected: recomputed bound" in result.stdout
    document = json.loads(invoke("verify", forged, "--json").stdout)
    assert (document["accepted"], document["rejected"]) == (1, 1)
    assert document["certificates"][1]["margin"] == pytest.approx(-0.001 * bound)


@pytest.mark.parametrize("fields", [{"weights": [0.0, 0.0]}, {"weights": [-1.0, 2.0]}, {"q_BN": [0, 0, 0, 2.0]}])
def test_nonsense_is_rejected_in_words(fields: Any, certificates: Path, tmp_path: Path) -> None:
    file = tmp_path / "nonsense.json"
    file.write_text(changed(certificates.read_text().splitlines()[0], **fields))
    result = invoke("verify", file)
    assert result.exit_code == 1
    assert "REJECTED" in result.stdout
    json.loads(invoke("verify", file, "--json").stdout)


def test_no_solver_is_imported(certificates: Path, root: Path) -> None:
    program = (
        "import sys; from optsat.cli import app\n"
        f"app(['verify', {str(certificates)!r}], standalone_mode=False); print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True, check=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    assert "optsat.certificates.attitude_certificate" in loaded
    assert not loaded & {"clarabel", "casadi", "cvxpy", "scipy.optimize", "optsat.solvers", "optsat.problems"}


@pytest.mark.parametrize(
    ("name", "data", "says"),
    [
        ("none.json", None, "none.json: the certificate cannot be opened: No such file"),
        ("bytes.json", b"\xff\xfe", "bytes.json: this is not text"),
        ("empty.json", b"\n", "empty.json: there is no certificate in it"),
        ("other.json", b"{}", "other.json: The certificate's `format` must be"),
        ("lines.jsonl", b"\n{}\n", "lines.jsonl, line 2: "),
    ],
)
def test_unreadable_files(name: str, data: bytes | None, says: str, tmp_path: Path) -> None:
    if data is not None:
        (tmp_path / name).write_bytes(data)
    result = invoke("verify", tmp_path / name)
    assert result.exit_code == 2
    assert says in result.stderr
    assert result.stdout == ""


def test_certificates_of_a_worst_case_are_known_too(tmp_path: Path) -> None:
    b, r = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0]]
    worst = worst_case_wahba(ComponentBox.from_half_width(b, 0.02), r).answer.certificate.to_json()
    file = tmp_path / "both.jsonl"
    file.write_text(f"{worst}\n{certify_attitude(b, r, 0.02).certificate.to_json()}\n", encoding="utf-8")
    accepted = invoke("verify", file)
    assert accepted.exit_code == 0
    assert "2 certificates accepted, 0 rejected" in accepted.output
    for damaged, message in (("{", "not JSON"), (changed(worst, format="other"), "`format` must be")):
        file.write_text(damaged, encoding="utf-8")
        refused = invoke("verify", file)
        assert refused.exit_code == 2
        assert message in refused.stderr
    file.write_text(changed(worst, gap=0.0), encoding="utf-8")
    rejected = invoke("verify", file)
    assert rejected.exit_code == 1
    assert "recomputed gap" in rejected.output
