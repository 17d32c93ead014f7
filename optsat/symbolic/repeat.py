"""Repeat: several steps of a system as one function, so that a long run costs few calls."""

from collections.abc import Sequence

from optsat.attitude.backend import Value
from optsat.errors import InputError
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate, port_named


def repeated(
    step: GeneratedFunction, states: Sequence[str], each: Sequence[str], count: int, kicked: str | None = None
) -> GeneratedFunction:
    """Return the states (count, n) after each of `count` steps as a function of the states before the first.

    step : whose outputs are the states named `states`, which are vectors
    each : its inputs that differ from step to step; they become (count, *shape), scalars (count,). The rest is shared.
    kicked : a state to which an input NAME_kick (count, n) is added after each step, such as process noise

    Raises
    ------
    InputError : a name is no port, an output is no state, or count < 1.
    """
    import casadi as ca

    if count < 1:
        raise InputError(f"`count` must be at least 1, got {count}.")
    if [port.name for port in step.outputs] != list(states):
        raise InputError(f"{step.name}: its outputs must be the states {', '.join(states)}, in this order.")
    for name in (*states, *each, *([] if kicked is None else [kicked])):
        port_named(step.inputs, name, step.name)
    ports = {port.name: _stacked(port, count) if port.name in each else port for port in step.inputs}
    symbols = {name: ca.SX.sym(name, port.rows, port.columns) for name, port in ports.items()}
    inputs = [(ports[name], symbols[name]) for name in ports]
    kick = None
    if kicked is not None:
        state = port_named(step.inputs, kicked, step.name)
        kick = ca.SX.sym("kick", count, state.size)
        inputs.append((Port(f"{kicked}_kick", (count, state.size), state.unit), kick))
    current = {name: symbols[name] for name in states}
    rows: dict[str, list[Value]] = {name: [] for name in states}
    for k in range(count):
        now = {**symbols, **current, **{name: symbols[name][k, :].T for name in each}}
        results = step.casadi.call([now[port.name] for port in step.inputs])
        current = dict(zip(states, results, strict=True))
        if kicked is not None and kick is not None:
            current[kicked] = current[kicked] + kick[k, :].T
        for name, value in current.items():
            rows[name].append(value.T)
    outputs = [(Port(port.name, (count, port.size), port.unit), ca.vertcat(*rows[port.name])) for port in step.outputs]
    return generate(f"{step.name}_times_{count}", inputs, outputs)


def _stacked(port: Port, count: int) -> Port:
    if len(port.shape) == 2:
        raise InputError(f"{port} is a matrix and cannot differ from step to step.")
    return Port(port.name, (count, *port.shape), port.unit, lower=port.lower)
