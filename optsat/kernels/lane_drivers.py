"""Lane drivers: batches in tiles of OS_TILE samples, gathered from arrays of samples or resident in memory."""

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
    os_lanes_real_t x[{k_in} * OS_SIDES];
    os_lanes_real_t y[{k_out} * OS_SIDES];
{load}
    {name}_tile(x, y);
{store}
    return (int32_t)OS_OK;
}}
"""

_DRIVERS = """\
int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status);
int64_t {name}_batch(int64_t n, const os_real_t *const in[], const int64_t stride[], os_real_t *const out[],
    int32_t *status)
{{
    os_lanes_real_t x[{k_in} * OS_SIDES];
    os_lanes_real_t y[{k_out} * OS_SIDES];
    int64_t i = 0;
    for (; i <= (n - OS_TILE); i += OS_TILE) {{
{load_whole}
        {name}_tile(x, y);
        OS_UNROLLED
        for (int32_t w = 0; w < OS_WIDTH; ++w) {{
{store_whole}
        }}
    }}
    if (i < n) {{
        /* the last tile is filled with the last sample, and only what was asked for is stored */
{load_rest}
        {name}_tile(x, y);
        for (int32_t w = 0; w < (int32_t)(n - i); ++w) {{
{store_rest}
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
        os_lanes_real_t x[{k_in} * OS_SIDES];
        os_lanes_real_t y[{k_out} * OS_SIDES];
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
        load=copies(source.inputs, _on_each_side("{vector} = os_lanes_constant(in[{p}][k]);", "x"), 1),
        store=copies(source.outputs, "out[{p}][k] = y[({at}) * OS_SIDES][0];", 1),
    )


def print_lane_drivers(source: KernelSource) -> str:
    """Return NAME_batch over arrays (n, k), and NAME_tiles over arrays (tiles, k, OS_TILE), of the lanes of a leaf."""
    stored = "*((os_lanes_stored_t *)(out[{p}] + ((t * {size}) + k) * OS_TILE + s * OS_WIDTH)) = {vector};"
    loaded = "{vector} = *((const os_lanes_stored_t *)(in[{p}] + (t * stride[{p}]) + (k * OS_TILE) + s * OS_WIDTH));"
    whole = "{vector} = os_lanes_gathered_whole(in[{p}] + k, i + s * OS_WIDTH, stride[{p}]);"
    rest = "{vector} = os_lanes_gathered(in[{p}] + k, i + s * OS_WIDTH, n - 1, stride[{p}]);"
    last = "out[{p}][((i + w) * {size}) + k] = y[({at}) * OS_SIDES + (w / OS_WIDTH)][w % OS_WIDTH];"
    spread = "out[{p}][((i + (s * OS_WIDTH) + w) * {size}) + k] = {vector}[w];"
    return _DRIVERS.format(
        name=source.name,
        **array_lengths(source),
        load_whole=copies(source.inputs, _on_each_side(whole, "x"), 2),
        load_rest=copies(source.inputs, _on_each_side(rest, "x"), 2),
        store_whole=copies(source.outputs, _on_each_side(spread, "y"), 3),
        store_rest=copies(source.outputs, last, 3),
        load_tile=copies(source.inputs, _on_each_side(loaded, "x"), 2),
        store_tile=copies(source.outputs, _on_each_side(stored, "y"), 2),
    )


def _on_each_side(statement: str, array: str) -> str:
    placed = statement.replace("{vector}", array + "[({at}) * OS_SIDES + s]")
    return "for (int32_t s = 0; s < OS_SIDES; ++s) {{ " + placed + " }}"
