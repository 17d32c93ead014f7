"""Curvature: which results of a scalar function are surely convex or concave, by the rules of composition.

Every value is split into a quadratic, a weighted sum of Euclidean norms of affine vectors, and a rest of known
curvature; polynomials are compared by eigenvalues, so (x - y)^2 written out is still seen to be convex.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError
from optsat.kernels.instructions import read_instructions
from optsat.kernels.program import Constant, Input

# eigenvalues above minus this fraction of the largest count as >= 0
_ROUNDING = 1e-13
# numbers held in the quadratics of all instructions
_LARGEST = 50_000_000


class Rest(Enum):
    """Curvature of what is neither quadratic nor a norm."""

    NONE = 0
    CONVEX = 1
    CONCAVE = -1
    UNKNOWN = 2


@dataclass(frozen=True)
class Norm:
    """sqrt(|L x + e|^2 + level), level >= 0."""

    L: Array
    e: Array
    level: float


@dataclass(frozen=True)
class Shape:
    """value = 1/2 x' Q x + c' x + d + sum factor norm(x) + rest, and low <= value <= high on the bounds of x."""

    Q: Array
    c: Array
    d: float
    norms: tuple[tuple[float, Norm], ...]
    rest: Rest
    low: float
    high: float

    @property
    def constant(self) -> bool:
        """Whether the value does not depend on x."""
        return self.affine and not self.c.any()

    @property
    def affine(self) -> bool:
        """Whether the value is affine in x."""
        return self.quadratic and not self.Q.any()

    @property
    def quadratic(self) -> bool:
        """Whether the value is a polynomial of degree 2."""
        return not self.norms and self.rest is Rest.NONE

    @property
    def convex(self) -> bool:
        """Whether the value is surely convex in x."""
        return (
            self.rest in (Rest.NONE, Rest.CONVEX)
            and all(factor >= 0 for factor, _ in self.norms)
            and positive_semidefinite(self.Q)
        )

    @property
    def concave(self) -> bool:
        """Whether the value is surely concave in x."""
        return self.scaled(-1.0).convex

    def scaled(self, factor: float) -> "Shape":
        """Return factor times the value."""
        if factor == 0.0:
            return replace(self, Q=0 * self.Q, c=0 * self.c, d=0.0, norms=(), rest=Rest.NONE, low=0.0, high=0.0)
        turned = {Rest.CONVEX: Rest.CONCAVE, Rest.CONCAVE: Rest.CONVEX}
        ends = (factor * self.low, factor * self.high)
        return Shape(
            Q=factor * self.Q,
            c=factor * self.c,
            d=factor * self.d,
            norms=tuple((factor * each, norm) for each, norm in self.norms),
            rest=turned.get(self.rest, self.rest) if factor < 0 else self.rest,
            low=min(ends),
            high=max(ends),
        )

    def plus(self, other: "Shape") -> "Shape":
        """Return the sum of two values."""
        rests = {self.rest, other.rest} - {Rest.NONE}
        return Shape(
            Q=self.Q + other.Q,
            c=self.c + other.c,
            d=self.d + other.d,
            norms=self.norms + other.norms,
            rest=rests.pop() if len(rests) == 1 else Rest.UNKNOWN if rests else Rest.NONE,
            low=self.low + other.low,
            high=self.high + other.high,
        )


def positive_semidefinite(Q: Array) -> bool:
    """Return whether the symmetric matrix has no eigenvalue below 0, to rounding."""
    if not Q.any():
        return True
    values = np.linalg.eigvalsh(Q)
    return bool(values[0] >= -_ROUNDING * len(Q) * np.abs(values).max())


def square_root(Q: Array) -> Array:
    """Return R (rank, n) with R' R = Q for a positive semidefinite Q (n, n)."""
    values, vectors = np.linalg.eigh(Q)
    kept = values > _ROUNDING * len(values) * values[-1]
    return np.asarray(np.sqrt(values[kept])[:, None] * vectors[:, kept].T)


