"""Integrate: the twins of the one-step methods and of `integrate.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.evaluate import Leaf
from optsat.kernels.source import Twin
from optsat.kernels.status import Status


def runge_kutta_4(n: int, m: int, rate: Twin) -> Twin:
    """Return the step (state, inputs, time, dt) to state of `runge_kutta_4.c`."""

    def run(x: Array) -> tuple[int, Array]:
        state, dt = x[:n], x[-1]
        half = dt / 2.0
        slope = _Slopes(rate, x[n : n + m], x[n + m : -1])
        with np.errstate(all="ignore"):
            k1 = slope(state, 0.0)
            k2 = slope(state + half * k1, half)
            k3 = slope(state + half * k2, half)
            k4 = slope(state + dt * k3, dt)
            total = ((k1 + 2.0 * k2) + 2.0 * k3) + k4
            return slope.result(state + dt * (total / 6.0))

    return run


def midpoint(n: int, m: int, rate: Twin) -> Twin:
    """Return the step (state, inputs, time, dt) to state of `midpoint.c`."""

    def run(x: Array) -> tuple[int, Array]:
        state, dt = x[:n], x[-1]
        half = dt / 2.0
        slope = _Slopes(rate, x[n : n + m], x[n + m : -1])
        with np.errstate(all="ignore"):
            return slope.result(state + dt * slope(state + half * slope(state, 0.0), half))

    return run


def lie_group(n: int, m: int, rate: Twin, move: Leaf) -> Twin:
    """Return the step (state, inputs, time, dt) to state of `lie_group.c`."""

    def run(x: Array) -> tuple[int, Array]:
        start, dt = x[:n], x[-1]
        half, twelfth = dt / 2.0, dt / 12.0
        slope = _Slopes(rate, x[n : n + m], x[n + m : -1])

        def moved(state: Array, by: Array) -> Array:
            return move(np.concatenate([state, by]))

        with np.errstate(all="ignore"):
            f0 = slope(start, 0.0)
            second = moved(start, half * f0)
            f1 = slope(second, half)
            f2 = slope(moved(start, half * f1), half)
            f3 = slope(moved(second, dt * f2 - half * f0), dt)
            middle = 2.0 * (f1 + f2)
            early = moved(start, twelfth * (middle + (3.0 * f0 - f3)))
            return slope.result(moved(early, twelfth * (middle + (3.0 * f3 - f0))))

    return run


class _Slopes:
    """The rate at states and times of one step, and the first status that was not OK."""

    def __init__(self, rate: Twin, inputs: Array, time: Array) -> None:
        self._rate, self._inputs, self._time = rate, inputs, time
        self._status = int(Status.OK)

    def __call__(self, state: Array, ahead: float) -> Array:
        status, slope = self._rate(np.concatenate([state, self._inputs, self._time + ahead]))
        self._status = self._status or status
        return slope

    def result(self, state: Array) -> tuple[int, Array]:
        """The status and the state after the step, NaN where there is none."""
        return self._status, state if self._status == Status.OK else np.full_like(state, np.nan)


def integrate(n: int, m: int, time: int, steps: int, every: int, held: bool, advance: Twin, restore: Leaf) -> Twin:
    """Return states after every so many steps, and the number of steps completed."""

    def run(x: Array) -> tuple[int, Array]:
        state, dt = x[:n], x[-1]
        inputs, start = x[n : x.size - time - 1].reshape(-1, m), x[x.size - time - 1 : -1]
        states = np.full((steps // every + 1, n), np.nan)
        status, completed = (Status.OK if np.isfinite(state).all() else Status.NOT_FINITE), 0
        if status is Status.OK:
            states[0] = state
        with np.errstate(all="ignore"):
            while completed < steps and status is Status.OK:
                given = inputs[0 if held else completed] if m else inputs.ravel()
                result, moved = advance(np.concatenate([state, given, start + completed * dt, [dt]]))
                status = Status(result)
                if status is Status.OK:
                    state = restore(moved)
                    status = Status.OK if np.isfinite(state).all() else Status.OUTPUT
                if status is Status.OK:
                    completed += 1
                    if completed % every == 0:
                        states[completed // every] = state
        return status, np.append(states.ravel(), completed)

    return run
