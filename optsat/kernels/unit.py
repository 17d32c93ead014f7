"""Unit: the whole C text of a library, one kernel behind the functions that it is called through."""

from typing import Literal

from optsat.errors import InputError
from optsat.kernels.drivers import print_batch, print_call
from optsat.kernels.elementary import lanes_of
from optsat.kernels.float_constants import check_float_constants
from optsat.kernels.headers import header, headers_text, included, without_includes
from optsat.kernels.lane_drivers import print_call_of_tile, print_lane_drivers, print_tile
from optsat.kernels.source import KernelSource

ABI = 1
"""Number of the functions that a library offers and of their arguments; a loader refuses any other."""

Real = Literal["double", "float"]

WIDTHS = (1, 2, 4, 8, 16)
"""Samples that one library computes at once."""

LANES_ALONE = 6000
"""Operations above which a single sample runs through the lanes too, so that the compiler has one form to compile."""


def library_text(source: KernelSource, real: Real = "double", width: int = 1) -> str:
    """Return C99 that needs no other file and defines

    `const uint32_t os_abi`, `const uint32_t os_width`: the number of these functions, samples in a tile
    `int32_t NAME_call(in, out)`: one sample, a pointer for each port, matrices counted by rows; returns its status
    `int64_t NAME_batch(n, in, stride, out, status)`: n samples one after another; stride: numbers from one sample of
        an argument to the next, 0 where all share it; status: (n,) or NULL; returns how many are not OS_OK
    `void NAME_tiles(tiles, in, stride, out)`: only for leaves of a width above 1: samples in tiles (k, os_width), k the
        size of the port; stride: numbers from one tile of an argument to the next, 0 where all share it
    Results must not overlap anything but, in a call, the arguments. What has a status has width 1, whatever is asked.

    width : samples in a vector, 1, 2, 4, 8 or 16; the bits are the same at each, and wider than the machine is slower

    Raises
    ------
    InputError : another width, or a constant that is too large or too small for `float`.
    """
    if width not in WIDTHS:
        raise InputError(f"{source.name}: `width` must be one of {', '.join(map(str, WIDTHS))}, got {width!r}.")
    if real == "float":
        check_float_constants(source.name, source.body)
    in_lanes = width > 1 and bool(source.lanes)
    lanes_alone = in_lanes and source.operations > LANES_ALONE
    names = included(source.body)
    return "\n".join(
        [
            *(["#define OS_REAL_IS_FLOAT"] if real == "float" else []),
            *([f"#define OS_WIDTH {width}"] if in_lanes else []),
            *([f"#define OS_SIDES {source.sides}\n#define OS_TILE (OS_WIDTH * OS_SIDES)"] if in_lanes else []),
            headers_text(["os_rt.h", *(["os_lanes.h"] if in_lanes else []), *names]),
            *([] if lanes_alone else [without_includes(source.body)]),
            *([*(lanes_of(header(name)) for name in names), source.lanes, print_tile(source)] if in_lanes else []),
            "extern const uint32_t os_abi;\nextern const uint32_t os_width;",
            f"const uint32_t os_abi = {ABI}U;\nconst uint32_t os_width = {width * source.sides if in_lanes else 1}U;\n",
            print_call_of_tile(source) if lanes_alone else print_call(source),
            print_lane_drivers(source) if in_lanes else print_batch(source),
        ]
    )
