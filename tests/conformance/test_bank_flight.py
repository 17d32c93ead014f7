"""Banks as flight C: code and memory within their bars, no data of their own, and the answers of Python."""

import re
import subprocess
from importlib import resources
from pathlib import Path

import pytest
from kernel_source_harness import tool

from optsat.estimators.bank_kernels import attitude_bank
from optsat.export.build_files import WARNINGS, flags
from optsat.export.definition import define
from optsat.export.export import export_c
from optsat.export.interface import Interface
from optsat.export.object_file import examine, faults
from optsat.export.print_header import print_header
from optsat.export.print_source import print_source
from optsat.export.target import TARGETS

_SIZES = """
#include "{name}.h"
char state_size[sizeof({name}_state_t)];
char in_size[sizeof({name}_in_t)];
char out_size[sizeof({name}_out_t)];
char memory_size[sizeof({name}_memory_t)];
"""


@pytest.mark.parametrize(
    ("modes", "target", "most_text", "most_memory"),
    [(128, "desktop", 500_000, 1_000_000), (16, "cortex-m7", 64_000, 64_000)],
)
def test_code_and_memory(modes: int, target: str, most_text: int, most_memory: int, tmp_path: Path) -> None:
    wanted = TARGETS[target]
    compiler = tool(wanted.compilers[0])
    interface = Interface(define(attitude_bank(modes)).source)
    name = interface.source.name
    for folder in ("optsat.kernels.c", "optsat.export.c"):
        for header in resources.files(folder).iterdir():
            if header.name.endswith(".h"):
                (tmp_path / header.name).write_text(header.read_text())
    (tmp_path / f"{name}.h").write_text(print_header(interface, []))
    (tmp_path / f"{name}.c").write_text(print_source(interface, []))
    (tmp_path / "sizes.c").write_text(_SIZES.format(name=name))
    for file in (name, "sizes"):
        command = [compiler, *flags(wanted, "double"), *(WARNINGS if file == name else []), "-c", f"{file}.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
    found = examine(tmp_path / f"{name}.o", wanted)
    assert faults(found, interface.functions, interface.source.libm) == []
    assert (found.data, found.bss) == (0, 0)
    assert found.text < most_text
    listed = subprocess.run(
        [f"{wanted.prefix}nm", "-S", "sizes.o"], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    memory = sum(int(size, 16) for size in re.findall(r"^\w+ (\w+) [BDC] \w+_size$", listed, re.MULTILINE))
    assert memory > 8 * modes
    assert memory < most_memory


def test_exported_bank_answers_as_python_does(tmp_path: Path) -> None:
    tool("cc")
    export = export_c([attitude_bank(16)], tmp_path / "flight", misra="none")
    replay = export.kernels[0].replay
    assert replay is not None
    assert replay.passed
    assert replay.accepted >= 16
