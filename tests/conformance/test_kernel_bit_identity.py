"""One digest of the results of a kernel, whatever compiles it, at every level and width, on x86 and on AArch64."""

import itertools
import platform
import shutil
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import pytest

from optsat.estimators.wahba_quartic import wahba_quartic
from optsat.export.catalogue import ARITHMETIC
from optsat.kernels.leaf import leaf_source
from optsat.kernels.lowering import lower
from optsat.kernels.source import KernelSource
from optsat.kernels.toolchain import KEEP_BITS
from optsat.kernels.unit import Real, library_text
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

NATIVE = ("-march=native", "-fno-math-errno", "-fno-trapping-math", "-Wno-psabi")
FORMS = [
    ("gcc", ("-O0",), 1),
    ("gcc", ("-O2", *NATIVE), 2),
    ("gcc", ("-O3", *NATIVE), 1),
    ("gcc", ("-O3", *NATIVE), 8),
    ("clang", ("-O2", *NATIVE), 4),
    ("clang", ("-O3", *NATIVE), 1),
    ("clang", ("-O2",), 8),
]
FOREIGN = [("-O2", 1), ("-O3", 4)]
SAMPLES = 2003

_MAIN = """
#include <stdio.h>
#include <string.h>

static uint64_t state = 1U;

/* Knuth's generator: numbers from -4 to 4, one in eight of another size, one in 64 special. */
static os_real_t drawn(void)
{{
    static const double special[8] = {{ 0.0, -0.0, 1.0, -1.0, 0.5, 1e30, INFINITY, NAN }};
    state = (state * 6364136223846793005U) + 1442695040888963407U;
    const uint64_t bits = state >> 33;
    double value = ((double)(bits & 0xFFFFFFU) / 2097152.0) - 4.0;
    if ((bits % 7U) == 0U) {{
        for (uint64_t k = 0U; k < ((bits >> 24) % 60U); ++k) {{ value = value * (((bits & 8U) != 0U) ? 1.5 : 0.75); }}
    }}
    return (os_real_t)(({special} && ((bits % 61U) == 0U)) ? special[(bits >> 8) % 8U] : value);
}}

int main(void)
{{
    static os_real_t memory[{samples} * {k_in}];
    static os_real_t results[{samples} * {k_out}];
    const os_real_t *in[{inputs}];
    os_real_t *out[{outputs}];
    const int64_t stride[{inputs}] = {{ {strides} }};
    os_real_t *next = memory;
{pointers}
    for (size_t i = 0U; i < sizeof memory / sizeof memory[0]; ++i) {{ memory[i] = drawn(); }}
    (void){name}_batch({samples}, in, stride, out, NULL);
    uint64_t digest = 0xCBF29CE484222325U;
    for (size_t i = 0U; i < sizeof results / sizeof results[0]; ++i) {{
        uint64_t word = 0U;
        if (!isnan(results[i])) {{ memcpy(&word, &results[i], sizeof results[i]); }} else {{ word = 0x7FF8U; }}
        digest = (digest ^ word) * 0x100000001B3U;
    }}
    printf("%016llx", (unsigned long long)digest);
    return 0;
}}
"""


def wahba(real: Real) -> GeneratedFunction:
    return wahba_quartic(vectors=4, **ARITHMETIC[real])


def circular(real: Real) -> GeneratedFunction:
    """Every elementary function of our own."""
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    functions = [ca.sin(a), ca.cos(a), ca.tan(b), ca.exp(a), ca.log(ca.fabs(b)), ca.atan2(a, b), ca.atan(a * b)]
    inverse = [ca.asin(a / 4), ca.acos(b / 4), ca.sin(1e5 * a * b), ca.exp(-a * a) * ca.cos(b)]
    outputs = [(Port("y", (11,), "-"), ca.vertcat(*functions, *inverse))]
    return generate("circular", [(Port("a", (), "-"), a), (Port("b", (), "-"), b)], outputs)


KERNELS: Mapping[str, tuple[Callable[[Real], GeneratedFunction], bool]] = {
    "wahba": (wahba, False),
    "circular": (circular, True),
}


def source_of(function: GeneratedFunction) -> KernelSource:
    return leaf_source(lower(function.casadi), function.inputs, function.outputs)


def program(source: KernelSource, real: Real, width: int, special: bool) -> str:
    places = list(itertools.accumulate((port.size for port in source.outputs), initial=0))
    pointers = [f"    in[{k}] = next; next += {SAMPLES} * {port.size};" for k, port in enumerate(source.inputs)]
    pointers += [f"    out[{k}] = results + {SAMPLES} * {places[k]};" for k in range(len(source.outputs))]
    main = _MAIN.format(
        name=source.name,
        samples=SAMPLES,
        special=int(special),
        k_in=sum(port.size for port in source.inputs),
        k_out=places[-1],
        inputs=len(source.inputs),
        outputs=len(source.outputs),
        strides=", ".join(str(port.size) for port in source.inputs),
        pointers="\n".join(pointers),
    )
    return library_text(source, real, width) + main


def digest(text: str, folder: Path, compiler: str, flags: tuple[str, ...], runner: tuple[str, ...] = ()) -> str:
    for tool in (compiler, *runner[:1]):
        if shutil.which(tool) is None:
            pytest.skip(f"{tool} is not on the path")
    path = folder / "program"
    command = [compiler, *flags, "-x", "c", "-", "-o", str(path), "-lm"]
    done = subprocess.run(command, input=text, text=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    return subprocess.run([*runner, str(path)], text=True, capture_output=True, check=True).stdout


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_all_forms_have_one_digest(kernel: str, real: Real, tmp_path: Path) -> None:
    make, special = KERNELS[kernel]
    source = source_of(make(real))
    assert source.libm == ()
    found = {}
    for compiler, flags, width in FORMS:
        text = program(source, real, width, special)
        found[compiler, flags, width] = digest(text, tmp_path, compiler, (*flags, *KEEP_BITS))
    assert len(set(found.values())) == 1, found


@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_the_simulated_aarch64_has_the_digest_of_this_machine(kernel: str, real: Real, tmp_path: Path) -> None:
    make, special = KERNELS[kernel]
    source = source_of(make(real))
    here = digest(program(source, real, 1, special), tmp_path, "gcc", ("-O2", *KEEP_BITS))
    kept = tuple(flag for flag in KEEP_BITS if not flag.startswith("-m"))
    runner = () if platform.machine() == "aarch64" else ("qemu-aarch64",)
    for level, width in FOREIGN:
        text = program(source, real, width, special)
        flags = (level, "-static", "-Wno-psabi", *kept)
        assert digest(text, tmp_path, "aarch64-linux-gnu-gcc", flags, runner) == here, (level, width)


def test_another_order_of_operations_has_another_digest(tmp_path: Path) -> None:
    """The digest does see the last bit."""
    text = program(source_of(circular("double")), "double", 1, special=True)
    mistaken = text.replace(
        "const os_real_t n = shifted - OS_ROUNDING;", "const os_real_t n = shifted - OS_ROUNDING + 0x1p-45;"
    )
    assert mistaken != text
    digests = [digest(each, tmp_path, "gcc", ("-O2", *KEEP_BITS)) for each in (text, mistaken)]
    assert digests[0] != digests[1]
