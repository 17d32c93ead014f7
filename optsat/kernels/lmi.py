"""Linear matrix inequality: a small semidefinite programme of a size fixed when the kernel is built."""

from collections.abc import Sequence

from optsat.errors import InputError
from optsat.kernels.instantiate import instantiate
from optsat.kernels.sizes import LANES, check_size, padded
from optsat.kernels.source import KernelSource
from optsat.kernels.twins import lmi as lmi_twin
from optsat.port import Port

LARGEST_SIDE, MOST_BLOCKS, MOST_VARIABLES = 12, 8, 80
"""Rows of a block, blocks, and unknowns, above which the work memory no longer belongs on a stack."""


def lmi(
    variables: int,
    sides: Sequence[int],
    tolerance: float = 1e-8,
    iterations: int = 40,
    name: str = "lmi",
) -> KernelSource:
    """Return the kernel (cost, F) -> (x, objective, bound, outcome) of min cost . x, F_0 + sum_i x_i F_i >= 0.

    cost : (variables,)
    F : (variables + 1, entries), F_0 first; a row holds the blocks' upper triangles one after another, each by columns:
        11, 12, 22, 13, 23, 33, ..
    x : (variables,), for which the inequality was tested to hold strictly, rounding allowed for
    objective, bound : cost . x, and what the multiplier proves that no x falls below
    outcome : 0 optimal; 1 no x of reasonable size satisfies the inequality; 2 the cost falls for ever; 3 x satisfies
        the inequality but is not proved optimal; 4 nothing was found, as where the inequality can never hold strictly

    Status: OS_OK only where the outcome is 0, OS_E_RANGE for 1 and 2, OS_E_NOT_CONVERGED for 3 and 4,
    OS_E_NOT_FINITE for such an argument. What is not given is NaN.

    variables : unknowns, 1 to 80
    sides : rows of each block, 1 to 12, of at most 8 blocks; single inequalities stand on the diagonal of one block
    tolerance : of the gap, relative to 1 + |objective| + |bound|, and of what both sides lack, relative to the data; at
        least 512 roundings. Proofs of outcomes 1 and 2 hold for sizes up to its inverse
    iterations : at most, 1 to 200; 8 to 14 are usual

    Raises
    ------
    InputError : a number is outside its range, or there are no blocks.

    Source: the homogeneous self-dual model along the direction of Helmberg, Rendl, Vanderbei & Wolkowicz, SIAM J.
    Optim. 6 (1996), with Mehrotra's predictor and corrector.
    """
    m = check_size(name, "variables", variables, 1, MOST_VARIABLES)
    check_size(name, "iterations", iterations, 1, 200)
    if not 1 <= len(sides) <= MOST_BLOCKS:
        raise InputError(f"{name}: `sides` must name 1 to {MOST_BLOCKS} blocks, got {len(sides)}.")
    side = max(check_size(name, "sides", each, 1, LARGEST_SIDE) for each in sides)
    if not 0.0 < tolerance < 1.0:
        raise InputError(f"{name}: `tolerance` must be between 0 and 1, got {tolerance!r}.")
    triangle = side * (side + 1) // 2
    entries = sum(n * (n + 1) // 2 for n in sides)
    length = padded(len(sides) * triangle)
    return instantiate(
        "lmi",
        name,
        leaves={},
        sizes={
            "M": m,
            "BLOCKS": len(sides),
            "SIDE": side,
            "ORDER": len(sides) * side,
            "TRIANGLE": triangle,
            "PADDED": length,
            "LANES": LANES,
            "ENTRIES": m + (m + 1) * entries,
            "ITERATIONS": iterations,
            "HALVINGS": lmi_twin.HALVINGS,
            "FINE": lmi_twin.FINE,
            "COARSE": lmi_twin.COARSE,
            "REPAIRS": lmi_twin.REPAIRS,
            "ROUNDOFFS": lmi_twin.roundoffs(m, side),
        },
        tables={"SIDES": list(sides)},
        constants={"TOLERANCE": tolerance},
        inputs=(Port("cost", (m,), "-"), Port("F", (m + 1, entries), "-")),
        outputs=(
            *(Port("x", (m,), "-"), Port("objective", (), "-"), Port("bound", (), "-")),
            Port("outcome", (), "-", lower=0.0, upper=4.0, safe=4.0),
        ),
        twin=lmi_twin.twin(m, tuple(sides), tolerance, iterations),
        has_short_loops=True,
        operations=m * len(sides) * 4 * side**3 + m * m * length + m**3 // 3 + 24 * len(sides) * side**3,
    )
