"""Generated flight C as it was reviewed: compared as text, and the same bytes from every process."""

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from optsat.export.export import gather

# one kernel without state and one with, each in the precision of the processor that it suits
KEPT = {"quaternion_compose": "cortex-m4", "rigid_body_step": "cortex-m7"}


def without_versions(text: str) -> str:
    """CasADi's version and its serialised form change with CasADi; the C must not."""
    return re.sub(r"(CasADi )[\d.]+|(model +SHA-256 )\w+", lambda found: f"{found[1] or found[2]}...", text)


@pytest.mark.parametrize("name", KEPT)
def test_the_generated_files_are_those_that_were_reviewed(name: str, golden: Callable[[str, str], None]) -> None:
    bundle = gather([name], KEPT[name], None, {}, {})
    for file, text in bundle.texts({}).items():
        if file in {f"{name}.c", f"{name}.h", "Makefile", "CMakeLists.txt"}:
            golden(f"{name}/{file}", without_versions(text))


def test_two_processes_with_different_hash_seeds_write_the_same_bytes(root: Path) -> None:
    program = (
        "import hashlib\nfrom optsat.export.export import gather\n"
        f"bundle = gather({list(KEPT)!r} + ['wahba_3'], 'desktop', None, {{}}, {{}})\n"
        "print(hashlib.sha256(repr(sorted(bundle.texts({}).items())).encode()).hexdigest())"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", program],
            cwd=root,
            env={**os.environ, "PYTHONHASHSEED": seed, "TZ": zone, "LC_ALL": "C"},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed, zone in (("1", "UTC"), ("2", "Asia/Tokyo"))
    }
    assert len(digests) == 1
    assert len(digests.pop().strip()) == hashlib.sha256().digest_size * 2


def test_nothing_of_this_machine_stands_in_the_files(root: Path) -> None:
    texts = "\n".join(gather(["wahba_3"], "desktop", None, {}, {}).texts({}).values())
    for trace in (str(root), os.uname().nodename, str(Path.home())):
        assert trace == "/" or not re.search(rf"(?<!\w){re.escape(trace)}(?!\w)", texts)
    assert not re.search(r"\b20\d\d-\d\d-\d\d\b", texts)
