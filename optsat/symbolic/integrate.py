"""Integrate: one fixed step as a function of the state, by Runge-Kutta of order four or by Euler."""

from collections.abc import Sequence
from typing import TypeAlias

from optsat.attitude.backend import Value, reciprocal
from optsat.errors import InputError
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate, port_named

Point: TypeAlias = dict[str, Value]

_DT = Port("dt", (), "s", lower=0.0)


def rk4_step(
    derivative: GeneratedFunction,
    states: Sequence[str],
    time: str | None = None,
    unit_length: Sequence[str] = (),
    substeps: int = 1,
) -> GeneratedFunction:
    """Return the state after `dt` as a function of the inputs of `derivative` and `dt` [s].

    states : inputs that are states; output k of `derivative` is the rate of states[k]
    time : the input that is time [s], advanced inside the step; the other inputs are held over the step
    unit_length : states scaled back to length one after the step, such as a quaternion
    substeps : equal steps inside dt

    Raises
    ------
    InputError : a state is no input of `derivative`, or its shape differs from that of its rate.
    """
    import casadi as ca

    ports = _state_ports(derivative, states, unit_length)
    if time is not None:
        port_named(derivative.inputs, time, derivative.name)
    if substeps < 1:
        raise InputError(f"`substeps` must be at least 1, got {substeps}.")
    symbols = dict(zip((port.name for port in derivative.inputs), derivative.symbols(), strict=True))
    dt = ca.SX.sym("dt")
    h = dt / substeps

    def rates(point: Point) -> list[Value]:
        slopes: list[Value] = derivative.casadi.call([point[port.name] for port in derivative.inputs])
        return slopes

    def moved(point: Point, slopes: Sequence[Value], step: Value) -> Point:
        along = {name: point[name] + step * slope for name, slope in zip(states, slopes, strict=True)}
        return point | along | ({} if time is None else {time: point[time] + step})

    current = symbols
    for _ in range(substeps):
        k1 = rates(current)
        k2 = rates(moved(current, k1, h / 2))
        k3 = rates(moved(current, k2, h / 2))
        k4 = rates(moved(current, k3, h))
        sums = [a + 2 * (b + c) + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        # sixths of the step go to the states alone: time moves by the whole of it
        advanced = moved(current, sums, h / 6)
        current = advanced if time is None else advanced | {time: current[time] + h}
    for name in unit_length:
        current[name] = reciprocal(ca.norm_2(current[name])) * current[name]
    return generate(
        f"{derivative.name}_step",
        inputs=[*((port, symbols[port.name]) for port in derivative.inputs), (_DT, dt)],
        outputs=[(port, current[port.name]) for port in ports],
    )


def euler_step(
    derivative: GeneratedFunction, states: Sequence[str], unit_length: Sequence[str] = ()
) -> GeneratedFunction:
    """Return state + dt rate as a function of the inputs of `derivative` and `dt` [s]; order one, for comparison.

    states : inputs that are states; output k of `derivative` is the rate of states[k]
    unit_length : states scaled back to length one after the step, such as a quaternion

    Raises
    ------
    InputError : as for `rk4_step`.
    """
    import casadi as ca

    ports = _state_ports(derivative, states, unit_length)
    symbols = dict(zip((port.name for port in derivative.inputs), derivative.symbols(), strict=True))
    dt = ca.SX.sym("dt")
    rates = derivative.casadi.call(list(symbols.values()))
    after = {name: symbols[name] + dt * rate for name, rate in zip(states, rates, strict=True)}
    for name in unit_length:
        after[name] = reciprocal(ca.norm_2(after[name])) * after[name]
    return generate(
        f"{derivative.name}_euler_step",
        inputs=[*((port, symbols[port.name]) for port in derivative.inputs), (_DT, dt)],
        outputs=[(port, after[port.name]) for port in ports],
    )


def _state_ports(derivative: GeneratedFunction, states: Sequence[str], unit_length: Sequence[str]) -> list[Port]:
    ports = [port_named(derivative.inputs, name, derivative.name) for name in states]
    _check_rates(derivative, ports)
    if missing := set(unit_length) - set(states):
        raise InputError(f"{derivative.name}: `unit_length` names `{min(missing)}`, which is no state.")
    return ports


def _check_rates(derivative: GeneratedFunction, states: list[Port]) -> None:
    if len(states) != len(derivative.outputs):
        raise InputError(
            f"{derivative.name} has {len(derivative.outputs)} outputs for {len(states)} states: "
            "output k must be the rate of state k."
        )
    for state, rate in zip(states, derivative.outputs, strict=True):
        if state.shape != rate.shape:
            raise InputError(f"{derivative.name}: {rate} cannot be the rate of {state}.")
