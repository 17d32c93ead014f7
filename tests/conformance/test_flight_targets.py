"""Other computers: Cortex-M7 in double, Cortex-M4 in float and AArch64 give the bits of this one."""

from pathlib import Path

import pytest
from flight_kernels import bundle_of, tool, written

from optsat.export.build_files import WARNINGS, flags
from optsat.export.bundle import Bundle
from optsat.export.object_file import examine, faults
from optsat.export.target import TARGETS
from optsat.export.tools import run_tool
from optsat.export.verify import replay, verify

FEW = ("newton_root", "mean_direction", "covariance_step", "rigid_body_step", "wahba_4", "unscented_filter_7_loops")
# sines, arc tangents and their like, by our own functions
ELEMENTARY = ("sun", "euler321_from_quaternion")
CORTEX = {"cortex-m7": "double", "cortex-m4": "float"}


def bits_here(bundle: Bundle, folder: Path) -> tuple[str, int]:
    """Digest of all results on this computer, and the number of wrong statuses."""
    written(bundle, folder)
    said = replay(bundle, folder, tool("cc"))[bundle.names[0]]
    return said.bits, said.wrong_status


@pytest.mark.parametrize("name", [*FEW, *ELEMENTARY])
@pytest.mark.parametrize("target", CORTEX)
def test_cortex_m_gives_the_bits_of_this_computer(target: str, name: str, tmp_path: Path) -> None:
    tool(TARGETS[target].compilers[0])
    tool(TARGETS[target].simulator[0])
    precision = CORTEX[target]
    bundle = bundle_of(name, target, precision)
    if libm := bundle.definitions[0].source.libm:
        pytest.skip(f"{name} needs {', '.join(libm)} of the C library, whose last bits belong to the machine")
    found = verify(bundle, written(bundle, tmp_path / target))
    said = found.replays[name]
    assert found.missing == ()
    assert (said.bits, said.wrong_status) == bits_here(bundle_of(name, precision=precision), tmp_path / "here")
    assert said.passed
    stack = found.objects[name].stack
    assert stack
    assert stack < 2000


@pytest.mark.parametrize("precision", ["double", "float"])
def test_aarch64_gives_the_bits_of_this_computer(precision: str, tmp_path: Path) -> None:
    compiler, simulator = tool("aarch64-linux-gnu-gcc"), tool("qemu-aarch64")
    for name in FEW[:5]:
        bundle = bundle_of(name, precision=precision)
        folder = written(bundle, tmp_path / name)
        sources = ["selftest.c", f"{name}.c", f"{name}_selftest.c"]
        command = [
            compiler,
            *flags(bundle.target, bundle.precision),
            *WARNINGS,
            *sources,
            "-static",
            "-lm",
            "-o",
            "run",
        ]
        run_tool(command, folder)
        bits, wrong = bits_here(bundle, folder)
        said = run_tool([simulator, "./run"], folder)
        assert f"{name} passed" in said
        assert f" bits {bits}\n" in said
        assert wrong == 0


def test_the_other_precision_runs_too(tmp_path: Path) -> None:
    """Double on a processor whose floating-point unit has float alone: slow, the same bits."""
    tool("arm-none-eabi-gcc")
    tool("qemu-system-arm")
    bundle = bundle_of("dcm_from_quaternion", "cortex-m4", "double")
    said = verify(bundle, written(bundle, tmp_path / "m4")).replays["dcm_from_quaternion"]
    assert (said.bits, 0) == bits_here(bundle_of("dcm_from_quaternion"), tmp_path / "here")


def test_a_kernel_that_allocates_is_found_in_its_object_file(tmp_path: Path) -> None:
    compiler, target = tool("arm-none-eabi-gcc"), TARGETS["cortex-m4"]
    (tmp_path / "k.c").write_text(
        "#include <stdlib.h>\nint calls = 1;\nvoid *k(void);\nvoid *k(void) { calls++; return malloc(8U); }\n"
    )
    run_tool([compiler, *flags(target, "float"), "-c", "k.c", "-o", "k.o"], tmp_path)
    assert faults(examine(tmp_path / "k.o", target), ("k",), ()) == [
        "it has 4 bytes of data and 0 of bss",
        "it needs malloc",
        "it exports calls",
    ]
