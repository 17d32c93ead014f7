"""Export of kernels: files, answers equal to Python's, and what is refused."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from optsat.cli import app
from optsat.errors import InputError
from optsat.export.export import export_c
from optsat.export.target import TARGETS
from optsat.export.tools import find_tool

needs_compiler = pytest.mark.skipif(find_tool(*TARGETS["desktop"].compilers) is None, reason="no C compiler")


@needs_compiler
def test_double_without_libm_has_the_bits_of_python(tmp_path: Path) -> None:
    export = export_c(["dcm_from_quaternion", "rigid_body_step"], tmp_path / "flight", misra="none")
    assert sorted(path.name for path in (tmp_path / "flight").iterdir()) == list(export.files)
    for kernel in export.kernels:
        assert kernel.replay is not None
        assert kernel.object_file is not None
        assert (kernel.replay.differing, kernel.replay.wrong_status) == (0, 0)
        assert 0 < kernel.replay.accepted < kernel.replay.vectors
        assert (kernel.object_file.data, kernel.object_file.bss) == (0, 0)
        assert kernel.object_file.defined == tuple(sorted(kernel.functions))


def test_without_a_compiler_the_files_are_written_and_what_is_unchecked_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    export = export_c("dcm_from_quaternion", tmp_path / "flight")
    assert export.unchecked == (
        "Not compiled: no cc or gcc or clang on the path.",
        "MISRA not checked: cppcheck is not on the path.",
    )
    assert "not measured" in (tmp_path / "flight" / "dcm_from_quaternion.h").read_text()
    assert export.kernels[0].replay is None


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["rigid_bodystep"], "Did you mean `rigid_body_step`"),
        (["sun", "--target", "cortexm7"], "Did you mean `cortex-m7`"),
        (["sun", "--precision", "single"], "'float' or 'double', got 'single'"),
        (["sun", "--misra", "some"], "'none', 'small' or 'all', got 'some'"),
        (["sun", "sun"], "named twice"),
        ([], "No kernel was named"),
        (["sun", "--parameter", "colour=1"], "no parameter `colour`"),
        (["sun", "--parameter", "colour"], "must be NAME=JSON"),
        (["sun", "--parameter", "colour=x"], "is no JSON"),
        (["sun", "rigid_body_step", "--parameter", "substeps=2"], "say of which: KERNEL.substeps"),
        (["sun", "--parameter", "son.year=2"], "names son, which is not exported"),
        (["quaternion_from_dcm", "--keep-last", "q_NB"], "Did you mean `q_BN`"),
        (["sun", "--out", "/dev/null/folder"], "/dev/null"),
    ],
)
def test_wrong_usage_is_a_sentence_and_exit_code_2(arguments: list[str], says: str, tmp_path: Path) -> None:
    out = [] if "--out" in arguments else ["--out", str(tmp_path)]
    result = CliRunner().invoke(app, ["export", *arguments, *out], prog_name="optsat")
    assert result.exit_code == 2
    assert says in " ".join(result.stderr.split())
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_files_in_the_way_are_kept_unless_forced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "sun.h").write_text("mine")
    with pytest.raises(InputError, match=r"already holds sun\.h\. Name another folder, or replace them with --force"):
        export_c("sun", tmp_path)
    assert (tmp_path / "sun.h").read_text() == "mine"
    export_c("sun", tmp_path, force=True)
    assert (tmp_path / "sun.h").read_text() != "mine"
    with pytest.raises(InputError, match="is a file"):
        export_c("sun", tmp_path / "sun.h")


@needs_compiler
def test_the_command_prints_one_json_document(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["export", "mrp_switch", "--out", str(tmp_path), "--json"], prog_name="optsat")
    assert result.exit_code == 0
    document = json.loads(result.stdout)
    assert (document["target"], document["precision"]) == ("desktop", "double")
    (kernel,) = document["kernels"]
    assert (kernel["kernel"], kernel["replay"]["worst_ulp"]) == ("mrp_switch", 0.0)


def test_the_command_lists_kernels_and_parameters() -> None:
    result = CliRunner().invoke(app, ["export", "--list"], prog_name="optsat")
    assert "rigid_body_step" in result.stdout
    assert "  inertia_B" in result.stdout
    listed = json.loads(CliRunner().invoke(app, ["export", "--list", "--json"], prog_name="optsat").stdout)
    assert {"kernel", "says", "parameters"} == listed[0].keys()
