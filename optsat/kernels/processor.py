"""Processor: what tells one machine from another where compiled code is concerned."""

import hashlib
import os
import platform
import sys
from functools import cache

import numpy as np

from optsat.errors import OptsatError

# words of /proc/cpuinfo that name no instruction a compiler could use
_NO_INSTRUCTIONS = """
    apic arat constant_tsc cpuid fsrm hypervisor lahf_lm mca mce mtrr nonstop_tsc nopl nx pae pat pge pse
    pse36 rep_good smap smep syscall topoext tsc tsc_adjust tsc_deadline_timer tsc_known_freq umip vme
    wbnoinvd x2apic
"""


class DenormalsFlushedError(OptsatError):
    """The processor replaces denormal numbers by zero, so that no result would have its bits."""


@cache
def features() -> frozenset[str]:
    """Return the instruction sets of this processor as the operating system names them; empty where it does not say."""
    try:
        with open("/proc/cpuinfo", "rb") as stream:
            # the first processor stands for all; the whole file takes long on a large machine
            text = stream.read(8192).decode("ascii", "replace")
    except OSError:
        return frozenset()
    for line in text.splitlines():
        name, _, words = line.partition(":")
        if name.rstrip() in ("flags", "Features"):
            return frozenset(words.split()) - frozenset(_NO_INSTRUCTIONS.split())
    return frozenset()


@cache
def identity() -> str:
    """Return a digest of architecture, instruction sets and C library: what compiled code and its bits depend on."""
    known = [platform.machine(), c_library(), *(sorted(features()) or [platform.processor()])]
    return hashlib.sha256("\n".join(known).encode()).hexdigest()


@cache
def c_library() -> str:
    """Return name and version of the C library, such as "glibc 2.36"."""
    try:
        return os.confstr("CS_GNU_LIBC_VERSION") or platform.system()
    except (AttributeError, ValueError, OSError):
        return f"{platform.system()} {platform.release()}"


def lane_width(real: str) -> int:
    """Return how many doubles, or floats, this processor works on at once: 8, 4 or 2, or twice that."""
    doubles = 8 if "avx512f" in features() else 4 if "avx" in features() else 2
    return 2 * doubles if real == "float" else doubles


def check_denormals() -> None:
    """Assert that this thread computes with denormal numbers.

    Raises
    ------
    DenormalsFlushedError : some library has switched them off, as those linked with -ffast-math do.
    """
    smallest, tiny = np.array([5e-324]), np.array([sys.float_info.min])
    if (smallest * 2.0**100)[0] == 0.0 or (tiny * 0.5)[0] == 0.0:
        raise DenormalsFlushedError(
            "The processor replaces denormal numbers by zero, so results would differ in their last bits: a library in "
            "this process was linked with -ffast-math. Import optsat without it, or rebuild that library."
        )
