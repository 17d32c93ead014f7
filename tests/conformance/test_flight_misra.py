"""MISRA C:2012 as far as cppcheck's add-on checks it: no required rule broken, no advisory one without a reason."""

import os
from pathlib import Path

import pytest
from flight_kernels import KERNELS, bundle_of, tool, written

from optsat.export.misra import DEVIATIONS, LARGE, Extent, Finding, check, print_record


@pytest.mark.parametrize("precision", ["double", "float"])
@pytest.mark.parametrize("name", KERNELS)
def test_every_finding_is_recorded(name: str, precision: str, tmp_path: Path) -> None:
    tool("cppcheck")
    bundle = bundle_of(name, precision=precision)
    # minutes for two of them
    extent: Extent = "all" if os.environ.get("OPTSAT_ALL_CALLS") else "small"
    findings, unchecked = check(bundle, written(bundle, tmp_path), extent)
    if any(sentence.startswith("MISRA not checked") for sentence in unchecked):
        pytest.skip(f"{unchecked[0]} Set OPTSAT_ALL_CALLS=1 to run it here.")
    assert unchecked == []
    assert {finding.rule for finding in findings} <= DEVIATIONS.keys()
    assert {category for category, _ in DEVIATIONS.values()} == {"advisory"}


def test_a_planted_violation_is_found_and_told(tmp_path: Path) -> None:
    tool("cppcheck")
    bundle = bundle_of("dcm_from_quaternion")
    source = written(bundle, tmp_path) / "dcm_from_quaternion.c"
    source.write_text(
        source.read_text().replace("    return status;", "    if (in == out) goto end;\nend:\n    return status;")
    )
    findings, (says,) = check(bundle, tmp_path)
    assert "15.1" in {finding.rule for finding in findings}
    assert says.startswith("MISRA rules broken without a recorded reason: 1")
    assert "| 15.1 | not recorded |" in print_record(findings, [says])


def test_a_large_kernel_is_checked_on_demand(tmp_path: Path) -> None:
    tool("cppcheck")
    bundle = bundle_of("dcm_from_quaternion")
    source = written(bundle, tmp_path) / f"{bundle.names[0]}.c"
    source.write_text(source.read_text() + "\n" * LARGE)
    findings, (says,) = check(bundle, tmp_path)
    assert findings == []
    assert says.endswith("ask for it with --misra all.")
    assert check(bundle, tmp_path, "all")[1] == []


def test_the_record_names_rule_reason_and_places() -> None:
    record = print_record([Finding("2.5", "os_rt.h", 17), Finding("2.5", "os_rt.h", 19), Finding("2.4", "k.h", 3)], [])
    assert "| 2.5 | advisory | The run-time headers serve all kernels" in record
    assert "os_rt.h:17,19 |" in record
    assert "k.h:3 |" in record
