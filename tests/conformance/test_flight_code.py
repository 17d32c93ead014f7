"""Flight code of every kind of kernel: free of warnings, of foreign symbols, of data, of recursion; equal to Python."""

from pathlib import Path

import pytest
from flight_kernels import KEPT, KERNELS, bundle_of, tool, written

from optsat.export.build_files import WARNINGS, flags
from optsat.export.catalogue import CATALOGUE
from optsat.export.export import export_c
from optsat.export.interface import Interface
from optsat.export.object_file import ObjectFile, faults, stack_bound
from optsat.export.print_selftest import allowed_difference
from optsat.export.tools import ToolError, run_tool

PRECISIONS = ("double", "float")

# large, or with a slow twin
SLOW = ("unscented_filter_7", "extended_filter_7", "certified_attitude_")


@pytest.mark.parametrize("name", KERNELS)
def test_double_has_the_bits_of_python_but_for_elementary_functions(name: str, tmp_path: Path) -> None:
    tool("cc")
    make = KERNELS[name]
    kept = {name: KEPT[name]} if name in KEPT else {}
    (kernel,) = export_c(name if make is None else make(), tmp_path, keep_last=kept, misra="none").kernels
    assert kernel.replay is not None
    assert kernel.object_file is not None
    assert kernel.replay.wrong_status == 0
    assert kernel.replay.worst_ulp <= allowed_difference(Interface(kernel.definition.source), "double")
    assert 10 < kernel.replay.accepted < kernel.replay.vectors
    if not kernel.object_file.outside:
        assert kernel.object_file.stack


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_no_compiler_warns(compiler: str, precision: str, tmp_path: Path) -> None:
    command = tool(compiler)
    for name in KERNELS:
        bundle = bundle_of(name, precision=precision)
        folder = written(bundle, tmp_path / name)
        sources = [f"{name}.c", f"{name}_selftest.c", "selftest.c"]
        run_tool([command, *flags(bundle.target, bundle.precision), *WARNINGS, "-c", *sources], folder)


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_headers_are_of_use_in_cpp_11(compiler: str, tmp_path: Path) -> None:
    command, c_compiler = tool(compiler), tool("gcc")
    for name in ("newton_root", "covariance_step"):
        bundle = bundle_of(name)
        written(bundle, tmp_path)
        run_tool([c_compiler, *flags(bundle.target, bundle.precision), "-c", f"{name}.c"], tmp_path)
    (tmp_path / "client.cpp").write_text(
        '#include "newton_root.h"\n#include "covariance_step.h"\n#include "os_adapt.h"\n'
        "int main() {\n"
        "    newton_root_in_t in = {{4.0, 9.0}};\n    newton_root_out_t out;\n    newton_root_memory_t memory;\n"
        "    covariance_step_state_t state;\n"
        "    const bool good = newton_root(&in, &out, &memory) == OS_OK && out.root[1] > 2.99\n"
        "        && covariance_init(&state, nullptr) == OS_E_NULL;\n"
        "    const os_real_t wxyz[4] = {1.0, 0.0, 0.0, 0.0};\n    os_real_t xyzw[4];\n"
        "    os_quaternion_from_scalar_first(wxyz, xyzw);\n"
        "    const os_real_t by_columns[6] = {1.0, 4.0, 2.0, 5.0, 3.0, 6.0};\n    os_real_t by_rows[6], again[6];\n"
        "    os_matrix_from_columns(by_columns, 2U, 3U, by_rows);\n    os_matrix_to_columns(by_rows, 2U, 3U, again);\n"
        "    bool same = xyzw[3] > 0.5;\n"
        "    for (uint32_t k = 0U; k < 6U; k++) {\n"
        "        same = same && by_rows[k] < k + 1.5 && by_rows[k] > k + 0.5 && again[k] - by_columns[k] < 0.5\n"
        "            && by_columns[k] - again[k] < 0.5;\n    }\n"
        "    return (good && same) ? 0 : 1;\n}\n"
    )
    strict = ["-std=c++11", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]
    run_tool([command, *strict, "client.cpp", "newton_root.o", "covariance_step.o", "-lm", "-o", "client"], tmp_path)
    run_tool(["./client"], tmp_path)


