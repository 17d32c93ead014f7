"""True run: the motion of many runs of a diagnosis scenario at once, a few steps in one call."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.models.attitude_motion import attitude_euler_step, attitude_step
from optsat.models.gravity import EARTH_J2, gravity, translation_derivative
from optsat.models.nine_state_orbit import nine_state_euler_step
from optsat.simulation.diagnosis_scenario import AttitudeTruth, DiagnosisScenario, OrbitTruth
from optsat.symbolic.generated_function import GeneratedFunction
from optsat.symbolic.integrate import rk4_step
from optsat.symbolic.repeat import repeated

_AT_ONCE = 5
"""Steps of one call."""
_WORTH_COMPILING = 8
"""Runs at once from which on a compiled kernel is made."""


@dataclass(frozen=True, eq=False)
class Motion:
    """True motion of N runs, arrays (N, T, ...) as `DiagnosisTruth` has them, and gravity_N [m/s^2]."""

    q_BN: Array
    omega_BN_B: Array
    r_N: Array
    v_N: Array
    acceleration_N: Array
    gravity_N: Array


def true_run(
    scenario: DiagnosisScenario, t: Array, torque_B: Array, rate_noise: Array, acceleration_noise: Array
) -> Motion:
    """Return the motion of N runs.

    t : (N, T) [s]; torque_B : (N, T, 3) of the thrusters, row k from t[k] on [N m]
    rate_noise, acceleration_noise : (N, T - 1, 3) standard normal; acceleration_noise is used by NINE_STATE only
    """
    steps = np.diff(t, axis=-1)
    strength = np.sqrt(steps / scenario.dt)[..., None]
    q_BN, omega_BN_B = _attitude(scenario, steps, torque_B, np.sqrt(scenario.rate_variance) * strength * rate_noise)
    field = _gravity(scenario.spacecraft.gravitational_parameter, scenario.orbit is OrbitTruth.OBLATE)
    if scenario.orbit is OrbitTruth.NINE_STATE:
        noise = np.sqrt(scenario.acceleration_variance) * strength * acceleration_noise
        r_N, v_N, acceleration_N = _nine_state(scenario, field, steps, noise)
        gravity_N = _by_rows(field, r_N)
    else:
        force_N = _force(scenario, t, q_BN)
        r_N, v_N = _orbit(scenario, steps, force_N)
        gravity_N = _by_rows(field, r_N)
        acceleration_N = gravity_N + force_N
    whole = q_BN.shape[:2]
    r_N, v_N, acceleration_N, gravity_N = (
        np.broadcast_to(value, (*whole, 3)) for value in (r_N, v_N, acceleration_N, gravity_N)
    )
    return Motion(quaternion.canonical(q_BN), omega_BN_B, r_N, v_N, acceleration_N, gravity_N)


def _attitude(scenario: DiagnosisScenario, steps: Array, torque_B: Array, kicks: Array) -> tuple[Array, Array]:
    torque = torque_B[:, :-1] + np.array(scenario.disturbance_torque_B)
    inertia = np.asarray(scenario.spacecraft.inertia_B)
    start = [np.array(scenario.q_BN), np.array(scenario.omega_BN_B)]

    by_step = {"torque_B": torque, "dt": steps, "omega_BN_B_kick": kicks}
    q_BN, omega_BN_B = _march(_attitude_steps(scenario.attitude), start, by_step, inertia_B=inertia)
    return q_BN, omega_BN_B


def _orbit(scenario: DiagnosisScenario, steps: Array, force_N: Array) -> tuple[Array, Array]:
    # without a force that depends on the attitude, and with one clock, all runs share one orbit
    shared = len(force_N) == 1 and bool((steps == steps[:1]).all())
    steps = steps[:1] if shared else steps
    force_N = np.broadcast_to(force_N, (len(steps), *force_N.shape[1:]))
    start = [np.array(scenario.r_N), np.array(scenario.v_N)]

    mu, oblate = scenario.spacecraft.gravitational_parameter, scenario.orbit is OrbitTruth.OBLATE
    r_N, v_N = _march(_orbit_steps(mu, oblate), start, {"specific_force_N": force_N[:, :-1], "dt": steps})
    return r_N, v_N


def _nine_state(
    scenario: DiagnosisScenario, field: GeneratedFunction, steps: Array, kicks: Array
) -> tuple[Array, Array, Array]:
    r_N = np.array(scenario.r_N)
    start = [r_N, np.array(scenario.v_N), field(r_N)]

    mu = scenario.spacecraft.gravitational_parameter
    r_N, v_N, a_N = _march(_nine_state_steps(mu), start, {"dt": steps, "a_N_kick": kicks})
    return r_N, v_N, a_N


def _march(function: GeneratedFunction, start: list[Array], by_step: dict[str, Array], **shared: Array) -> list[Array]:
    """Return the states (runs, count + 1, n) from `start`, equal for all runs.

    function : of _AT_ONCE steps; by_step : its arguments (runs, count, ...) that differ from step to step
    """
    runs, count = by_step["dt"].shape
    # a few runs are over before a compiler would have started; a function that is used often compiles itself
    batch: Any = function.kernel().batch if runs >= _WORTH_COMPILING else None
    calls = -(-count // _AT_ONCE)
    steps = {name: _by_calls(values, calls) for name, values in by_step.items()}
    kept = {
        port.name: np.empty((runs, 1 + calls * _AT_ONCE, len(state)))
        for port, state in zip(function.outputs, start, strict=True)
    }
    for values, state in zip(kept.values(), start, strict=True):
        values[:, 0] = state
    # by position, which is checked faster than by name
    names = [port.name for port in function.inputs]
    for call in range(calls):
        first = call * _AT_ONCE
        now = {name: np.ascontiguousarray(values[:, first]) for name, values in kept.items()}
        now |= {name: values[call] for name, values in steps.items()}
        rows = slice(first + 1, first + 1 + _AT_ONCE)
        if batch is not None:
            results = batch(*(shared[name] if name in shared else now[name] for name in names))
            for values, result in zip(kept.values(), results, strict=True):
                values[:, rows] = result
            continue
        for run in range(runs):
            results = function(*(shared[name] if name in shared else now[name][run] for name in names))
            for values, result in zip(kept.values(), results, strict=True):
                values[run, rows] = result
    return [values[:, : count + 1] for values in kept.values()]


def _by_calls(values: Array, calls: int) -> Array:
    """Return (calls, runs, _AT_ONCE, ...) from (runs, count, ...), the last step repeated; what follows from those
    repetitions is thrown away.
    """
    missing = calls * _AT_ONCE - values.shape[1]
    filled = np.concatenate((values, np.repeat(values[:, -1:], missing, axis=1)), axis=1) if missing else values
    shaped = filled.reshape(len(values), calls, _AT_ONCE, *values.shape[2:])
    return np.ascontiguousarray(np.swapaxes(shaped, 0, 1))


def _force(scenario: DiagnosisScenario, t: Array, q_BN: Array) -> Array:
    """Return the specific force along N (N, T, 3), or (1, T, 3) of zeros where there is none."""
    if not len(scenario.specific_force_B.start_s):
        return np.zeros((1, t.shape[1], 3))
    force_B = scenario.specific_force_B.at(scenario.grid())
    return np.asarray(quaternion.transform(quaternion.inverse(q_BN), np.broadcast_to(force_B, (*t.shape, 3))))


def _by_rows(function: GeneratedFunction, values: Array) -> Array:
    return np.asarray(function.batch(values.reshape(-1, values.shape[-1])).reshape(values.shape))


@functools.lru_cache(maxsize=8)
def _gravity(gravitational_parameter: float, oblate: bool) -> GeneratedFunction:
    return gravity(gravitational_parameter, EARTH_J2 if oblate else 0.0)


@functools.cache
def _attitude_steps(truth: AttitudeTruth) -> GeneratedFunction:
    step = attitude_step() if truth is AttitudeTruth.RUNGE_KUTTA else attitude_euler_step()
    return repeated(step, ("q_BN", "omega_BN_B"), ("torque_B", "dt"), _AT_ONCE, "omega_BN_B")


@functools.lru_cache(maxsize=8)
def _orbit_steps(gravitational_parameter: float, oblate: bool) -> GeneratedFunction:
    step = rk4_step(translation_derivative(_gravity(gravitational_parameter, oblate)), ("r_N", "v_N"))
    return repeated(step, ("r_N", "v_N"), ("specific_force_N", "dt"), _AT_ONCE)


@functools.lru_cache(maxsize=8)
def _nine_state_steps(gravitational_parameter: float) -> GeneratedFunction:
    step = nine_state_euler_step(gravitational_parameter)
    return repeated(step, ("r_N", "v_N", "a_N"), ("dt",), _AT_ONCE, "a_N")
