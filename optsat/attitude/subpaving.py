"""Subpaving: cells of a Gibbs chart that no constraint excludes; they hold the admissible set and show its shape.

A cell is dropped only when some constraint is negative on all of it: f(centre) + h |grad f|_1 + h^2 sum |G| <
-rounding.
The procedure has no choice in it, so running it again is its own check.
"""

import numpy as np

from optsat.arrays import Array
from optsat.attitude.gibbs_chart import GibbsChart, ball_levels

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
_CELL_LIMIT = 60_000


def remaining_cells(chart: GibbsChart, levels: int, pad: float = 1.0 + 1e-9) -> tuple[Array, float]:
    """Return centres (k, 3) and half width of the cells of [-pad, pad]^3 that no constraint excludes.

    Stops halving before more than 60,000 cells would be kept; fewer levels are coarser, never wrong.
    """
    centres, half = np.zeros((1, 3)), pad
    curve = np.abs(chart.G).sum(axis=(1, 2))
    for _ in range(levels):
        if 8 * len(centres) > 8 * _CELL_LIMIT:
            break
        half /= 2
        centres = (centres[:, None, :] + half * CORNERS).reshape(-1, 3)
        inside = np.linalg.norm(np.maximum(np.abs(centres) - half, 0.0), axis=1) <= pad
        centres = centres[inside]
        slopes = 2 * np.abs(chart.h + np.einsum("nij,kj->kni", chart.G, centres)).sum(axis=-1)
        highest = chart.values(centres) + half * slopes + half**2 * curve
        centres = centres[np.all(highest >= -2 * chart.rounding, axis=1)]
    return centres, half


def farthest_level(chart: GibbsChart, centres: Array, half: float, centre: Array) -> float:
    """Return the largest ball level over all corners of the cells, seen from chart point `centre`."""
    worst = 0.0
    for corner in CORNERS:
        worst = max(worst, float(np.max(ball_levels(centres + half * corner, centre, chart.scale), initial=0.0)))
    return worst * (1 + 1e-12)


def chart_point(chart: GibbsChart, q_BN: Array) -> Array:
    """Return the chart point (3,) of an attitude."""
    v, s = chart.q_BN[:3], chart.q_BN[3]
    error = q_BN[3] * -v + s * q_BN[:3] - np.cross(q_BN[:3], -v)
    scalar = q_BN[3] * s + q_BN[:3] @ v
    return np.asarray(error / (scalar * chart.scale))