def shapes_of(function: Any, p: Array, lower: Array, upper: Array) -> list[Shape]:
    """Return the shapes of the values of a CasADi SXFunction of (x, p) -> (k, 1) for lower <= x <= upper.

    Raises
    ------
    InputError : the function has an instruction that cannot be read, or too many for dense quadratics.
    """
    program = read_instructions(function)
    if len(program.nodes) * len(lower) ** 2 > _LARGEST:
        raise InputError(f"{function.name()} is too large for an analysis of its curvature.")
    rules = _Rules(lower, upper)
    shapes: list[Shape] = []
    # of each node, which node it is a whole power of: x^3 arrives as x * (x * x)
    powers: list[tuple[int, int]] = []
    with np.errstate(all="ignore"):
        for index, node in enumerate(program.nodes):
            power = (index, 1)
            if isinstance(node, Constant):
                shapes.append(rules.constant(node.value))
            elif isinstance(node, Input):
                known = node.argument == 1
                shapes.append(rules.constant(float(p[node.element])) if known else rules.unknown(node.element))
            else:
                operands = node.operands
                same = len(operands) == 2 and operands[0] == operands[1]
                shapes.append(rules.applied(node.code, [shapes[i] for i in operands], same))
                power = _power_of(node.code, [powers[i] for i in operands], index)
                if shapes[-1].rest is Rest.UNKNOWN and power[0] != index:
                    shapes[-1] = rules.power(shapes[power[0]], float(power[1]))
            powers.append(power)
    results = [rules.constant(0.0)] * function.size1_out(0)
    for row, node_index in zip(program.outputs[0].row, program.results[0], strict=True):
        results[row] = shapes[node_index]
    return results


def _power_of(code: str, operands: list[tuple[int, int]], index: int) -> tuple[int, int]:
    """Return base node and whole exponent of an operation, itself and 1 where it is no power."""
    (base, exponent), (other, more) = operands[0], operands[-1]
    if code == "SQ":
        return base, 2 * exponent
    if code == "INV":
        return base, -exponent
    if code == "MUL" and base == other and exponent + more:
        return base, exponent + more
    return index, 1


