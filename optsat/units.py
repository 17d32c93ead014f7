"""Checked unit conversions at the edges; everything inside is SI."""

import functools
import re
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from optsat.arrays import Array
from optsat.errors import InputError

if TYPE_CHECKING:
    import pint

Kind = Literal["angle", "rate", "flux_density", "length", "time", "acceleration", "torque", "direction"]

# kind: (its words, its SI unit, units worth offering in a message)
_KINDS: dict[Kind, tuple[str, str, str]] = {
    "angle": ("an angle", "rad", "rad, deg, arcmin, arcsec, mrad"),
    "rate": ("an angular rate", "rad/s", "rad/s, deg/s, deg/hour, rpm"),
    "flux_density": ("a magnetic flux density", "T", "T, mT, uT, nT"),
    "length": ("a length", "m", "m, mm, km"),
    "time": ("a time", "s", "s, ms, us, min, hour"),
    "acceleration": ("an acceleration", "m/s^2", "m/s^2, g_0"),
    "torque": ("a torque", "N m", "N m, mN m"),
    "direction": ("a bare direction", "dimensionless", "-"),
}
_PLAUSIBLE_LIMIT: dict[Kind, float] = {"angle": 2 * np.pi, "rate": 100.0}
_WORD = r"(?:[^\W\d]\w*|°)(?:(?:\^|\*\*)-?[1-9])?"
_EXPRESSION = re.compile(rf"(?:1|{_WORD})(?: ?[*/] ?{_WORD}| {_WORD})*")


@functools.cache
def _registry() -> "pint.UnitRegistry[Any]":
    import pint

    return pint.UnitRegistry()  # our own: the application registry of the user's program stays untouched


@functools.cache
def _base(unit: str) -> tuple[float, str]:
    """Return the factor to base units and their name; the name is empty when the unit is not known."""
    import pint

    if unit == "-":
        unit = "dimensionless"
    if len(unit) > 40 or not _EXPRESSION.fullmatch(unit):
        return float("nan"), ""
    try:
        factor, base = _registry().get_base_units(_registry().parse_units(unit))
    except pint.PintError:
        return float("nan"), ""
    return float(str(factor)), str(base)


def kind_of(unit: str, kinds: tuple[Kind, ...], name: str = "value") -> Kind:
    """Return the one of `kinds` that `unit` measures. Angles are not bare numbers here: Hz and 1/s are not rates.

    Raises
    ------
    InputError : the unit is unknown or measures something else; the message names the column and the allowed units.
    """
    base = _base(unit)[1]
    for kind in kinds:
        if base == _base(_KINDS[kind][1])[1]:
            return kind
    wanted = " or ".join(f"{_KINDS[kind][0]} [{_KINDS[kind][2]}]" for kind in kinds)
    if not base:
        raise InputError(f"`{name}` has the unknown unit [{unit}]; it must be {wanted}.")
    found = next((words for words, si, _ in _KINDS.values() if base == _base(si)[1]), f"measured in {base}")
    raise InputError(f"`{name}` has the unit [{unit}], which is {found}; it must be {wanted}.")


def si_factor(unit: str, kind: Kind, name: str = "value") -> float:
    """Return the number that turns a value in `unit` into the SI unit of its kind.

    Raises
    ------
    InputError : unknown unit, or the unit of another kind of quantity.
    """
    kind_of(unit, (kind,), name)
    return _base(unit)[0] / _base(_KINDS[kind][1])[0]


def to_si(value: ArrayLike, unit: str, kind: Kind, name: str = "value") -> Array:
    """Return `value`, given in `unit`, in the SI unit of its kind: rad, rad/s, T, m, s, m/s^2, N m or a bare direction.

    Raises
    ------
    InputError : unknown unit, or the unit of another kind of quantity.
    """
    return np.asarray(np.asarray(value, dtype=np.float64) * si_factor(unit, kind, name))


def is_implausible(value_si: ArrayLike, kind: Kind) -> NDArray[np.bool_]:
    """Tell where an angle exceeds a turn or a rate exceeds 100 rad/s; False for NaN and for other kinds."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(np.asarray(value_si, dtype=np.float64)) > _PLAUSIBLE_LIMIT.get(kind, np.inf))


def implausible_reason(kind: Kind) -> str:
    """Return the end of the sentence 'the rate 250 rad/s ...' that says why such a value is refused."""
    si = _KINDS[kind][1]
    return f"is beyond {_PLAUSIBLE_LIMIT[kind]:.6g} {si}; it looks like {si.replace('rad', 'deg')} labelled {si}"
