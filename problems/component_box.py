"""Component boxes: directions of which each component is only known to lie in an interval."""

import itertools
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optsat.arrays import Array, Mask, angle_bounds, finite_array, normalise_rows
from optsat.errors import InfeasibleBoxError, InputError, explain_unknown_fields

_SLACK = 1e-12
# outward margin of cones and cuts: the support function is accurate to a few roundings
_OUTWARD = 1e-13


@explain_unknown_fields
@dataclass(frozen=True)
class ComponentBox:
    """Unit vectors x with low <= x <= high component by component; rows are directions.

    low, high : (m, 3). Source: interval model of the robust Wahba specification, sections 3 and 7.2.

    Raises
    ------
    InputError : shapes differ, not finite, low > high. InfeasibleBoxError : a box does not touch the unit sphere.
    """

    low: ArrayLike
    high: ArrayLike
    _low: Array = field(init=False, repr=False)
    _high: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        low = finite_array("low", self.low, (None, 3))
        high = finite_array("high", self.high, (None, 3))
        if low.shape != high.shape:
            raise InputError(f"`low` and `high` must have the same shape, got {low.shape} and {high.shape}.")
        if np.any(low > high):
            row = int(np.argwhere(low > high)[0][0])
            raise InputError(f"`low` must not exceed `high`: row {row} has low {low[row]} and high {high[row]}.")
        nearest = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))
        farthest = np.maximum(np.abs(low), np.abs(high))
        near, far = np.sum(nearest**2, axis=1), np.sum(farthest**2, axis=1)
        off = (near > 1 + _SLACK) | (far < 1 - _SLACK)
        if off.any():
            row = int(np.argmax(off))
            side = "outside" if near[row] > 1 else "inside"
            raise InfeasibleBoxError(
                f"Box {row} lies {side} the unit sphere: low {low[row]}, high {high[row]}; no unit vector fits. "
                "Widen the box or scale its centre to length 1."
            )
        object.__setattr__(self, "_low", low)
        object.__setattr__(self, "_high", high)

    @staticmethod
    def from_half_width(centre: ArrayLike, half_width: ArrayLike) -> "ComponentBox":
        """Return the boxes centre +- half_width, shapes (m, 3) or broadcast to it."""
        middle = finite_array("centre", centre, (None, 3))
        half = finite_array("half_width", half_width)
        if np.any(half < 0):
            raise InputError(f"`half_width` must be >= 0, the smallest is {half.min():g}.")
        return ComponentBox(middle - half, middle + half)

    @staticmethod
    def from_relative(measured: ArrayLike, fraction: float, mode: Literal["safe", "paper"] = "safe") -> "ComponentBox":
        """Return boxes for components corrupted as x (1 + fraction u), |u| <= 1.

        "safe" : [|x| / (1 + f), |x| / (1 - f)] with the sign of x, which surely holds the truth;
        "paper" : x +- f |x|, which misses it in 23 % of draws at f = 0.2.

        Raises
        ------
        InputError : fraction not in [0, 1), or an unknown mode.
        """
        x = finite_array("measured", measured, (None, 3))
        if isinstance(fraction, bool) or not isinstance(fraction, int | float) or not 0 <= fraction < 1:
            raise InputError(f"`fraction` must be in [0, 1), got {fraction!r}.")
        if mode == "paper":
            return ComponentBox(x - fraction * np.abs(x), x + fraction * np.abs(x))
        if mode != "safe":
            raise InputError(f"`mode` must be 'safe' or 'paper', got {mode!r}.")
        near, far = x / (1 + fraction), x / (1 - fraction)
        return ComponentBox(np.minimum(near, far), np.maximum(near, far))

    def __len__(self) -> int:
        return len(self._low)

    @property
    def midpoint(self) -> Array:
        """The middles (m, 3) of the intervals, not scaled to length 1."""
        return np.asarray((self._low + self._high) / 2)

    @property
    def radius(self) -> Array:
        """Half of the widths (m, 3) of the intervals."""
        return np.asarray((self._high - self._low) / 2)

    def midpoint_directions(self) -> Array:
        """Return the normalised midpoints (m, 3).

        Raises
        ------
        InputError : a box is centred at zero, so its midpoint has no direction.
        """
        middle = (self._low + self._high) / 2
        norm = np.linalg.norm(middle, axis=1, keepdims=True)
        if np.any(norm < 1e-9):
            raise InputError(
                f"Box {int(np.argmin(norm))} is centred at zero; it says nothing about a direction. Drop it."
            )
        return np.asarray(middle / norm)

    def support(self, row: int, u: ArrayLike) -> float:
        """Return max u.x over the unit vectors of one box, exactly: every pattern of bound and free components.

        u : (3,). Source: robust Wahba specification section 7.2, with the rule for u = 0 on the free components.
        """
        direction = finite_array("u", u, (3,))
        best = -np.inf
        low, high = self._low[row], self._high[row]
        for pattern in itertools.product((0, 1, 2), repeat=3):
            free = np.array([kind == 2 for kind in pattern])
            x = np.where(np.array(pattern) == 0, low, high)
            x = np.where(free, 0.0, x)
            best = max(best, self._patch_value(direction, x, free, low, high))
        return best

    @staticmethod
    def _patch_value(u: Array, x: Array, free: Mask, low: Array, high: Array) -> float:
        rest = 1.0 - float(x @ x)
        if not free.any():
            return float(u @ x) if abs(rest) <= _SLACK else -np.inf
        if rest < 0:
            return -np.inf
        fixed = float(u @ x)
        slope = float(np.linalg.norm(u[free]))
        if slope == 0.0:
            nearest = np.where((low <= 0) & (high >= 0), 0.0, np.minimum(np.abs(low), np.abs(high)))[free]
            farthest = np.maximum(np.abs(low), np.abs(high))[free]
            fits = float(nearest @ nearest) - _SLACK <= rest <= float(farthest @ farthest) + _SLACK
            return fixed if fits else -np.inf
        candidates = [np.sqrt(rest) * u[free] / slope]
        if free.sum() == 1:
            candidates.append(-candidates[0])
        values = [
            fixed + float(u[free] @ point)
            for point in candidates
            if np.all(point >= low[free] - _SLACK) and np.all(point <= high[free] + _SLACK)
        ]
        return max(values, default=-np.inf)

    def cone_angles(self) -> Array:
        """Return the half angle (m,) [rad] of the cone about each midpoint that holds the box's unit vectors."""
        centre = self.midpoint_directions()
        lowest = [-self.support(row, -centre[row]) for row in range(len(self))]
        return np.arccos(np.clip(np.array(lowest) - _OUTWARD, -1.0, 1.0))

    def face_limits(self) -> Array:
        """Return the support (m, 6) along +x, -x, +y, -y, +z, -z."""
        axes = [sign * np.eye(3)[axis] for axis in range(3) for sign in (1.0, -1.0)]
        return np.array([[self.support(row, u) for u in axes] for row in range(len(self))])


