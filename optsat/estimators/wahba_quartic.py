"""Wahba's problem for a fixed number of vectors, as straight-line code: Davenport's quartic without its loss of digits.

The optimum is the eigenvector of the largest eigenvalue of Davenport's K. With B = sum w_i b_i r_i^T scaled to length
one, the characteristic polynomial is (x^2 - 1)^2 - 8 x det B - 4 |adj B|^2. Its largest root is reached from above; any
column of adj(x I - K) is then along the eigenvector, and the longest one is taken. Where the two largest eigenvalues
approach each other, the root loses digits and that column twice as many; the adjugate applied to it once more, which is
a step of inverse iteration, restores what an eigenvalue routine would give.
"""

import math

from optsat.attitude import quaternion
from optsat.attitude.backend import Value, dot, entries, matrix, reciprocal, sqrt
from optsat.attitude.edges import unchecked
from optsat.errors import InputError
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION, unit_quaternion
from optsat.symbolic.generated_function import GeneratedFunction, generate

FEWEST, MOST = 2, 10
"""Numbers of vectors that are offered as straight-line code."""

LENGTH_TOLERANCE = 0.05
"""Deviation of a vector's length from one that flight code counts, as a sign of a sensor gone wrong."""

# enough for errors of the vectors up to 0.3 rad; where they are not, the last turn of the attitude is long
_NEWTON_STEPS = 5
# what the eigenvalue is raised by, in roundings: keeps the column along the eigenvectors where two eigenvalues coincide
_RAISED = 8.0
# error of the attitude that counts as rounding, in roundings over the relative gap
_SETTLED = 64.0
# Newton's next step would be the square of this, relative to the gap
_LAST_STEP_TO_GAP = 1 / 32
_canonical = unchecked(quaternion.canonical)


def wahba_quartic(vectors: int = 4, tiny: float = 1e-300, rounding: float = 2.0**-52) -> GeneratedFunction:
    """Return `wahba_N`: the attitude that minimises sum_i w_i |b_i - A(q) r_i|^2 over N pairs.

    q_BN : w >= 0, a unit quaternion whatever the vectors
    eigenvalue : the largest of K, which equals sum_i w_i for unit vectors that fit exactly
    gap : 1 / trace(C^-1), C the curvature of the loss; at most the distance of the two largest eigenvalues, at least a
        third of it
    determined : 1 where q_BN is the optimum to rounding over gap; 0 where the gap is lost in rounding, or the vectors
        contradict each other so grossly that the fixed number of steps did not suffice

    Lengths of the vectors count as further weights; flight code scales them to one before.

    vectors : number of pairs, 2 to 10
    tiny : least divisor of the arithmetic it runs in
    rounding : spacing of its numbers at 1

    Raises
    ------
    InputError : `vectors` is outside that range.
    Source: Davenport's q-method; the quartic in B after Markley & Crassidis, Fundamentals of Spacecraft Attitude
    Determination and Control, 5.3.
    """
    import casadi as ca

    if not (isinstance(vectors, int) and FEWEST <= vectors <= MOST):
        raise InputError(
            f"`vectors` must be a whole number from {FEWEST} to {MOST}, got {vectors!r}. "
            "More vectors are the work of a loop: use optsat.wahba."
        )
    b_B, r_N = ca.SX.sym("b_B", vectors, 3), ca.SX.sym("r_N", vectors, 3)
    weights = ca.SX.sym("weights", vectors)
    attitude_profile = (b_B * ca.repmat(weights, 1, 3)).T @ r_N
    q, eigenvalue, gap, determined = best_attitude(attitude_profile, tiny, rounding)
    return generate(
        f"wahba_{vectors}",
        inputs=[
            (Port("b_B", (vectors, 3), "-", direction=LENGTH_TOLERANCE, counted=True), b_B),
            (Port("r_N", (vectors, 3), "-", direction=LENGTH_TOLERANCE, counted=True), r_N),
            (Port("weights", (vectors,), "-", lower=0.0, counted=True, padding=0.0), weights),
        ],
        outputs=[
            (QUATERNION, q),
            (Port("eigenvalue", (), "-", lower=0.0), eigenvalue),
            (Port("gap", (), "-", lower=0.0), gap),
            (Port("determined", (), "-", lower=0.0, upper=1.0, verdict=True), determined),
        ],
    )


