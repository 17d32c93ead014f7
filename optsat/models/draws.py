"""Draws: random errors inside a stated bound, from a passed generator; several laws, because the law matters."""

from typing import Literal, TypeAlias

import numpy as np

from optsat.arrays import Array
from optsat.errors import InputError

ConeLaw: TypeAlias = Literal["cap", "angle", "boundary"]
BallLaw: TypeAlias = Literal["uniform", "boundary"]


def cone_angles(rng: np.random.Generator, count: int, half_angle: float, law: ConeLaw) -> Array:
    """Return angles off the axis (count,) [rad], never above `half_angle`.

    "cap" : uniform per unit area of the spherical cap, cos a = 1 - u (1 - cos half_angle)
    "angle" : uniform in the angle; "boundary" : all at the bound, the worst case

    Raises
    ------
    InputError : no generator, a bad count, or an unknown law.
    """
    _check(rng, count, law, ("cap", "angle", "boundary"))
    if law == "boundary":
        return np.full(count, float(half_angle))
    u = rng.random(count)
    if law == "angle":
        return np.asarray(u * half_angle)
    # sin^2(a / 2) = u sin^2(half_angle / 2): the same law without cancellation
    return np.asarray(np.minimum(2 * np.arcsin(np.sqrt(u) * np.sin(half_angle / 2)), half_angle))


def ball(rng: np.random.Generator, count: int, radius: float, law: BallLaw) -> Array:
    """Return vectors (count, 3) no longer than `radius` to rounding: uniform in volume, or all on the boundary.

    Raises
    ------
    InputError : no generator, a bad count, or an unknown law.
    """
    _check(rng, count, law, ("uniform", "boundary"))
    direction = rng.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    share = np.cbrt(rng.random(count)) if law == "uniform" else np.ones(count)
    return np.asarray(radius * share[:, None] * direction)


def box(rng: np.random.Generator, count: int, half_width: Array, law: BallLaw) -> Array:
    """Return vectors (count, 3) with components up to `half_width` (3,): uniform in volume, or corners.

    Raises
    ------
    InputError : no generator, a bad count, or an unknown law.
    """
    _check(rng, count, law, ("uniform", "boundary"))
    if law == "boundary":
        return np.asarray(half_width * rng.choice((-1.0, 1.0), (count, 3)))
    return np.asarray(half_width * rng.uniform(-1.0, 1.0, (count, 3)))


def _check(rng: object, count: int, law: str, laws: tuple[str, ...]) -> None:
    if not isinstance(rng, np.random.Generator):
        raise InputError(
            f"`rng` must be a numpy.random.Generator, got {type(rng).__name__}; use numpy.random.default_rng(seed)."
        )
    if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 0:
        raise InputError(f"`count` must be a whole number >= 0, got {count!r}.")
    if law not in laws:
        raise InputError(f"`law` must be one of {', '.join(map(repr, laws))}, got {law!r}.")


def tilted(rng: np.random.Generator, directions: Array, half_angle: Array, law: ConeLaw) -> Array:
    """Return unit directions (..., 3) turned off `directions` (..., 3) by a drawn angle, never above `half_angle`
    (...) [rad].

    The azimuth is uniform, the angle as in `cone_angles`; one law, a bound for each direction.

    Raises
    ------
    InputError : no generator, or an unknown law.
    """
    _check(rng, 0, law, ("cap", "angle", "boundary"))
    across = rng.standard_normal(directions.shape)
    across -= np.sum(across * directions, axis=-1, keepdims=True) * directions
    across /= np.linalg.norm(across, axis=-1, keepdims=True)
    share = np.ones(directions.shape[:-1]) if law == "boundary" else rng.random(directions.shape[:-1])
    cap = 2 * np.arcsin(np.sqrt(share) * np.sin(half_angle / 2))
    angle = cap if law == "cap" else share * half_angle
    tilt = np.cos(angle)[..., None] * directions + np.sin(angle)[..., None] * across
    return np.asarray(tilt / np.linalg.norm(tilt, axis=-1, keepdims=True))


def rotations(rng: np.random.Generator, count: int) -> Array:
    """Return unit quaternions (count, 4) uniform over all attitudes, w >= 0."""
    q = rng.standard_normal((count, 4))
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    return np.asarray(np.where(q[:, 3:] < 0, -q, q))


def directions(rng: np.random.Generator, *shape: int) -> Array:
    """Return unit vectors (*shape, 3) uniform over the sphere."""
    v = rng.standard_normal((*shape, 3))
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))
