"""Lane drivers: batches in tiles of OS_WIDTH samples, gathered from arrays of samples or resident in memory."""

from optsat.kernels.drivers import array_lengths, copies
from optsat.kernels.source import KernelSource

# vectors cross a call in memory only, since their passing in registers differs between machines
_TILE = """\
static __attribute__((noinline)) void {name}_tile(const os_lanes_real_t *x, os_lanes_real_t *y)
{{
    {name}_lanes(x, y);
}}
"""

_CALL = """\
int32_t {name}_call(const os_real_t *const in[], os_real_t *const out[]);
int32_t {name}_call(const os_real_t *const in[], os_real_t *const out[])
{{
    os_lanes_real_t x[{k_in}];
    os_lanes_real_t y[{k_out}];
{load}
    {name}_tile(x, y);
{store}
    return (int32_t)OS_OK;
}}
"""

_DRIVERS = """\
OS_LANE os_lanes_real_t {name}_gathered(const os_real_t *in, int64_t first, int64_t last, int64_t stride)
{{
    os_lanes_real_t r;
    OS_UNROLLED
    for (int32_t w = 0; w < OS_WIDTH; ++w) {{
        r[w] = in[(((first + w) < last) ? (first + w) : last) * stride];
    }}
    return r;
}}

OS_LANE os_lanes_real_t {name}_gathered_whole(const os_real_t *in, int64_t first, int64_t stride)
{{
    os_lanes_real_t r;
    OS_UNROLLED
    for (int32_t w = 0; w < OS_WIDTH; ++w) {{
        r[w] = in[(first + w) * stride];
    }}
    return r;
}}

int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status);
int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status)
{{
    os_lanes_real_t x[{k_in}];
    os_lanes_real_t y[{k_out}];
    int64_t i = 0;
    for (; i <= (n - OS_WIDTH); i += OS_WIDTH) {{
{load_whole}
        {name}_tile(x, y);
        OS_UNROLLED
        for (int32_t w = 0; w < OS_WIDTH; ++w) {{
{store}
        }}
    }}
    if (i < n) {{
        /* the last tile is filled with the last sample, and only what was asked for is stored */
{load_rest}
        {name}_tile(x, y);
        for (int32_t w = 0; w < (int32_t)(n - i); ++w) {{
{store}
        }}
    }}
    for (int64_t s = 0; (status != NULL) && (s < n); ++s) {{
        status[s] = (int32_t)OS_OK;
    }}
    return 0;
}}

void {name}_tiles(int64_t tiles, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[]);
void {name}_tiles(int64_t tiles, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[])
{{
    for (int64_t t = 0; t < tiles; ++t) {{
        os_lanes_real_t x[{k_in}];
        os_lanes_real_t y[{k_out}];
{load_tile}
        {name}_tile(x, y);
{store_tile}
    }}
}}
"""


def print_tile(source: KernelSource) -> str:
    """Return NAME_tile, the lanes of a leaf over x and y."""
    return _TILE.format(name=source.name)


def print_call_of_tile(source: KernelSource) -> str:
    """Return NAME_call, one sample as a tile of the same sample in every lane, which takes about as long."""
    return _CALL.format(
        name=source.name,
        **array_lengths(source),
        load=copies(source.inputs, "x[{at}] = os_lanes_constant(in[{p}][k]);", 1),
        store=copies(source.outputs, "out[{p}][k] = y[{at}][0];", 1),
    )


def print_lane_drivers(source: KernelSource) -> str:
    """Return NAME_batch over arrays (n, k), and NAME_tiles over arrays (tiles, k, OS_WIDTH), of the lanes of a leaf."""
    name = source.name
    stored = "*((os_lanes_stored_t *)(out[{p}] + ((t * {size}) + k) * OS_WIDTH)) = y[{at}];"
    loaded = "x[{at}] = *((const os_lanes_stored_t *)(in[{p}] + (t * stride[{p}]) + (k * OS_WIDTH)));"
    return _DRIVERS.format(
        name=name,
        **array_lengths(source),
        load_whole=copies(source.inputs, f"x[{{at}}] = {name}_gathered_whole(in[{{p}}] + k, i, stride[{{p}}]);", 2),
        load_rest=copies(source.inputs, f"x[{{at}}] = {name}_gathered(in[{{p}}] + k, i, n - 1, stride[{{p}}]);", 2),
        store=copies(source.outputs, "out[{p}][((i + w) * {size}) + k] = y[{at}][w];", 3),
        load_tile=copies(source.inputs, loaded, 2),
        store_tile=copies(source.outputs, stored, 2),
    )
