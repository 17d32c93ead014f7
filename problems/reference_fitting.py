"""Chebyshev fits of the literature: the largest residual of a model over sampled data, or over a sampled function."""

from collections.abc import Callable
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.problems.reference_problem import ReferenceProblem

_LV = "Luksan & Vlcek (2000), report 798"
_BARD_Y = (0.14, 0.18, 0.22, 0.25, 0.29, 0.32, 0.35, 0.39, 0.37, 0.58, 0.73, 0.96, 1.34, 2.10, 4.39)
_KOWALIK_U = (4, 2, 1, 0.5, 0.25, 0.167, 0.125, 0.1, 0.0833, 0.0714, 0.0625)
_KOWALIK_Y = (0.1957, 0.1947, 0.1735, 0.1600, 0.0844, 0.0627, 0.0456, 0.0342, 0.0323, 0.0235, 0.0246)
# in thousandths, at t = 0, 0.1, ...
_OSBORNE_Y = """
1366 1191 1112 1013 991 885 831 847 786 725 746 679 608 655 616 606 602 626 651 724 649 649 694 644 624 661 612 558 533
495 500 423 395 375 372 391 396 405 428 429 523 562 607 653 672 708 633 668 645 632 591 559 597 625 739 710 729 720 636
581 428 292 162 98 54
"""


def fit(model: Callable[[Any, float], Any], t: Array, y: Array | tuple[float, ...]) -> Callable[[Any], list[Any]]:
    """Return the residuals of a model of (x, t) at the samples."""
    return lambda x: [model(x, float(at)) - float(value) for at, value in zip(t, y, strict=True)]


def _exp(value: Any) -> Any:
    import casadi as ca

    return ca.exp(value)


def _sin(value: Any) -> Any:
    import casadi as ca

    return ca.sin(value)


def _cos(value: Any) -> Any:
    import casadi as ca

    return ca.cos(value)


def _davidon(x: Any) -> list[Any]:
    times = 0.2 * np.arange(1, 21)
    return [(x[0] + x[1] * t - np.exp(t)) ** 2 + (x[2] + x[3] * np.sin(t) - np.cos(t)) ** 2 for t in map(float, times)]


def _bard(x: Any, u: float) -> Any:
    return x[0] + u / ((16 - u) * x[1] + min(u, 16 - u) * x[2])


def _kowalik(x: Any, u: float) -> Any:
    return x[0] * (u * u + u * x[1]) / (u * u + u * x[2] + x[3])


def _rational(x: Any, t: float) -> Any:
    return (x[0] + x[1] * t) / (1 + x[2] * t + x[3] * t**2 + x[4] * t**3)


def _rational_square(x: Any, t: float) -> Any:
    return (x[0] + x[1] * t + x[2] * t**2) / (1 + x[3] * t + x[4] * t**2)


def _damped_waves(x: Any, t: float) -> Any:
    return x[0] * _exp(-x[1] * t) * _cos(x[2] * t + x[3]) + x[4] * _exp(-x[5] * t)


def _osborne(x: Any, t: float) -> Any:
    return x[0] * _exp(-x[4] * t) + sum(x[k] * _exp(-x[4 + k] * (t - x[7 + k]) ** 2) for k in (1, 2, 3))


def _watson(x: Any) -> list[Any]:
    rows = [x[0], x[1] - x[0] ** 2 - 1]
    for i in range(2, 31):
        t = (i - 1) / 29
        slope = sum((j - 1) * x[j - 1] * t ** (j - 2) for j in range(2, 21))
        rows.append(slope - sum(x[j - 1] * t ** (j - 1) for j in range(1, 21)) ** 2 - 1)
    return rows