class _Rules:
    """The rules of composition over one box of x."""

    def __init__(self, lower: Array, upper: Array) -> None:
        self.lower, self.upper, self.n = lower, upper, len(lower)
        self.unary: Mapping[str, Callable[[Shape], Shape]] = {
            "NEG": lambda a: a.scaled(-1.0),
            "TWICE": lambda a: a.scaled(2.0),
            "SQ": lambda a: self.power(a, 2.0),
            "INV": lambda a: self.power(a, -1.0),
            "SQRT": self.root,
            "FABS": self.absolute,
            "EXP": lambda a: self.rising(a, np.exp, Rest.CONVEX),
            "EXPM1": lambda a: self.rising(a, np.expm1, Rest.CONVEX),
            "LOG": lambda a: self.rising(a, np.log, Rest.CONCAVE),
            "LOG1P": lambda a: self.rising(a, np.log1p, Rest.CONCAVE),
        }

    def constant(self, value: float) -> Shape:
        return Shape(np.zeros((self.n, self.n)), np.zeros(self.n), value, (), Rest.NONE, value, value)

    def unknown(self, element: int) -> Shape:
        c = np.zeros(self.n)
        c[element] = 1.0
        return replace(self.constant(0.0), c=c, low=float(self.lower[element]), high=float(self.upper[element]))

    def opaque(self, rest: Rest, low: float = -np.inf, high: float = np.inf) -> Shape:
        if np.isnan(low) or np.isnan(high):
            low, high = -np.inf, np.inf
        return replace(self.constant(0.0), rest=rest, low=low, high=high)

    def applied(self, code: str, operands: list[Shape], same: bool) -> Shape:
        """Return the shape of one operation; `same` tells that both operands are one value."""
        a, b = operands[0], operands[-1]
        if code in self.unary:
            return self.unary[code](a)
        if code == "ADD":
            return a.plus(b)
        if code == "SUB":
            return a.plus(b.scaled(-1.0))
        if code == "MUL":
            return self.power(a, 2.0) if same else self.product(a, b)
        if code == "DIV":
            return self.product(a, self.constant(1 / b.d) if b.constant and b.d else self.power(b, -1.0))
        if code in ("POW", "CONSTPOW") and b.constant:
            return self.power(a, b.d)
        if code == "FMAX":
            rest = Rest.CONVEX if a.convex and b.convex else Rest.UNKNOWN
            return self.opaque(rest, max(a.low, b.low), max(a.high, b.high))
        if code == "FMIN":
            rest = Rest.CONCAVE if a.concave and b.concave else Rest.UNKNOWN
            return self.opaque(rest, min(a.low, b.low), min(a.high, b.high))
        if code == "HYPOT":
            return self.root(self.power(a, 2.0).plus(self.power(b, 2.0)))
        return self.opaque(Rest.UNKNOWN)

    def product(self, a: Shape, b: Shape) -> Shape:
        if a.constant:
            return b.scaled(a.d)
        if b.constant:
            return a.scaled(b.d)
        ends = [u * v for u in (a.low, a.high) for v in (b.low, b.high)]
        ranged = self.opaque(Rest.UNKNOWN, min(ends), max(ends))
        if not (a.affine and b.affine):
            return ranged
        outer = np.outer(a.c, b.c)
        return Shape(outer + outer.T, a.d * b.c + b.d * a.c, a.d * b.d, (), Rest.NONE, ranged.low, ranged.high)

    def power(self, a: Shape, exponent: float) -> Shape:
        if a.constant:
            return self.constant(float(np.power(a.d, exponent)))
        if exponent in (0.0, 1.0):
            return a if exponent else self.constant(1.0)
        even = exponent % 2 == 0
        low, high = self.power_range(a, exponent, even)
        if exponent == 2.0 and a.affine:
            return Shape(2 * np.outer(a.c, a.c), 2 * a.d * a.c, a.d**2, (), Rest.NONE, low, high)
        positive, negative = a.low >= 0, a.high <= 0
        whole = exponent % 1 == 0
        rest = Rest.UNKNOWN
        if exponent >= 1:
            if (even and a.affine) or (a.convex and positive) or (a.affine and not whole):
                rest = Rest.CONVEX
            elif a.concave and negative and whole:
                rest = Rest.CONVEX if even else Rest.CONCAVE
        elif exponent > 0:
            rest = Rest.CONCAVE if a.concave else Rest.UNKNOWN
        elif a.concave and (a.low > 0 or (positive and whole) or not whole):
            rest = Rest.CONVEX
        elif a.convex and a.high < 0 and whole:
            rest = Rest.CONVEX if even else Rest.CONCAVE
        return self.opaque(rest, low, high)

    def power_range(self, a: Shape, exponent: float, even: bool) -> tuple[float, float]:
        ends = [float(np.power(end, exponent)) for end in (a.low, a.high)]
        if exponent < 0 and not (a.low > 0 or a.high < 0):
            return (0.0 if even else -np.inf), np.inf
        if even and a.low < 0 < a.high:
            ends.append(0.0)
        if np.isnan(ends).any():
            # a root of what may be negative: the function is defined where it is not
            return 0.0, (float(np.power(a.high, exponent)) if exponent > 0 else np.inf)
        return min(ends), max(ends)

    def root(self, a: Shape) -> Shape:
        if a.constant:
            return self.constant(float(np.sqrt(a.d)))
        low, high = float(np.sqrt(max(a.low, 0.0))), float(np.sqrt(max(a.high, 0.0)))
        norm = _norm_of(a)
        if norm is not None:
            return replace(self.constant(0.0), norms=((1.0, norm),), low=low, high=high)
        return self.opaque(Rest.CONCAVE if a.concave else Rest.UNKNOWN, low, high)

    def absolute(self, a: Shape) -> Shape:
        if a.low >= 0:
            return a
        if a.high <= 0:
            return a.scaled(-1.0)
        low, high = 0.0, max(-a.low, a.high)
        if a.affine:
            norm = Norm(a.c[None, :], np.array([a.d]), 0.0)
            return replace(self.constant(0.0), norms=((1.0, norm),), low=low, high=high)
        return self.opaque(Rest.UNKNOWN, low, high)

    def rising(self, a: Shape, function: Callable[[float], Any], kind: Rest) -> Shape:
        """Return the shape of a non-decreasing function, convex or concave, of a value."""
        if a.constant:
            return self.constant(float(function(a.d)))
        fits = a.convex if kind is Rest.CONVEX else a.concave
        low, high = float(function(a.low)), float(function(a.high))
        return self.opaque(kind if fits else Rest.UNKNOWN, -np.inf if np.isnan(low) else low, high)


def _norm_of(a: Shape) -> Norm | None:
    """Return sqrt(a) as a norm where a is a quadratic that is nowhere negative."""
    if not a.quadratic or a.affine or not positive_semidefinite(a.Q):
        return None
    L = square_root(a.Q / 2)
    e = np.linalg.lstsq(2 * L.T, a.c, rcond=None)[0]
    size = max(1.0, float(np.abs(a.c).max()), abs(a.d))
    if float(np.abs(2 * L.T @ e - a.c).max()) > 1e-12 * size:
        return None
    level = a.d - float(e @ e)
    if level < -1e-12 * size:
        return None
    return Norm(L, np.asarray(e, dtype=np.float64), 0.0 if level < 1e-12 * size else level)