def _faces() -> Array:
    return np.array([sign * np.eye(3)[axis] for axis in range(3) for sign in (1.0, -1.0)])


def box_constraints(
    b_B: ArrayLike | ComponentBox,
    r_N: ArrayLike | ComponentBox,
    angle_bound_rad: ArrayLike | None,
    cuts: tuple[ArrayLike, ArrayLike, ArrayLike] | None,
) -> tuple[ArrayLike, ArrayLike, ArrayLike, Array, Array, Array]:
    """Return directions, cone bounds and half-space cuts that hold whatever the boxes, cones and cuts together allow.

    Each box gives a cone about its midpoint and up to six face cuts
    e_k . A c_r <= cos(max(0, arccos h_B(e_k) - delta_r)), and the mirror for reference boxes (spherical triangle
    inequality).

    Raises
    ------
    InputError : no bound at all, counts differ, cuts that cannot be used.
    """
    boxed_b, boxed_r = isinstance(b_B, ComponentBox), isinstance(r_N, ComponentBox)
    if angle_bound_rad is None and not (boxed_b or boxed_r):
        raise InputError(
            "`angle_bound_rad` is missing: one error bound per vector pair [rad], or component boxes for b_B or r_N."
        )
    u, w, c = _checked_cuts(cuts)
    if not (boxed_b or boxed_r):
        return b_B, r_N, angle_bound_rad, u, w, c  # type: ignore[return-value]
    b_mid = b_B.midpoint_directions() if isinstance(b_B, ComponentBox) else finite_array("b_B", b_B, (None, 3))
    r_mid = r_N.midpoint_directions() if isinstance(r_N, ComponentBox) else finite_array("r_N", r_N, (None, 3))
    b_unit, r_unit = normalise_rows("b_B", b_mid), normalise_rows("r_N", r_mid)
    if len(b_mid) != len(r_mid):
        raise InputError(f"`b_B` and `r_N` must hold the same number of vectors, got {len(b_mid)} and {len(r_mid)}.")
    extra = angle_bounds("angle_bound_rad", 0.0 if angle_bound_rad is None else angle_bound_rad, len(b_mid))
    delta_b = b_B.cone_angles() if isinstance(b_B, ComponentBox) else np.zeros(len(b_mid))
    delta_r = r_N.cone_angles() if isinstance(r_N, ComponentBox) else np.zeros(len(r_mid))
    left, right, level = [u], [w], [c]
    for box, own, other, other_delta, mirrored in (
        (b_B, b_unit, r_unit, delta_r + extra, False),
        (r_N, r_unit, b_unit, delta_b + extra, True),
    ):
        if not isinstance(box, ComponentBox):
            continue
        own_delta = delta_r if mirrored else delta_b
        rows, faces, limit = _cutting_faces(box, own, own_delta, other_delta)
        level.append(-np.cos(limit))
        left.append(other[rows] if mirrored else -faces)
        right.append(-faces if mirrored else other[rows])
    total = delta_b + delta_r + extra
    # a cone of pi or more says nothing; it stays as wide as a bound may be
    return (
        b_mid,
        r_mid,
        np.minimum(total, np.nextafter(np.pi, 0)),
        np.concatenate(left),
        np.concatenate(right),
        np.concatenate(level),
    )


def _cutting_faces(
    box: ComponentBox, centre: Array, delta: Array, other_delta: Array
) -> tuple[NDArray[np.intp], Array, Array]:
    """Return row, face normal and least angle [rad] from it to the other direction, for faces that cut."""
    limits = np.clip(box.face_limits() + _OUTWARD, -1.0, 1.0)
    least = np.maximum(0.0, np.arccos(limits) - other_delta[:, None])
    faces = _faces()
    implied = np.arccos(np.clip(centre @ faces.T, -1, 1)) - delta[:, None] - other_delta[:, None]
    rows, which = np.nonzero((least > 0) & (least > implied + 1e-12))
    return rows, faces[which], least[rows, which]


def _checked_cuts(cuts: tuple[ArrayLike, ArrayLike, ArrayLike] | None) -> tuple[Array, Array, Array]:
    if cuts is None:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
    if not isinstance(cuts, tuple) or len(cuts) != 3:
        raise InputError("`cuts` must be a tuple (u (k, 3), w (k, 3), c (k,)) for half-spaces u . A(q) w >= c.")
    u = finite_array("cuts[0]", cuts[0], (None, 3))
    return u, finite_array("cuts[1]", cuts[1], (len(u), 3)), finite_array("cuts[2]", cuts[2], (len(u),))
