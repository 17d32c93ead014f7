"""Min-max problems of the literature in closed form."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.problems.reference_problem import ReferenceProblem


def _exp(value: Any) -> Any:
    import casadi as ca

    return ca.exp(value)


def _squares(x: Any, count: int | None = None) -> Any:
    return sum(x[i] ** 2 for i in range(count or x.numel()))


def _cb(x: Any, first: Any) -> list[Any]:
    return [first, (2 - x[0]) ** 2 + (2 - x[1]) ** 2, 2 * _exp(x[1] - x[0])]


def _ql(x: Any) -> list[Any]:
    q = _squares(x)
    return [q, q + 10 * (4 - 4 * x[0] - x[1]), q + 10 * (6 - x[0] - 2 * x[1])]


def _madsen(x: Any) -> list[Any]:
    import casadi as ca

    return [x[0] ** 2 + x[1] ** 2 + x[0] * x[1], ca.sin(x[0]), ca.cos(x[1])]


def _madsen_shifted(x: Any) -> list[Any]:
    first, second, third = _madsen(x)
    return [first - 1, second, -third]


def _madsen_exponential(x: Any) -> list[Any]:
    import casadi as ca

    return [-ca.exp(x[0] - x[1]), ca.sinh(x[0] - 1) - 1, -ca.log(x[1]) - 1]


def _womersley_fletcher(x: Any) -> list[Any]:
    ratio = 10 * x[0] / (x[0] + 0.1)
    return [(x[0] + ratio) / 2 + x[1] ** 2, (-x[0] + ratio) / 2 + x[1] ** 2, (x[0] - ratio) / 2 + x[1] ** 2]


def _spiral(x: Any) -> list[Any]:
    import casadi as ca

    r = ca.sqrt(_squares(x))
    return [(x[0] - r * ca.cos(r)) ** 2 + 0.005 * r**2, (x[1] - r * ca.sin(r)) ** 2 + 0.005 * r**2]


def _evd52(x: Any) -> list[Any]:
    return [
        _squares(x) - 1,
        x[0] ** 2 + x[1] ** 2 + (x[2] - 2) ** 2,
        x[0] + x[1] + x[2] - 1,
        x[0] + x[1] - x[2] + 1,
        2 * x[0] ** 3 + 6 * x[1] ** 2 + 2 * (5 * x[2] - x[0] + 1) ** 2,
        x[0] ** 2 - 9 * x[2],
    ]


def penalised(first: Any, constraints: Sequence[Any]) -> list[Any]:
    """Return f and f + 10 g_i: how the literature turns min f, g <= 0 into a min-max."""
    return [first, *(first + 10 * g for g in constraints)]


def _rosen_suzuki(x: Any) -> list[Any]:
    f = x[0] ** 2 + x[1] ** 2 + 2 * x[2] ** 2 + x[3] ** 2 - 5 * x[0] - 5 * x[1] - 21 * x[2] + 7 * x[3]
    return penalised(
        f,
        [
            _squares(x, 4) + x[0] - x[1] + x[2] - x[3] - 8,
            x[0] ** 2 + 2 * x[1] ** 2 + x[2] ** 2 + 2 * x[3] ** 2 - x[0] - x[3] - 10,
            2 * x[0] ** 2 + x[1] ** 2 + x[2] ** 2 + 2 * x[0] - x[1] - x[3] - 5,
        ],
    )


def _polak6(x: Any) -> list[Any]:
    import casadi as ca

    y = x[0] - (x[3] + 1) ** 4
    return _rosen_suzuki(ca.vertcat(y, x[1] - y**4, x[2], x[3]))


def _polak2(x: Any) -> list[Any]:
    rest = 1e-8 * x[0] ** 2 + x[2] ** 2 + 4 * x[3] ** 2 + sum(x[i] ** 2 for i in range(4, 10))
    return [_exp(rest + (x[1] + 2) ** 2), _exp(rest + (x[1] - 2) ** 2)]


def _polak3(x: Any) -> list[Any]:
    return [sum(_exp((x[j] - np.sin(i - 1 + 2 * j)) ** 2) / (i + j) for j in range(11)) for i in range(1, 11)]


def _wong1(x: Any) -> list[Any]:
    f = (
        (x[0] - 10) ** 2
        + 5 * (x[1] - 12) ** 2
        + x[2] ** 4
        + 3 * (x[3] - 11) ** 2
        + 10 * x[4] ** 6
        + 7 * x[5] ** 2
        + x[6] ** 4
        - 4 * x[5] * x[6]
        - 10 * x[5]
        - 8 * x[6]
    )
    return penalised(
        f,
        [
            2 * x[0] ** 2 + 3 * x[1] ** 4 + x[2] + 4 * x[3] ** 2 + 5 * x[4] - 127,
            7 * x[0] + 3 * x[1] + 10 * x[2] ** 2 + x[3] - x[4] - 282,
            23 * x[0] + x[1] ** 2 + 6 * x[5] ** 2 - 8 * x[6] - 196,
            4 * x[0] ** 2 + x[1] ** 2 - 3 * x[0] * x[1] + 2 * x[2] ** 2 + 5 * x[5] - 11 * x[6],
        ],
    )


def _wong2(x: Any) -> list[Any]:
    first, rows = _wong_core(x)
    return penalised(first + 45, rows)


def _wong_core(x: Any) -> tuple[Any, list[Any]]:
    f = (
        x[0] ** 2
        + x[1] ** 2
        + x[0] * x[1]
        - 14 * x[0]
        - 16 * x[1]
        + (x[2] - 10) ** 2
        + 4 * (x[3] - 5) ** 2
        + (x[4] - 3) ** 2
        + 2 * (x[5] - 1) ** 2
        + 5 * x[6] ** 2
        + 7 * (x[7] - 11) ** 2
        + 2 * (x[8] - 10) ** 2
        + (x[9] - 7) ** 2
    )
    rows = [
        3 * (x[0] - 2) ** 2 + 4 * (x[1] - 3) ** 2 + 2 * x[2] ** 2 - 7 * x[3] - 120,
        5 * x[0] ** 2 + 8 * x[1] + (x[2] - 6) ** 2 - 2 * x[3] - 40,
        (x[0] - 8) ** 2 / 2 + 2 * (x[1] - 4) ** 2 + 3 * x[4] ** 2 - x[5] - 30,
        x[0] ** 2 + 2 * (x[1] - 2) ** 2 - 2 * x[0] * x[1] + 14 * x[4] - 6 * x[5],
        4 * x[0] + 5 * x[1] - 3 * x[6] + 9 * x[7] - 105,
        10 * x[0] - 8 * x[1] - 17 * x[6] + 2 * x[7],
        -3 * x[0] + 6 * x[1] + 12 * (x[8] - 8) ** 2 - 7 * x[9],
        -8 * x[0] + 2 * x[1] + 5 * x[8] - 2 * x[9] - 12,
    ]
    return f, rows


def _wong3(x: Any) -> list[Any]:
    first, rows = _wong_core(x)
    f = (
        first
        + (x[10] - 9) ** 2
        + 10 * (x[11] - 1) ** 2
        + 5 * (x[12] - 7) ** 2
        + 4 * (x[13] - 14) ** 2
        + 27 * (x[14] - 1) ** 2
        + x[15] ** 4
        + (x[16] - 2) ** 2
        + 13 * (x[17] - 2) ** 2
        + (x[18] - 3) ** 2
        + x[19] ** 2
        + 95
    )
    more = [
        x[0] + x[1] + 4 * x[10] - 21 * x[11],
        x[0] ** 2 + 5 * x[10] - 8 * x[11] - 28,
        4 * x[0] + 9 * x[1] + 5 * x[12] ** 2 - 9 * x[13] - 87,
        3 * x[0] + 4 * x[1] + 3 * (x[12] - 6) ** 2 - 14 * x[13] - 10,
        14 * x[0] ** 2 + 35 * x[14] - 79 * x[15] - 92,
        15 * x[1] ** 2 + 11 * x[14] - 61 * x[15] - 54,
        5 * x[0] ** 2 + 2 * x[1] + 9 * x[16] ** 4 - x[17] - 68,
        x[0] ** 2 - x[1] + 19 * x[18] - 20 * x[19] + 19,
        7 * x[0] ** 2 + 5 * x[1] ** 2 + x[18] ** 2 - 30 * x[19],
    ]
    return penalised(f, [*rows, *more])


def _pentagon(x: Any) -> list[Any]:
    import casadi as ca

    pairs = ((0, 2), (2, 4), (4, 0))
    return [-ca.sqrt((x[i] - x[j]) ** 2 + (x[i + 1] - x[j + 1]) ** 2) for i, j in pairs]


def _pentagon_sides() -> Array:
    angle = 2 * np.pi * np.arange(5) / 5
    return np.asarray(np.kron(np.eye(3), np.column_stack((np.cos(angle), np.sin(angle)))), dtype=np.float64)


def _shor(x: Any) -> list[Any]:
    centres = ["00000", "21113", "12112", "14122", "32101", "02101", "11111", "10121", "00210", "11200"]
    factors = (1, 5, 10, 2, 4, 3, 1.7, 2.5, 6, 3.5)
    return [
        factor * sum((x[j] - int(centre[j])) ** 2 for j in range(5))
        for factor, centre in zip(factors, centres, strict=True)
    ]


def _maxquad(x: Any) -> list[Any]:
    n = 10
    objectives = []
    for k in range(1, 6):
        A = np.zeros((n, n))
        for i in range(1, n + 1):
            for j in range(i + 1, n + 1):
                A[i - 1, j - 1] = A[j - 1, i - 1] = np.exp(i / j) * np.cos(i * j) * np.sin(k)
        for i in range(1, n + 1):
            A[i - 1, i - 1] = i / 10 * abs(np.sin(k)) + np.sum(np.abs(A[i - 1]))
        b = [np.exp(i / k) * np.sin(i * k) for i in range(1, n + 1)]
        objectives.append(
            sum(A[i, j] * x[i] * x[j] for i in range(n) for j in range(n)) - sum(b[i] * x[i] for i in range(n))
        )
    return objectives


def _doc_minimax(x: Any) -> list[Any]:
    return [
        2 * x[0] ** 2 + x[1] ** 2 - 48 * x[0] - 40 * x[1] + 304,
        -(x[0] ** 2) - 3 * x[1] ** 2,
        x[0] + 3 * x[1] - 18,
        -x[0] - x[1],
        x[0] + x[1] - 8,
    ]


def _goffin(x: Any) -> list[Any]:
    total = sum(x[i] for i in range(20))
    return [20 * x[i] - total for i in range(20)]


_HALF = tuple(float(i) if i <= 10 else -float(i) for i in range(1, 21))
_LV = "Luksan & Vlcek (2000), report 798"
_CC = "Charalambous & Conn (1978)"

MINIMAX = (
    ReferenceProblem(
        "CB2", lambda x: _cb(x, x[0] ** 2 + x[1] ** 4), (1, -0.1), 1.9522245, 1.9522244938707, _CC, convex=True
    ),
    ReferenceProblem("CB3", lambda x: _cb(x, x[0] ** 4 + x[1] ** 2), (2, 2), 2, 2, _CC, convex=True),
    ReferenceProblem(
        "DEM",
        lambda x: [5 * x[0] + x[1], -5 * x[0] + x[1], x[0] ** 2 + x[1] ** 2 + 4 * x[1]],
        (1, 1),
        -3,
        -3,
        "Demyanov & Malozemov (1974)",
        convex=True,
    ),
    ReferenceProblem("QL", _ql, (-1, 5), 7.2, 7.2, _LV, convex=True),
    ReferenceProblem(
        "LQ",
        lambda x: [-x[0] - x[1], -x[0] - x[1] + x[0] ** 2 + x[1] ** 2 - 1],
        (-0.5, -0.5),
        -1.4142136,
        -np.sqrt(2),
        _LV,
        convex=True,
    ),
    ReferenceProblem(
        "Mifflin 1",
        lambda x: [-x[0], -x[0] + 20 * (x[0] ** 2 + x[1] ** 2 - 1)],
        (0.8, 0.6),
        -1,
        -1,
        "Mifflin (1977)",
        convex=True,
    ),
    ReferenceProblem(
        "Crescent",
        lambda x: [
            x[0] ** 2 + (x[1] - 1) ** 2 + x[1] - 1,
            -(x[0] ** 2) - (x[1] - 1) ** 2 + x[1] + 1,
        ],
        (-1.5, 2),
        0,
        0,
        "Kiwiel (1985)",
    ),
    ReferenceProblem(
        "Polak 1",
        lambda x: [_exp(x[0] ** 2 / 1000 + (x[1] - 1) ** 2), _exp(x[0] ** 2 / 1000 + (x[1] + 1) ** 2)],
        (50, 0.05),
        2.7182818,
        math.e,
        "Polak, Mayne & Higgins (1991)",
        convex=True,
    ),
    ReferenceProblem("Polak 2", _polak2, (100, *(0.1,) * 9), 54.598150, np.exp(4), "Polak & al. (1991)", convex=True),
    ReferenceProblem("Polak 3", _polak3, (1,) * 11, 3.70348, 3.7034827173494, "Polak & al. (1991)", convex=True),
    ReferenceProblem("Polak 6", _polak6, (0, 0, 0, 0), -44, -44, "Polak & al. (1991)"),
    ReferenceProblem("Madsen", _madsen, (3, 1), 0.61643244, 0.61643243556079, "Madsen (1975)", {"absolute": True}),
    ReferenceProblem("WF", _womersley_fletcher, (3, 1), 0, 0, "Womersley & Fletcher (1986)"),
    ReferenceProblem("Spiral", _spiral, (1.41831, -4.79462), 0, 0, "Rustem & Nguyen (1998)"),
    ReferenceProblem("EVD52", _evd52, (1, 1, 1), 3.5997193, 3.5997192998262, "Vardi (1992)"),
    ReferenceProblem("Rosen-Suzuki", _rosen_suzuki, (0, 0, 0, 0), -44, -44, _CC, convex=True),
    ReferenceProblem("Wong 1", _wong1, (1, 2, 0, 4, 0, 1, 1), 680.63006, 680.6300573744, "Asaadi (1973)"),
    ReferenceProblem(
        "Wong 2", _wong2, (2, 3, 5, 5, 1, 2, 7, 3, 6, 10), 24.306209, 24.30620906818, "Asaadi (1973)", convex=True
    ),
    ReferenceProblem(
        "Wong 3",
        _wong3,
        (2, 3, 5, 5, 1, 2, 7, 3, 6, 10, 2, 2, 6, 15, 1, 2, 1, 2, 1, 3),
        133.72828,
        93.905247964948,
        "Asaadi (1973)",
        convex=True,
        doubt=(
            "The functions as printed have the proven optimum 93.905248 (92.764755 with x9 for x2 in the last row but "
            "one, as some sources print it); linear rows as constraints change neither."
        ),
    ),
    ReferenceProblem("Shor", _shor, (0, 0, 0, 0, 1), 22.600162, 22.600162095771, "Shor (1985)", convex=True),
    ReferenceProblem("Maxquad", _maxquad, (1,) * 10, -0.8414083, -0.84140833459641, "Lemarechal (1978)", convex=True),
    ReferenceProblem("Maxq", lambda x: [x[i] ** 2 for i in range(20)], _HALF, 0, 0, "Schramm (1989)", convex=True),
    ReferenceProblem(
        "Maxl", lambda x: [x[i] for i in range(20)], _HALF, 0, 0, "Schramm (1989)", {"absolute": True}, convex=True
    ),
    ReferenceProblem("Goffin", _goffin, tuple(i - 10.5 for i in range(1, 21)), 0, 0, "Makela (1993)", convex=True),
    ReferenceProblem("Mad 1", _madsen_shifted, (1, 2), -0.38965952, -0.38965951609724, _LV, {"A": [-1, -1], "b": -0.5}),
    ReferenceProblem("Mad 2", _madsen_shifted, (-2, -1), -0.33035714, -0.330357142857, _LV, {"A": [3, 1], "b": -2.5}),
    ReferenceProblem(
        "Mad 4", _madsen_exponential, (-1, 0.01), -0.44891079, -0.44891078610662, _LV, {"A": [-0.05, 1], "b": 0.5}
    ),
    ReferenceProblem(
        "Mad 5", _madsen_exponential, (-1, 3), -0.42928061, -0.4292806146198, _LV, {"A": [0.9, -1], "b": -1}
    ),
    ReferenceProblem(
        "Pentagon",
        _pentagon,
        (-1, 0, 0, -1, 1, 1),
        -1.85961870,
        -1.8596186959416,
        _LV,
        {"A": _pentagon_sides(), "b": np.ones(15)},
    ),
    ReferenceProblem("doc minimax", _doc_minimax, (0.1, 0.1), 0, 0, "fminimax reference page"),
    ReferenceProblem(
        "doc minimax, absolute",
        _doc_minimax,
        (0.1, 0.1),
        37.2356,
        37.235553527554,
        "fminimax reference page",
        {"absolute": True},
    ),
    ReferenceProblem(
        "doc goal",
        lambda x: [2 + (x[0] - 3) ** 2, 5 + x[0] ** 2 / 4],
        (1,),
        0,
        0,
        "fgoalattain reference page",
        {"goals": (3, 6), "weights": (1, 1)},
        convex=True,
    ),
    ReferenceProblem(
        "doc goal, linear constraint",
        lambda x: [
            2 + (x[0] - 2) ** 2 + (x[1] - 3) ** 2,
            5 + ((x[0] - 4) ** 2 + (x[1] - 1) ** 2) / 4,
        ],
        (1, 1),
        float("nan"),
        0.14835622795749,
        "fgoalattain reference page",
        {"goals": (3, 6), "weights": (1, 1), "A": [1, 1], "b": 4},
        convex=True,
    ),
)
