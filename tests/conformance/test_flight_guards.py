"""Guards under assault: a million plausible calls, 200,000 hostile ones, under the sanitizers, never a bad answer."""

import os
import re
from pathlib import Path

import pytest
from flight_assault import print_assault
from flight_kernels import KERNELS, bundle_of, tool, written

from optsat.export.build_files import flags
from optsat.export.tools import run_tool
from optsat.export.verify import replay

PLAUSIBLE, HOSTILE = 1_000_000, 200_000
# 40 times slower than the others: a part of the calls, all of them with OPTSAT_ALL_CALLS=1
HEAVY = {"unscented_filter_7_loops"}
SANITIZERS = ("-O1", "-g", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")
HEADER = Path(__file__).with_name("flight_assault.h")


def assaulted(
    name: str, precision: str, folder: Path, broken: tuple[str, str] = ("", ""), calls: int = 1, hostile: int = HOSTILE
) -> list[int]:
    """Counts of plausible calls, accepted ones, hostile calls, accepted ones, violations."""
    compiler = tool("gcc")
    bundle = bundle_of(name, precision=precision)
    written(bundle, folder)
    (folder / HEADER.name).write_text(HEADER.read_text())
    (folder / "assault.c").write_text(print_assault(bundle.interfaces[0]))
    if broken[0]:
        text = (folder / f"{name}.c").read_text()
        assert broken[0] in text
        (folder / f"{name}.c").write_text(text.replace(*broken))
    more = () if broken[0] else SANITIZERS
    command = [
        compiler,
        *flags(bundle.target, bundle.precision),
        *more,
        "assault.c",
        f"{name}.c",
        "-lm",
        "-o",
        "assault",
    ]
    run_tool(command, folder)
    said = run_tool(["./assault", str(calls), str(hostile)], folder, accept=(0, 1))
    assert re.search(r"violations \d+$", said.strip()), said
    return [int(word) for word in re.findall(r" (\d+)", said.splitlines()[-1])]


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize("name", KERNELS)
def test_no_answer_is_bad_and_every_refusal_is_safe(name: str, precision: str, tmp_path: Path) -> None:
    share = 1 if name not in HEAVY or os.environ.get("OPTSAT_ALL_CALLS") else 25
    counts = assaulted(name, precision, tmp_path, calls=PLAUSIBLE // share, hostile=HOSTILE // share)
    plausible, accepted, hostile, let_through, violations = counts
    assert violations == 0
    # neither all nor nothing: both sides of the guards were walked
    assert accepted > plausible // 50
    assert 0 < let_through < hostile


MISTAKES = {
    "a NaN passes": ("dcm_from_quaternion", ("not_finite != 0U", "(not_finite != 0U) && (not_finite == 0U)")),
    "lengths are not looked at": ("dcm_from_quaternion", ("not_unit != 0U", "(not_unit != 0U) && (not_unit == 0U)")),
    "results are not looked at": ("rigid_body_step", ("bad_output != 0U", "(bad_output != 0U) && (not_finite != 0U)")),
    "a refusal leaves results stale": ("newton_root", ("if (out != NULL) {", "if ((out != NULL) && (in == NULL)) {")),
    "a range is not looked at": ("newton_root", ("out_of_range != 0U", "(out_of_range != 0U) && (not_finite != 0U)")),
    "the count is not looked at": ("mean_direction", ("os_failed(!has_count)", "0U")),
    "a state never set is taken": ("covariance_step", ("if (!valid) {", "if ((!valid) && (in == NULL)) {")),
    "a NULL result is taken as told": ("quaternion_from_dcm", ("status = OS_E_NULL", "status = OS_OK")),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_the_assault_finds_a_planted_mistake(mistake: str, tmp_path: Path) -> None:
    name, broken = MISTAKES[mistake]
    *_, violations = assaulted(name, "double", tmp_path, broken, hostile=20_000)
    assert violations > 0


@pytest.mark.parametrize(
    ("name", "broken"),
    [
        ("newton_root", ("status = found;", "status = OS_OK;")),
        ("newton_root", ("return (unsettled == 0U)", "return (unsettled <= 1U)")),
        ("mean_direction", ("out->scaled = scaled;", "out->scaled = 0U;")),
        ("mean_direction", ("(os_real_t)0.0;", "(os_real_t)1.0;")),
        ("turned_attitude", ("state->q_BN[k] = cfg->q_BN[k];", "state->q_BN[k] = (os_real_t)0.5;")),
        ("covariance_step", ("x[1U] = state->P[1U];", "x[1U] = state->P[0U];")),
    ],
)
def test_the_self_test_finds_a_planted_mistake(name: str, broken: tuple[str, str], tmp_path: Path) -> None:
    bundle = bundle_of(name)
    folder = written(bundle, tmp_path)
    assert replay(bundle, folder, tool("cc"))[name].passed
    text = (folder / f"{name}.c").read_text()
    assert broken[0] in text
    (folder / f"{name}.c").write_text(text.replace(*broken))
    assert not replay(bundle, folder, tool("cc"))[name].passed
