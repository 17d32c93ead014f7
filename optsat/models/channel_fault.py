"""Channel fault: what becomes of the readings of a sensor channel while a fault is there."""

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.edges import unchecked
from optsat.errors import InputError
from optsat.models.faults import Fault, SensorFaultKind, Window
from optsat.models.parts import Part


def noise_components(part: Part) -> int:
    """Return how many standard normal numbers per sample the noisy faults of a part need."""
    return {Part.GPS: 3, Part.STAR: 4}.get(part, 1)


def spoiled(fault: Fault, t: Array, readings: Array, noise: Array) -> Array:
    """Return the readings (..., T, n) of a channel as the faulty sensor sends them at times t (..., T) [s].

    readings : n = 1 of one axis, 3 of the GPS, 4 of the star tracker; NaN where there is none, which stays NaN unless
        the fault is a constant
    noise : (..., T, n) standard normal, used by the kinds NOISE and DEAD_NOISY

    Outside the window of the fault every bit of the readings stays. A frozen sensor repeats the last reading that it
    sent before the window; if it had sent none, the first one inside.

    Raises
    ------
    InputError : the fault is one of thrusters, or shapes do not fit.
    """
    if fault.part.is_thruster:
        raise InputError(f"{fault.part.value} is no sensor; its faults change the torque, see ThrusterPairs.condition.")
    n = noise_components(fault.part)
    if readings.shape != (*t.shape, n) or noise.shape != readings.shape:
        raise InputError(
            f"`readings` and `noise` of {fault.part.value} must have shape {(*t.shape, n)}, "
            f"got {readings.shape} and {noise.shape}."
        )
    active = fault.active(t)
    return np.asarray(np.where(active[..., None], _faulty(fault, t, readings, noise, active), readings))


def _faulty(fault: Fault, t: Array, readings: Array, noise: Array, active: Window) -> Array:
    value = np.array(fault.value)
    match fault.kind:
        case SensorFaultKind.DEAD:
            return np.zeros(readings.shape)
        case SensorFaultKind.STUCK:
            return np.broadcast_to(value, readings.shape)
        case SensorFaultKind.FREEZE:
            return _last_before(readings, active)
        case SensorFaultKind.BIAS:
            return _shifted(fault.part, readings, np.broadcast_to(value, (*t.shape, len(value))))
        case SensorFaultKind.DRIFT:
            return _shifted(fault.part, readings, value * np.maximum(t - fault.start_s, 0.0)[..., None])
        case SensorFaultKind.SCALE:
            return np.asarray(readings * value)
        case SensorFaultKind.NOISE:
            return _shifted(fault.part, readings, value * noise[..., :3])
        case SensorFaultKind.DEAD_NOISY:
            return np.asarray(value * noise)
        case _:
            return np.full(readings.shape, np.nan)


def _shifted(part: Part, readings: Array, shift: Array) -> Array:
    """Return readings plus a shift; of a star tracker turned in B by it."""
    if part is not Part.STAR:
        return np.asarray(readings + shift)
    return np.asarray(unchecked(quaternion.compose)(quaternion.exponential(shift), readings))


def _last_before(readings: Array, active: Window) -> Array:
    sent = ~np.isnan(readings).any(axis=-1)
    rows = np.arange(readings.shape[-2])
    last = np.maximum.accumulate(np.where(sent & ~active, rows, -1), axis=-1)
    # nothing sent before the window: what the sensor sends first inside it stays
    first = np.argmax(sent & active, axis=-1)[..., None]
    chosen = np.where(last >= 0, last, first)
    return np.asarray(np.take_along_axis(readings, chosen[..., None], axis=-2))