@pytest.mark.parametrize("optimisation", ["-O0", "-Os", "-O3"])
def test_the_bits_do_not_depend_on_optimisation_or_compiler(optimisation: str, tmp_path: Path) -> None:
    said = set()
    for compiler in (tool("gcc"), tool("clang")):
        bundle = bundle_of("rigid_body_step")
        folder = written(bundle, tmp_path)
        sources = ["selftest.c", "rigid_body_step.c", "rigid_body_step_selftest.c"]
        command = [compiler, *flags(bundle.target, bundle.precision), optimisation, *sources, "-lm", "-o", "run"]
        run_tool(command, folder)
        said.add(run_tool(["./run"], folder))
    assert len(said) == 1


def test_make_builds_and_replays(tmp_path: Path) -> None:
    tool("cc")
    for precision in PRECISIONS:
        folder = written(bundle_of("mean_direction", precision=precision), tmp_path / precision)
        assert "mean_direction passed" in run_tool([tool("make"), "all", "test"], folder)


def test_cmake_builds_and_replays(tmp_path: Path) -> None:
    folder = written(bundle_of("covariance_step", precision="float"), tmp_path)
    tool("cc")
    run_tool([tool("cmake"), "-S", ".", "-B", "build"], folder)
    run_tool([tool("cmake"), "--build", "build"], folder)
    assert "100% tests passed" in run_tool([tool("ctest"), "--test-dir", "build"], folder)


def test_a_self_test_of_the_other_precision_does_not_compile(tmp_path: Path) -> None:
    folder = written(bundle_of("dcm_from_quaternion", precision="float"), tmp_path)
    with pytest.raises(ToolError, match="these answers are for float"):
        run_tool([tool("cc"), "-std=c99", "-c", "dcm_from_quaternion_selftest.c"], folder)


def test_what_no_flight_kernel_may_hold_is_found() -> None:
    good = ObjectFile(100, 0, 0, ("k",), ("sinf", "sqrt", "__aeabi_dadd", "memcpy"), 16)
    assert faults(good, ("k",), ("sin",)) == []
    bad = ObjectFile(100, 4, 8, ("helper", "k"), ("cos", "malloc", "printf"), 16)
    assert faults(bad, ("k",), ("sin",)) == [
        "it has 4 bytes of data and 8 of bss",
        "it needs cos, malloc, printf",
        "it exports helper",
    ]


def _graph(frames: dict[str, str], calls: list[tuple[str, str]]) -> str:
    nodes = [f'node: {{ title: "{name}" label: "{name}\\nk.c:1:1\\n{frame}\\n0" }}' for name, frame in frames.items()]
    edges = [f'edge: {{ sourcename: "{a}" targetname: "{b}" label: "k.c:1:1" }}' for a, b in calls]
    return "\n".join([*nodes, 'node: { title: "sin" label: "sin\\n<built-in>" shape : ellipse }', *edges])


def test_the_stack_is_that_of_the_deepest_chain_of_calls() -> None:
    frames = {"k": "16 bytes (static)", "a": "100 bytes (static)", "b": "40 bytes (static)"}
    calls = [("k", "a"), ("k", "b"), ("a", "b"), ("b", "sin")]
    assert stack_bound(_graph(frames, calls)) == (156, ("sin",))


def test_recursion_and_frames_without_bound_are_refused() -> None:
    frames = {"k": "16 bytes (static)", "a": "100 bytes (static)"}
    with pytest.raises(ToolError, match="k calls a calls k: recursion"):
        stack_bound(_graph(frames, [("k", "a"), ("a", "k")]))
    with pytest.raises(ToolError, match="a has a stack frame that is not of fixed size"):
        stack_bound(_graph(frames | {"a": "32 bytes (dynamic)"}, [("k", "a")]))


@pytest.mark.parametrize(
    "name", [pytest.param(each, marks=pytest.mark.slow) if each.startswith(SLOW) else each for each in CATALOGUE]
)
def test_every_kernel_of_the_catalogue_answers_as_python_does(name: str, tmp_path: Path) -> None:
    tool("cc")
    (kernel,) = export_c(name, tmp_path, misra="none").kernels
    assert kernel.replay is not None
    assert kernel.replay.passed
    assert kernel.replay.worst_ulp <= allowed_difference(Interface(kernel.definition.source), "double")
