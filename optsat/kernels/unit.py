"""Unit: the whole C text of a library, one kernel behind the functions that it is called through."""

from collections.abc import Sequence
from typing import Literal

from optsat.kernels.float_constants import check_float_constants
from optsat.kernels.headers import headers_text
from optsat.kernels.source import KernelSource
from optsat.port import Port

ABI = 1
"""Number of the functions that a library offers and of their arguments; a loader refuses any other."""

Real = Literal["double", "float"]

_SCALAR = """\
static os_status_t {name}_sample(const os_real_t *x, os_real_t *y)
{{
{run}
}}

int32_t {name}_call(const os_real_t *const in[], os_real_t *const out[]);
int32_t {name}_call(const os_real_t *const in[], os_real_t *const out[])
{{
    os_real_t x[{k_in}];
    os_real_t y[{k_out}];
{load_call}
    const os_status_t status = {name}_sample(x, y);
{store_call}
    return (int32_t)status;
}}

int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status);
int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status)
{{
    int64_t failed = 0;
    for (int64_t i = 0; i < n; ++i) {{
        os_real_t x[{k_in}];
        os_real_t y[{k_out}];
{load_batch}
        const os_status_t found = {name}_sample(x, y);
{store_batch}
        failed += (found == OS_OK) ? 0 : 1;
        if (status != NULL) {{
            status[i] = (int32_t)found;
        }}
    }}
    return failed;
}}
"""


def library_text(source: KernelSource, real: Real = "double") -> str:
    """Return C99 that needs no other file and defines

    `const uint32_t os_abi`, `const uint32_t os_width`: the number of these functions, samples in a tile
    `int32_t NAME_call(in, out)`: one sample, a pointer for each port, matrices counted by rows; returns its status
    `int64_t NAME_batch(n, in, stride, out, status)`: n samples one after another; stride: numbers from one sample of
        an argument to the next, 0 where all share it; status: (n,) or NULL; returns how many are not OS_OK
    Results must not overlap anything but, in a call, the arguments.

    Raises
    ------
    InputError : a constant is too large or too small for `float`.
    """
    if real == "float":
        check_float_constants(source.name, source.body)
    return "\n".join(
        [
            *(["#define OS_REAL_IS_FLOAT", ""] if real == "float" else []),
            headers_text(["os_rt.h"]),
            source.body,
            f"extern const uint32_t os_abi;\nextern const uint32_t os_width;\nconst uint32_t os_abi = {ABI}U;",
            "const uint32_t os_width = 1U;\n",
            _scalar(source),
        ]
    )


def _scalar(source: KernelSource) -> str:
    name = source.name
    if source.has_status:
        run = [f"{name}_work_t work;", f"return {name}_body(x, y, &work);"]
    else:
        run = [f"{name}_leaf(x, y);", "return OS_OK;"]
    return _SCALAR.format(
        name=name,
        run=_indented(run, 1),
        # a C array holds one number at least
        k_in=max(1, sum(port.size for port in source.inputs)),
        k_out=max(1, sum(port.size for port in source.outputs)),
        load_call=_indented(_copies(source.inputs, "x[{at}] = in[{p}][{k}];"), 1),
        store_call=_indented(_copies(source.outputs, "out[{p}][{k}] = y[{at}];"), 1),
        load_batch=_indented(_copies(source.inputs, "x[{at}] = in[{p}][(i * stride[{p}]) + {k}];"), 2),
        store_batch=_indented(_copies(source.outputs, "out[{p}][(i * {size}) + {k}] = y[{at}];"), 2),
    )


def _copies(ports: Sequence[Port], statement: str) -> list[str]:
    lines, start = [], 0
    for p, port in enumerate(ports):
        copy = statement.format(p=p, k="k", at=f"{start} + k", size=port.size)
        lines.append(f"for (int32_t k = 0; k < {port.size}; ++k) {{ {copy} }}")
        start += port.size
    return lines


def _indented(lines: Sequence[str], levels: int) -> str:
    return "\n".join(f"{'    ' * levels}{line}" for line in lines)