def best_attitude(B: Value, tiny: float, rounding: float) -> tuple[Value, Value, Value, Value]:
    """Return q_BN, the largest eigenvalue of K(B), its gap, and whether q_BN is the optimum to rounding.

    B : attitude profile matrix (3, 3) in CasADi, sum_i w_i b_i r_i^T
    """
    import casadi as ca

    # a smaller B has no square, so it counts as zero
    least = math.sqrt(tiny)
    length = sqrt(ca.sumsqr(ca.vec(B)))
    size = ca.fmax(length, least)
    unit_B = reciprocal(size) * B
    root, gap, last_step = _largest_root(unit_B, rounding)
    adjugate = _adjugate((root + _RAISED * rounding) * ca.SX.eye(4) - _davenport(unit_B))
    first = _longest_column(adjugate)
    second = adjugate @ first
    # the error left is the square of the turn from first to second; rounding alone costs its ratio to the gap
    along = dot(first, second)
    across = dot(first, first) * dot(second, second) - along * along
    settled = ca.logic_and(
        across * gap <= _SETTLED * rounding * (root * along * along), _LAST_STEP_TO_GAP * gap >= last_step
    )
    stands_out = ca.logic_and(gap > math.sqrt(rounding) * root, length > least)
    return _canonical(unit_quaternion(second, tiny)), size * root, size * gap, ca.logic_and(settled, stands_out)


def _largest_root(B: Value, rounding: float) -> tuple[Value, Value, Value]:
    """Return the largest root x of (x^2 - 1)^2 - 8 x det B - 4 |adj B|^2, |B| = 1; 2 p' / p'' there; the last step."""
    import casadi as ca

    cofactors = _cofactors(B)
    determinant = dot(B[0, :].T, cofactors[0, :].T)
    square = ca.sumsqr(ca.vec(cofactors))
    # the root itself is sqrt(1 + 2 sqrt(square + 2 x determinant)), and no root exceeds sqrt 3: an upper bound, exact
    # where determinant = 0, such as for two vectors
    x = sqrt(1 + 2 * sqrt(square + 2 * math.sqrt(3.0) * ca.fmax(determinant, 0)))
    twice, constant, step = 2 * determinant, 0.25 - square, x

    def quarter_slope(x: Value) -> Value:
        return x * (x * x - 1) - twice

    for _ in range(_NEWTON_STEPS):
        quarter_value = (0.25 * x * x - 0.5) * (x * x) - twice * x + constant
        # at a double root the slope is rounding: a floor keeps the step at the root
        step = quarter_value / ca.fmax(quarter_slope(x), math.sqrt(rounding))
        x = x - step
    # with d_k the distances to the other roots, p' is their product and p'' / 2 the sum of their products in pairs
    return x, ca.fmax(quarter_slope(x), 0) / (1.5 * x * x - 0.5), step


def _cofactors(B: Value) -> Value:
    import casadi as ca

    rows = [B[k, :].T for k in range(3)]
    return ca.vertcat(*(ca.cross(rows[(k + 1) % 3], rows[(k + 2) % 3]).T for k in range(3)))


def _davenport(B: Value) -> Value:
    """Return K (4, 4), order [v; s], with q^T K q = trace(B A(q)^T)."""
    import casadi as ca

    trace = B[0, 0] + B[1, 1] + B[2, 2]
    z = ca.vertcat(B[1, 2] - B[2, 1], B[2, 0] - B[0, 2], B[0, 1] - B[1, 0])
    return ca.vertcat(ca.horzcat(B + B.T - trace * ca.SX.eye(3), z), ca.horzcat(z.T, trace))


def _adjugate(M: Value) -> Value:
    """Return the adjugate of a symmetric M (4, 4), by 2x2 minors of the upper and of the lower rows."""
    m = entries(M)
    pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
    s = {(i, j): m[0][i] * m[1][j] - m[0][j] * m[1][i] for i, j in pairs}
    c = {(i, j): m[2][i] * m[3][j] - m[2][j] * m[3][i] for i, j in pairs}

    def of_lower(row: int, i: int, j: int, k: int) -> Value:
        return m[row][i] * c[j, k] - m[row][j] * c[i, k] + m[row][k] * c[i, j]

    def of_upper(row: int, i: int, j: int, k: int) -> Value:
        return m[row][i] * s[j, k] - m[row][j] * s[i, k] + m[row][k] * s[i, j]

    xx, xy, yy = of_lower(1, 1, 2, 3), -of_lower(0, 1, 2, 3), of_lower(0, 0, 2, 3)
    xz, yz, zz = of_upper(3, 1, 2, 3), -of_upper(3, 0, 2, 3), of_upper(3, 0, 1, 3)
    xw, yw, zw, ww = -of_upper(2, 1, 2, 3), of_upper(2, 0, 2, 3), -of_upper(2, 0, 1, 3), of_upper(2, 0, 1, 2)
    return matrix(((xx, xy, xz, xw), (xy, yy, yz, yw), (xz, yz, zz, zw), (xw, yw, zw, ww)))


def _longest_column(adjugate: Value) -> Value:
    """Return the column with the largest diagonal entry; the scalar's column where all are equal."""
    import casadi as ca

    best, size = adjugate[:, 3], adjugate[3, 3]
    for k in range(3):
        best = ca.if_else(adjugate[k, k] > size, adjugate[:, k], best)
        size = ca.fmax(adjugate[k, k], size)
    return best
