"""Readings: what each sensor sends about a true motion, with its noise, its faults and its lost samples."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.models.channel_fault import noise_components, spoiled
from optsat.models.faults import Fault, SensorFaultKind
from optsat.models.spacecraft import Spacecraft
from optsat.simulation.diagnosis_scenario import DiagnosisScenario, Sampling
from optsat.simulation.true_run import Motion
from optsat.symbolic.generated_function import GeneratedFunction

DEVICES = {
    "gyro": "gyro_omega_BN_B",
    "star": "star_q_BN",
    "gps": "gps_r_N",
    "accelerometer": "accelerometer",
    "skewed_gyro": "skewed_gyro_rate",
    "pressure": "pressure_torque_B",
}
"""The array of `Telemetry` that each device of a spacecraft fills."""

_NOISY = (SensorFaultKind.NOISE, SensorFaultKind.DEAD_NOISY)


class Draws:
    """All random numbers of one run, each kind from a stream of its own."""

    def __init__(self, rng: np.random.Generator, scenario: DiagnosisScenario) -> None:
        """rng : whose children are the streams."""
        rate, acceleration, jitter, bias, faults, losses, *noise = rng.spawn(6 + len(DEVICES))
        count = len(scenario.grid())
        self.rate_noise = rate.standard_normal((count - 1, 3))
        self.acceleration_noise = acceleration.standard_normal((count - 1, 3))
        self.jitter = jitter.uniform(-scenario.time_jitter_s, scenario.time_jitter_s, count)
        self.jitter[0] = 0.0
        self.bias = bias
        self.noise = {
            device: getattr(scenario.spacecraft, device).draw(stream, count)
            for device, stream in zip(DEVICES, noise, strict=True)
            if getattr(scenario.spacecraft, device) is not None
        }
        # a stream for each fault, so that its noise does not depend on the others
        self.fault_noise = {
            number: stream.standard_normal((count, noise_components(fault.part)))
            for number, (fault, stream) in enumerate(
                zip(scenario.faults, faults.spawn(len(scenario.faults)), strict=True)
            )
            if fault.kind in _NOISY
        }
        self.losses = dict(zip(DEVICES, losses.random((len(DEVICES), count)), strict=True))


def readings_of(
    scenario: DiagnosisScenario, t: Array, motion: Motion, torque_B: Array, draws: Sequence[Draws]
) -> tuple[dict[str, Array], Array]:
    """Return the readings of N runs by their names in `Telemetry`, and the bias of the gyro (N, T, 3) [rad/s].

    t : (N, T) [s]; torque_B : (N, T, 3) of the thrusters from t[k] on [N m]
    """
    craft = scenario.spacecraft
    bias = _bias(craft, t, draws)
    truths = {
        "gyro": (motion.omega_BN_B, bias),
        "star": (motion.q_BN,),
        "gps": (motion.r_N,),
        "accelerometer": (motion.q_BN, motion.acceleration_N, motion.gravity_N),
        "skewed_gyro": (motion.omega_BN_B,),
        "pressure": (torque_B[:, np.maximum(np.arange(t.shape[1]) - 1, 0)],),
    }
    found = {}
    for device in draws[0].noise:
        noise = np.stack([draw.noise[device] for draw in draws])
        measurement = _measurement(getattr(craft, device))
        ideal = _by_rows(measurement, *truths[device], noise)
        if device == "pressure":
            ideal[:, 0] = np.nan  # no thrust has been seen before the first row
        sent = _with_faults(device, scenario.faults, t, ideal, draws)
        found[DEVICES[device]] = _received(scenario.sampling.get(device, Sampling()), device, sent, draws)
    return found, bias


def _bias(craft: Spacecraft, t: Array, draws: Sequence[Draws]) -> Array:
    if craft.gyro is None:
        return np.zeros((*t.shape, 3))
    return np.stack([craft.gyro.draw_bias(draw.bias, times) for draw, times in zip(draws, t, strict=True)])


def _with_faults(device: str, faults: Sequence[Fault], t: Array, ideal: Array, draws: Sequence[Draws]) -> Array:
    scalar = ideal.ndim == 2
    sent = ideal[..., None] if scalar else ideal.copy()
    for number, fault in enumerate(faults):
        if fault.part.device != device:
            continue
        axis = fault.part.axis
        columns = slice(None) if axis is None else slice(axis, axis + 1)
        if fault.kind in _NOISY:
            noise = np.stack([draw.fault_noise[number] for draw in draws])
        else:
            noise = np.zeros((*t.shape, noise_components(fault.part)))
        sent[..., columns] = spoiled(fault, t, sent[..., columns], noise)
    return sent[..., 0] if scalar else sent


def _received(sampling: Sampling, device: str, sent: Array, draws: Sequence[Draws]) -> Array:
    lost = np.stack([draw.losses[device] < sampling.dropout for draw in draws])
    lost |= np.arange(sent.shape[1]) % sampling.every != 0
    sent[lost] = np.nan
    return sent


def _by_rows(function: GeneratedFunction, *arguments: Array) -> Array:
    rows = [each.reshape(-1, *each.shape[2:]) for each in arguments]
    result = function.batch(*rows)
    return np.asarray(result.reshape(*arguments[0].shape[:2], *result.shape[1:]))


@functools.lru_cache(maxsize=32)
def _measurement(sensor: Any) -> GeneratedFunction:
    """Return the measurement of a sensor, kept so that it is compiled once in a campaign."""
    function: GeneratedFunction = sensor.measurement()
    return function
