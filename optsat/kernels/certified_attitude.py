"""Certified attitude: attitude from a fixed number of vectors, and the angle that its error never exceeds."""

import math
from dataclasses import replace

from optsat.kernels.instantiate import instantiate
from optsat.kernels.sizes import check_size
from optsat.kernels.source import KernelSource
from optsat.kernels.twins import certified_attitude as certified_twin
from optsat.kernels.twins import certified_attitude_ball as ball_twin
from optsat.kernels.twins import certified_attitude_programme as programme_twin
from optsat.port import Port

FEWEST, MOST = 2, 10
"""Numbers of vectors that are offered."""
LENGTH_TOLERANCE = 0.05
"""Deviation of a vector's length from one that flight code counts, as a sign of a sensor gone wrong."""
# the bound hardly depends on the weights near the best ones, so that rounding moves them far
_FLOAT_ULP = 65536.0
# one iteration of the search; a call takes 6 to 12 as a rule
_OPERATIONS, _OPERATIONS_A_VECTOR = 5500, 260


def certified_attitude(vectors: int = 4, iterations: int = 40) -> KernelSource:
    """Return `certified_attitude_N`: attitude from N bounded direction errors, and the angle its error never exceeds.

    q_BN : w >= 0; where the vectors are collinear, the smallest rotation that fits them
    bound_rad : every attitude within the bounds is within this angle of q_BN; pi where the status is not 0
    weights : of the vectors, sum 1; any weights prove a bound, these are within 1e-5 of the best
    status : 0 ok; 1 unbounded: the vectors are collinear or the bounds too wide; 2 inconsistent: no attitude fits

    A vector of bound pi says nothing and is not looked at. Vectors are scaled to length one first. Rounding of the
    computation is covered; that of data which are less exact than the arithmetic must be covered by angle_bound_rad,
    the sum of the bounds of a direction in B and in N.

    Status of the call: OS_E_NOT_FINITE, OS_E_RANGE for a bound outside [0, pi], OS_E_NOT_UNIT for a vector of length
    zero; the results are then those of no vectors at all.

    vectors : number of pairs, 2 to 10
    iterations : of the search at most, three times where its start was poor, 1 to 100; fewer only loosen the bound

    Raises
    ------
    InputError : a number is outside its range.

    Source: robust Wahba specification, sections 6 and 8, the weights by Mehrotra's predictor-corrector along the
    direction of Helmberg, Kojima and Monteiro.
    """
    n = check_size("certified_attitude", "vectors", vectors, FEWEST, MOST)
    check_size("certified_attitude", "iterations", iterations, 1, 100)
    source = instantiate(
        "certified_attitude",
        f"certified_attitude_{n}",
        leaves={},
        sizes={"N": n, "ITERATIONS": iterations, "PASSES": certified_twin.PASSES, "SWEEPS": ball_twin.SWEEPS},
        inputs=(
            Port("b_B", (n, 3), "-", direction=LENGTH_TOLERANCE, counted=True),
            Port("r_N", (n, 3), "-", direction=LENGTH_TOLERANCE, counted=True),
            Port("angle_bound_rad", (n,), "rad", lower=0.0, upper=math.pi, counted=True, padding=math.pi),
        ),
        outputs=(
            Port("q_BN", (4,), "-", unit_norm=1e-3),
            Port("bound_rad", (), "rad", lower=0.0, upper=3.2, safe=math.pi),
            Port("weights", (n,), "-", lower=0.0, upper=1.001),
            Port("status", (), "-", lower=0.0, upper=2.0, safe=1.0),
        ),
        constants={
            "PI": math.pi,
            "ROUNDOFFS": certified_twin.roundoffs(n),
            "GRANTED": certified_twin.GRANTED,
            "WIDEST": programme_twin.WIDEST,
            "ENOUGH": programme_twin.ENOUGH,
            "SHARE": programme_twin.SHARE,
        },
        twin=certified_twin.twin(n, iterations),
        has_short_loops=True,
        operations=_OPERATIONS + _OPERATIONS_A_VECTOR * n,
    )
    return replace(source, float_ulp=_FLOAT_ULP)
