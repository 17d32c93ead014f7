"""Certified attitude: the twin of the part that proves a ball from given weights."""

import math
import sys
from dataclasses import dataclass

import numpy as np

EPSILON = sys.float_info.epsilon
UPPER = tuple((row, column) for column in range(3) for row in range(column + 1))
"""Entries of a symmetric 3 x 3 matrix in the order of the templates."""
SWEEPS = 8
Rows = list[list[float]]


@dataclass
class Pairs:
    """Unit vectors b_B, r_N (n, 3), sines of half their bounds (n,), and what rounding may cost."""

    b_B: Rows
    r_N: Rows
    half_sine: list[float]
    rounding: float


@dataclass
class Ball:
    """A ball of attitudes, and the inequalities (value, linear (3,), block (6,)) of the pairs about its centre."""

    q_BN: list[float]
    tangent_square: float
    bounded: bool
    empty: bool
    about: list[tuple[float, list[float], list[float]]]


def dot(a: list[float], b: list[float]) -> float:
    """Return a . b of two vectors of three."""
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]


def cross(a: list[float], b: list[float]) -> list[float]:
    """Return a x b."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def enclose(pairs: Pairs, weights: list[float]) -> Ball:
    """Return the ball that the weights prove, rounded outward."""
    u = pairs.rounding
    q = _attitude(pairs, weights)
    about = _centred(pairs, q)
    total, spread, pull, matrix = _sum(pairs, weights, about)
    vectors = _diagonalise(3, matrix)
    rough = _least_curvature(matrix)
    if rough > u and dot(pull, pull) > 1e-14 * (max(total, 0.0) * rough):
        q = _recentred(q, pull, matrix, vectors)
        about = _centred(pairs, q)
        total, spread, pull, matrix = _sum(pairs, weights, about)
        _diagonalise(3, matrix)
    curvature = _least_curvature(matrix)
    positive = max(curvature, sys.float_info.min)
    size = math.sqrt(dot(pull, pull)) + 2.0 * u
    mu = min(0.5 * positive, size * math.sqrt(positive / max(total, u * u)))
    s1 = (total + (size * size) / mu) + u * ((abs(total) + spread) + u)
    s2 = (mu - curvature) + 2.0 * u
    bounded = curvature > 0.0 and s2 < 0.0 and s1 <= sys.float_info.max
    square = max(s1, 0.0) / -s2 if bounded else sys.float_info.max
    return Ball(q, square, bounded, bounded and s1 < 0.0, about)


def _attitude(pairs: Pairs, weights: list[float]) -> list[float]:
    K = _davenport(pairs, weights)
    vectors = _diagonalise(4, K)
    first = 0
    for k in range(1, 4):
        first = k if K[k][k] > K[first][first] else first
    free = [k for k in range(4) if K[first][first] - K[k][k] <= 64.0 * EPSILON]
    scalar = 0.0
    for k in free:
        scalar = max(scalar, abs(vectors[3][k]))
    turnable = scalar > 64.0 * EPSILON
    q = []
    for i in range(4):
        entry = 0.0
        for k in range(4):
            share = vectors[3][k] if turnable else float(k == first)
            entry += share * vectors[i][k] if k in free else 0.0
        q.append(entry)
    return _normalised(q)


def _davenport(pairs: Pairs, weights: list[float]) -> Rows:
    B = np.zeros((3, 3))
    for b, r, weight in zip(np.array(pairs.b_B), np.array(pairs.r_N), weights, strict=True):
        B += (weight * b)[:, None] * r
    rows: Rows = B.tolist()
    trace = (rows[0][0] + rows[1][1]) + rows[2][2]
    z = [rows[1][2] - rows[2][1], rows[2][0] - rows[0][2], rows[0][1] - rows[1][0]]
    K = [[(rows[i][j] + rows[j][i]) - (trace if i == j else 0.0) for j in range(3)] + [z[i]] for i in range(3)]
    return [*K, [*z, trace]]


def _normalised(q: list[float]) -> list[float]:
    length = math.sqrt((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]))
    sign = q[3]
    for k in range(3):
        sign = sign if abs(sign) > 0.0 else q[k]
    divisor = -length if sign < 0.0 else length
    return [entry / divisor + 0.0 for entry in q]


def _diagonalise(n: int, a: Rows) -> Rows:
    vectors = [[float(i == j) for j in range(4)] for i in range(4)]
    rest = 1.0
    for _ in range(SWEEPS):
        if not rest > EPSILON * EPSILON:
            break
        rest = 0.0
        for q in range(1, n):
            for p in range(q):
                rest = max(rest, abs(a[p][q]))
                if abs(a[p][q]) > 0.0:
                    _rotate(n, p, q, a, vectors)
    return vectors


def _rotate(n: int, p: int, q: int, a: Rows, vectors: Rows) -> None:
    between = a[p][q]
    ratio = (a[q][q] - a[p][p]) / (2.0 * between)
    tangent = math.copysign(1.0 / (abs(ratio) + math.sqrt(ratio * ratio + 1.0)), ratio)
    cosine = 1.0 / math.sqrt(tangent * tangent + 1.0)
    sine = tangent * cosine
    a[p][p] -= tangent * between
    a[q][q] += tangent * between
    a[p][q] = a[q][p] = 0.0
    for k in range(n):
        if k not in (p, q):
            at_p, at_q = cosine * a[k][p] - sine * a[k][q], sine * a[k][p] + cosine * a[k][q]
            a[k][p] = a[p][k] = at_p
            a[k][q] = a[q][k] = at_q
        row = vectors[k]
        row[p], row[q] = cosine * row[p] - sine * row[q], sine * row[p] + cosine * row[q]


def _dcm(q: list[float]) -> Rows:
    x, y, z, w = q
    return [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
        [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
        [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]


def _centred(pairs: Pairs, q: list[float]) -> list[tuple[float, list[float], list[float]]]:
    dcm = _dcm(q)
    about = []
    for b, r, half in zip(pairs.b_B, pairs.r_N, pairs.half_sine, strict=True):
        versine = (2.0 * half) * half
        y = [dot(row, r) for row in dcm]
        gap = [b[k] - y[k] for k in range(3)]
        level = dot(b, y) + (1.0 - versine)
        block = [(b[i] * y[j] + y[i] * b[j]) - (level if i == j else 0.0) for i, j in UPPER]
        about.append((versine - 0.5 * dot(gap, gap), cross(b, y), block))
    return about


def _sum(
    pairs: Pairs, weights: list[float], about: list[tuple[float, list[float], list[float]]]
) -> tuple[float, float, list[float], Rows]:
    total, spread, pull = 0.0, 0.0, [0.0, 0.0, 0.0]
    matrix = [[0.0] * 3 for _ in range(3)]
    for weight, half, (value, linear, block) in zip(weights, pairs.half_sine, about, strict=True):
        total += weight * value
        spread += weight * (2.0 * half)
        for k in range(3):
            pull[k] += weight * linear[k]
        for entry, (row, column) in zip(block, UPPER, strict=True):
            matrix[row][column] -= weight * entry
    for row, column in UPPER:
        matrix[column][row] = matrix[row][column]
    return total, spread, pull, matrix


def _least_curvature(matrix: Rows) -> float:
    least = sys.float_info.max
    for i in range(3):
        edge = matrix[i][i]
        for j in range(3):
            edge -= 0.0 if i == j else abs(matrix[i][j])
        least = min(least, edge)
    return least


def _recentred(q: list[float], pull: list[float], matrix: Rows, vectors: Rows) -> list[float]:
    turn = [0.0, 0.0, 0.0]
    for k in range(3):
        share = 0.0
        for i in range(3):
            share += vectors[i][k] * pull[i]
        share = share / matrix[k][k]
        for i in range(3):
            turn[i] += share * vectors[i][k]
    across, scalar = cross(turn, q), q[3]
    turned = [(q[k] + scalar * turn[k]) - across[k] for k in range(3)]
    return _normalised([*turned, scalar - dot(turn, q)])