_PBC3_T = np.arange(21) / 2
_PBC3_Y = (
    3 / 20 * np.exp(-_PBC3_T)
    + 1 / 52 * np.exp(-5 * _PBC3_T)
    - 1 / 65 * np.exp(-2 * _PBC3_T) * (3 * np.sin(2 * _PBC3_T) + 11 * np.cos(2 * _PBC3_T))
)
_PBC1_T = -1 + 2 * np.arange(30) / 29
_PBC1_Y = np.sqrt((8 * _PBC1_T - 1) ** 2 + 1) * np.arctan(8 * _PBC1_T) / (8 * _PBC1_T)
_OET5_T = 0.25 + 0.75 * np.arange(21) / 20
_OET6_T = -0.5 + np.arange(21) / 20
_EXP_T = -1 + np.arange(21) / 10
_EVD61_T: Array = np.arange(51.0) / 10
_EVD61_Y = (
    0.5 * np.exp(-_EVD61_T)
    - np.exp(-2 * _EVD61_T)
    + 0.5 * np.exp(-3 * _EVD61_T)
    + 1.5 * np.exp(-1.5 * _EVD61_T) * np.sin(7 * _EVD61_T)
    + np.exp(-2.5 * _EVD61_T) * np.sin(5 * _EVD61_T)
)
_OSBORNE_T = np.arange(65) / 10


def _fitting(
    name: str,
    objectives: Callable[[Any], list[Any]],
    start: tuple[float, ...],
    published: float,
    optimum: float,
    source: str = _LV,
    doubt: str = "",
) -> ReferenceProblem:
    return ReferenceProblem(name, objectives, start, published, optimum, source, {"absolute": True}, doubt=doubt)


FITTING = (
    ReferenceProblem("Davidon 2", _davidon, (25, 5, -5, -1), 115.70644, 115.70643952101, _LV, convex=True),
    _fitting("Bard", fit(_bard, np.arange(1.0, 16.0), _BARD_Y), (1, 1, 1), 0.050816327, 0.050816326530612),
    _fitting(
        "Kowalik-Osborne",
        fit(_kowalik, np.array(_KOWALIK_U), _KOWALIK_Y),
        (0.25, 0.39, 0.415, 0.39),
        0.0080843684,
        0.00808436838604,
    ),
    _fitting(
        "OET5",
        fit(lambda x, t: x[3] - (x[0] * t**2 + x[1] * t + x[2]) ** 2, _OET5_T, np.sqrt(_OET5_T)),
        (1, 1, 1, 1),
        0.0026359735,
        0.0026359734973684,
    ),
    _fitting(
        "OET6",
        fit(lambda x, t: x[0] * _exp(x[2] * t) + x[1] * _exp(x[3] * t), _OET6_T, 1 / (1 + _OET6_T)),
        (1, 1, -3, -1),
        0.0020160753,
        0.0020160753793936,
    ),
    _fitting("EXP", fit(_rational, _EXP_T, np.exp(_EXP_T)), (0.5, 0, 0, 0, 0), 0.00012237125, 0.00012237125114778),
    _fitting("PBC1", fit(_rational_square, _PBC1_T, _PBC1_Y), (0, -1, 10, 1, 10), 0.022340496, 0.022340496047726),
    _fitting(
        "PBC3",
        fit(lambda x, t: x[2] / x[1] * _exp(-x[0] * t) * _sin(x[1] * t), _PBC3_T, _PBC3_Y),
        (1, 1, 1),
        0.0042021427,
        0.0042021426721523,
    ),
    _fitting(
        "EVD61",
        fit(_damped_waves, _EVD61_T, _EVD61_Y),
        (2, 2, 7, 0, -2, 1),
        0.034904926,
        0.034904926536381,
        "Vardi (1992)",
    ),
    _fitting(
        "Osborne 2",
        fit(_osborne, _OSBORNE_T, tuple(float(y) / 1000 for y in _OSBORNE_Y.split())),
        (1.3, 0.65, 0.65, 0.7, 0.6, 3, 5, 7, 2, 4.5, 5.5),
        0.048027401,
        0.048027400712575,
    ),
    _fitting(
        "Watson",
        _watson,
        (0,) * 20,
        1.4743027e-8,
        0.0,
        doubt="Several solvers reach below 1e-9; 0 stands for the optimum, to 1e-7.",
    ),
)
