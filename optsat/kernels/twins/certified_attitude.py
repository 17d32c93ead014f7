"""Certified attitude: the twin of `certified_attitude.c`."""

import math
import sys

import numpy as np

from optsat.arrays import Array
from optsat.kernels.source import Twin
from optsat.kernels.status import Status
from optsat.kernels.twins.certified_attitude_ball import EPSILON, Ball, Pairs, cross, dot, enclose
from optsat.kernels.twins.certified_attitude_programme import Programme

GRANTED = 1e-12
"""Mismatch beyond the bounds that is granted to rounding of the data [rad], as everywhere in optsat."""
PASSES = 3


def roundoffs(n: int) -> float:
    """Return what rounding may cost in the sum over n vectors, in spacings of numbers at 1."""
    return 1.04 * (n + 10)


def twin(n: int, iterations: int) -> Twin:
    """Return attitude, bound, weights and status of n vectors of bounded error."""

    def run(x: Array) -> tuple[int, Array]:
        y = np.zeros(6 + n)
        y[3], y[4], y[5 + n] = 1.0, math.pi, 1.0
        with np.errstate(all="ignore"):
            status, rows, pairs, bound = _load(n, x)
            if status is Status.OK and rows[0] >= 0:
                consistent = _agree(pairs, bound)
                best, weights = _search(pairs, iterations if consistent else 0)
                consistent = consistent and not best.empty
                y[:4] = best.q_BN
                if consistent and best.bounded:
                    y[4] = _angle(best.tangent_square)
                    y[5 + n] = 0.0
                elif not consistent:
                    y[5 + n] = 2.0
                for row, weight in zip(rows, weights, strict=True):
                    y[5 + row] += weight
        return status, y

    return run


def _load(n: int, x: Array) -> tuple[Status, list[int], Pairs, list[float]]:
    b, r, bound = x[: 3 * n].reshape(n, 3), x[3 * n : 6 * n].reshape(n, 3), x[6 * n :].tolist()
    told = [i for i in range(n) if bound[i] < math.pi]
    rows: list[int] = []
    status = Status.OK
    left: list[list[float]] = []
    right: list[list[float]] = []
    for i in range(n):
        row = i if bound[i] < math.pi else (told[0] if told else -1)
        finite = math.isfinite(bound[i]) and (row < 0 or bool(np.isfinite([*b[row], *r[row]]).all()))
        usable = [True, True]
        for k, (source, into) in enumerate(((b, left), (r, right))):
            vector = source[row].tolist() if finite and row >= 0 else [1.0, 0.0, 0.0]
            largest = max(abs(vector[0]), abs(vector[1]), abs(vector[2]))
            usable[k] = largest > 0.0
            into.append(_unit(vector, largest) if usable[k] else vector)
        if not finite:
            status = Status.NOT_FINITE
        elif status is Status.OK and not 0.0 <= bound[i] <= math.pi:
            status = Status.RANGE
        elif status is Status.OK and not all(usable):
            status = Status.NOT_UNIT
        rows.append(row)
    kept = [math.pi if row < 0 else bound[row] for row in rows]
    half_sine = [_sine(0.5 * each) for each in kept]
    return status, rows, Pairs(left, right, half_sine, roundoffs(n) * EPSILON), kept


def _unit(vector: list[float], largest: float) -> list[float]:
    v = [entry / largest for entry in vector]
    length = math.sqrt((v[0] * v[0] + v[1] * v[1]) + v[2] * v[2])
    return [entry / length for entry in v]


def _agree(pairs: Pairs, bound: list[float]) -> bool:
    largest = -1.0
    for i in range(len(bound)):
        for j in range(i):
            largest = max(largest, _excess(pairs, bound, i, j))
    granted = max(GRANTED, 16.0 * EPSILON)
    if 0.0 < largest <= granted:
        pairs.half_sine = [_sine(0.5 * min(each + granted, math.pi)) for each in bound]
    return largest <= granted


def _excess(pairs: Pairs, bound: list[float], i: int, j: int) -> float:
    b_i, b_j, r_i, r_j = pairs.b_B[i], pairs.b_B[j], pairs.r_N[i], pairs.r_N[j]
    if bound[i] + bound[j] >= math.pi:
        return -1.0
    sine_B, sine_N = (math.sqrt(dot(c, c)) for c in (cross(b_i, b_j), cross(r_i, r_j)))
    cosine_B, cosine_N = dot(b_i, b_j), dot(r_i, r_j)
    sine = abs(sine_B * cosine_N - cosine_B * sine_N)
    cosine = cosine_B * cosine_N + sine_B * sine_N
    half = pairs.half_sine[i], pairs.half_sine[j]
    cosine_i, cosine_j = (1.0 - (2.0 * h) * h for h in half)
    sine_i, sine_j = ((2.0 * h) * math.sqrt(1.0 - h * h) for h in half)
    sum_sine, sum_cosine = sine_i * cosine_j + cosine_i * sine_j, cosine_i * cosine_j - sine_i * sine_j
    excess = sine * sum_cosine - cosine * sum_sine
    beyond = cosine * sum_cosine + sine * sum_sine <= 0.0
    return math.copysign(1.0, excess) if beyond else excess


def _search(pairs: Pairs, iterations: int) -> tuple[Ball, list[float]]:
    weights = _heuristic_weights(pairs.half_sine)
    ball = enclose(pairs, weights)
    best, best_weights = ball, weights
    for _ in range(PASSES):
        if best.empty or iterations == 0:
            break
        programme = Programme(pairs, ball)
        found = programme.optimise(iterations)
        if found is None:
            break
        weights = found
        ball = enclose(pairs, weights)
        smaller = ball.bounded and ball.tangent_square < best.tangent_square
        if ball.empty or smaller:
            best, best_weights = ball, weights
        if not (ball.bounded and ball.tangent_square < 0.1 * (programme.scale * programme.scale)):
            break
    return best, best_weights


def _heuristic_weights(half_sine: list[float]) -> list[float]:
    widest = EPSILON
    for half in half_sine:
        widest = max(widest, half)
    least = math.sqrt(math.sqrt(EPSILON)) * widest
    shares = [least / max(half, least) for half in half_sine]
    total = 0.0
    for share in shares:
        total += share * share
    return [(share * share) / total for share in shares]


def _sine(x: float) -> float:
    total = 1.0
    for k in range(22, 0, -2):
        total = 1.0 - (x * x) * (total / float(k * (k + 1)))
    return x * total


def _angle(tangent_square: float) -> float:
    obtuse = tangent_square > 1.0
    t = math.sqrt(1.0 / tangent_square if obtuse else tangent_square)
    for _ in range(3):
        t = t / (1.0 + math.sqrt(1.0 + t * t))
    total = 0.0
    for k in range(17, 0, -2):
        total = 1.0 / float(k) - (t * t) * total
    acute = 16.0 * (t * total)
    angle = math.pi - acute if obtuse else acute
    return min(angle * (1.0 + 8.0 * sys.float_info.epsilon), math.pi)
