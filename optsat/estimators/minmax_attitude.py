"""Min-max attitude from interval data: the attitude that makes the worst pair's loss least, at its best in the boxes.

Pair i may be anywhere on the segment b_i + t_i radius_i, |t_i| <= 1; its loss at the attitude A(g) A(q0) is
|b_i + t_i radius_i - A(g) y_i|^2 / 2 with y_i = A(q0) r_i. Unknown are g, the Gibbs vector about a nominal attitude q0,
and the positions t. With seven pairs: 10 unknowns, 7 objectives, 20 bounds.
"""

from typing import Any

from optsat.kernels.minmax import minmax
from optsat.kernels.source import KernelSource
from optsat.port import Port

_RANGES = {"x0": (-1.0, 1.0), "goals": (-1.0, 1.0), "weights": (1e-6, 1e3), "lower": (-1.0, 0.0), "upper": (0.0, 1.0)}


def minmax_attitude(vectors: int = 7, gauss_newton: bool = False) -> KernelSource:
    """Return the kernel `minmax_attitude`, as `optsat.kernels.minmax.minmax` describes it, of `interval_losses`.

    x : Gibbs vector g in B, then the position of each pair in its box; q_BN = [g; 1] (x) q0 normalised
    b_B, radius_B : middle of each measured direction and how far it may be off, in B; y_B : A(q0) r_N

    Flight code takes bounds on either side of zero, and weights above it.

    vectors : number of pairs
    gauss_newton : leave out the curvature of the errors themselves

    Source: robust Wahba specification, sections 3 and 9, with a position shared by the components of a pair.
    """
    import casadi as ca

    x = ca.SX.sym("x", 3 + vectors)
    b_B, radius_B, y_B = (ca.SX.sym(name, vectors, 3) for name in ("b_B", "radius_B", "y_B"))
    errors = [
        (b_B[i, :] + x[3 + i] * radius_B[i, :]).T - _turned(x[:3], y_B[i, :].T)
        for i in range(vectors if gauss_newton else 0)
    ]
    return minmax(
        "minmax_attitude",
        x,
        interval_losses(x, b_B, radius_B, y_B),
        parameters=[
            (Port("b_B", (vectors, 3), "-", lower=-2.0, upper=2.0), b_B),
            (Port("radius_B", (vectors, 3), "-", lower=0.0, upper=2.0), radius_B),
            (Port("y_B", (vectors, 3), "-", unit_norm=1e-3), y_B),
        ],
        residuals=errors,
        ranges=_RANGES,
    )


def interval_losses(x: Any, b_B: Any, radius_B: Any, y_B: Any) -> Any:
    """Return the losses (m,) of the pairs as CasADi expressions.

    x : (3 + m,) Gibbs vector and positions; b_B, radius_B, y_B : (m, 3)
    About g = 0 the loss is |c - y|^2 / 2 - c . (A(g) - I) y, c = b + t radius, without cancellation.
    """
    import casadi as ca

    g = x[:3]
    square = ca.dot(g, g)
    losses = []
    for i in range(b_B.rows()):
        c, y = (b_B[i, :] + x[3 + i] * radius_B[i, :]).T, y_B[i, :].T
        apart = c - y
        turn = ca.dot(g, c) * ca.dot(g, y) - square * ca.dot(c, y) + ca.dot(g, ca.cross(c, y))
        losses.append(ca.dot(apart, apart) / 2 - 2 / (1 + square) * turn)
    return ca.vertcat(*losses)


def _turned(g: Any, y: Any) -> Any:
    """Return A(g) y."""
    import casadi as ca

    square = ca.dot(g, g)
    return ((1 - square) * y + 2 * g * ca.dot(g, y) - 2 * ca.cross(g, y)) / (1 + square)
