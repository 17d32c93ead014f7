"""Drivers: the functions around a kernel that gather one sample from its ports, compute it, and spread the results."""

from collections.abc import Sequence

from optsat.kernels.source import KernelSource
from optsat.port import Port

# not inlined, so that a large kernel is compiled once
_CALL = """\
static __attribute__((noinline)) os_status_t {name}_sample(const os_real_t *x, os_real_t *y)
{{
{run}
}}

int32_t {name}_call(const os_real_t *const in[], os_real_t *const out[]);
int32_t {name}_call(const os_real_t *const in[], os_real_t *const out[])
{{
    os_real_t x[{k_in}];
    os_real_t y[{k_out}];
{load}
    const os_status_t status = {name}_sample(x, y);
{store}
    return (int32_t)status;
}}
"""

_BATCH = """\
int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status);
int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status)
{{
    int64_t failed = 0;
    for (int64_t i = 0; i < n; ++i) {{
        os_real_t x[{k_in}];
        os_real_t y[{k_out}];
{load}
        const os_status_t found = {name}_sample(x, y);
{store}
        failed += (found == OS_OK) ? 0 : 1;
        if (status != NULL) {{
            status[i] = (int32_t)found;
        }}
    }}
    return failed;
}}
"""


def print_call(source: KernelSource) -> str:
    """Return NAME_sample, the kernel over x and y, and NAME_call, one sample through a pointer for each port."""
    name = source.name
    if source.has_status:
        run = [f"{name}_work_t work;", f"return {name}_body(x, y, &work);"]
    else:
        run = [f"{name}_leaf(x, y);", "return OS_OK;"]
    return _CALL.format(
        name=name,
        run=indented(run, 1),
        **array_lengths(source),
        load=copies(source.inputs, "x[{at}] = in[{p}][k];", 1),
        store=copies(source.outputs, "out[{p}][k] = y[{at}];", 1),
    )


def print_batch(source: KernelSource) -> str:
    """Return NAME_batch, n samples one after another through NAME_sample."""
    return _BATCH.format(
        name=source.name,
        **array_lengths(source),
        load=copies(source.inputs, "x[{at}] = in[{p}][(i * stride[{p}]) + k];", 2),
        store=copies(source.outputs, "out[{p}][(i * {size}) + k] = y[{at}];", 2),
    )


def array_lengths(source: KernelSource) -> dict[str, int]:
    """Return the lengths of x and y; a C array holds one number at least."""
    k_in, k_out = (sum(port.size for port in ports) for ports in (source.inputs, source.outputs))
    return {"k_in": max(1, k_in), "k_out": max(1, k_out)}


def copies(ports: Sequence[Port], statement: str, level: int) -> str:
    """Return loops over the numbers k of each port p; {at} is where they stand among those of all ports."""
    lines, start = [], 0
    for p, port in enumerate(ports):
        copy = statement.format(p=p, at=f"{start} + k", size=port.size)
        lines.append(f"for (int32_t k = 0; k < {port.size}; ++k) {{ {copy} }}")
        start += port.size
    return indented(lines, level)


def indented(lines: Sequence[str], level: int) -> str:
    """Return the lines as one text, `level` times four columns in."""
    return "\n".join(f"{'    ' * level}{line}" for line in lines)
