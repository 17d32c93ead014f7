"""Integrate: the twins of the one-step methods and of `integrate.c`."""

import numpy as np

from optsat.arrays import Array
from optsat.kernels.evaluate import Leaf
from optsat.kernels.source import Twin
from optsat.kernels.status import Status


def runge_kutta_4(n: int, m: int, rate: Leaf) -> Twin:
    """Return the step (state, inputs, time, dt) to state of `runge_kutta_4.c`."""

    def run(x: Array) -> tuple[int, Array]:
        state, dt = x[:n], x[-1]
        half = dt / 2.0
        with np.errstate(all="ignore"):
            slope = [rate(x[:-1])]
            for ahead in (half, half, dt):
                slope.append(rate(np.concatenate([state + ahead * slope[-1], x[n : n + m], x[n + m : -1] + ahead])))
            total = ((slope[0] + 2.0 * slope[1]) + 2.0 * slope[2]) + slope[3]
            return Status.OK, state + dt * (total / 6.0)

    return run


def midpoint(n: int, m: int, rate: Leaf) -> Twin:
    """Return the step (state, inputs, time, dt) to state of `midpoint.c`."""

    def run(x: Array) -> tuple[int, Array]:
        state, dt = x[:n], x[-1]
        half = dt / 2.0
        with np.errstate(all="ignore"):
            middle = np.concatenate([state + half * rate(x[:-1]), x[n : n + m], x[n + m : -1] + half])
            return Status.OK, state + dt * rate(middle)

    return run


def lie_group(n: int, m: int, rate: Leaf, move: Leaf) -> Twin:
    """Return the step (state, inputs, time, dt) to state of `lie_group.c`."""

    def run(x: Array) -> tuple[int, Array]:
        start, dt = x[:n], x[-1]
        half, twelfth = dt / 2.0, dt / 12.0

        def slope(state: Array, ahead: float) -> Array:
            return rate(np.concatenate([state, x[n : n + m], x[n + m : -1] + ahead]))

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
            return Status.OK, moved(early, twelfth * (middle + (3.0 * f3 - f0)))

    return run


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
