"""Integrate: differential equations in fixed steps, by methods whose loops stand in C around the leaf of the rates."""

from collections.abc import Sequence
from typing import Literal

from optsat.errors import InputError
from optsat.kernels.definition import Definition, lower_in_order, lower_or, port_of, with_twin
from optsat.kernels.evaluate import evaluator
from optsat.kernels.instantiate import Leaf, instantiate, operation_count
from optsat.kernels.sizes import check_size
from optsat.kernels.slots import identity
from optsat.kernels.source import KernelSource
from optsat.kernels.twins import integrate as twins
from optsat.port import Port

LARGEST = 16_384
"""Numbers that inputs and trajectory may hold together on a stack."""

Method = Literal["runge_kutta_4", "midpoint", "lie_group"]


def step(
    rate: Definition | KernelSource,
    states: Sequence[str],
    method: Method = "runge_kutta_4",
    time: str | None = None,
    move: Definition | None = None,
    name: str | None = None,
) -> KernelSource:
    """Return the kernel of one step: (states..., inputs..., time, dt) -> states, its results named as its arguments.

    rate : whose results joined are the rates of the states joined; its other arguments are held over the step. A kernel
        must take them in the order states, inputs, time.
    method : "lie_group" takes `move` and rates of displacement: (states..., displacement) -> states, the displacement
        acting from the identity, so that constraints such as |q| = 1 hold without a correction
    time : the argument that is time [s]; name : of the kernel, RATE_METHOD unless given

    Raises
    ------
    InputError : an argument is missing or of the wrong size, or the method is none of those.

    Source: explicit methods of Runge and Kutta; for "lie_group" Celledoni, Marthinsen & Owren, Commutator-free
    Lie group methods, Future Generation Computer Systems 19 (2003), order four.
    """
    state_ports = tuple(port_of(rate, each) for each in states)
    held = tuple(port for port in rate.inputs if port.name not in {*states, time})
    clock = () if time is None else (port_of(rate, time),)
    n, m = sum(port.size for port in state_ports), sum(port.size for port in held)
    d = sum(port.size for port in rate.outputs)
    kernel = name or f"{rate.name}_{method}"
    slope, of_rate = with_twin(rate, [port.name for port in (*state_ports, *held, *clock)])
    leaves: dict[str, Leaf] = {"rate": slope}
    sizes = {"N": n, "M": m, "TIME": len(clock)}
    if method == "lie_group":
        if move is None:
            raise InputError(f"{kernel}: the method lie_group needs `move`, which displaces a state.")
        moved = lower_in_order(move, [port.name for port in move.inputs])
        leaves["move"], sizes["D"] = moved, d
        twin = twins.lie_group(n, m, of_rate, evaluator(moved))
        operations = 4 * operation_count(slope) + 5 * moved.operation_count + 20 * d
    elif method in ("runge_kutta_4", "midpoint"):
        if d != n or move is not None:
            raise InputError(f"{kernel}: {rate.name} gives {d} rates of {n} states, without `move` they must match.")
        stages = 4 if method == "runge_kutta_4" else 2
        twin = (twins.runge_kutta_4 if method == "runge_kutta_4" else twins.midpoint)(n, m, of_rate)
        operations = stages * (operation_count(slope) + 3 * n)
    else:
        raise InputError(f"`method` must be 'runge_kutta_4', 'midpoint' or 'lie_group', got {method!r}.")
    return instantiate(
        method,
        kernel,
        leaves,
        sizes,
        inputs=(*state_ports, *held, *clock, Port("dt", (), "s", lower=0.0)),
        outputs=state_ports,
        twin=twin,
        operations=operations,
    )


def integrate(
    one_step: KernelSource,
    states: Sequence[str],
    steps: int,
    every: int = 1,
    time: str | None = None,
    held: bool = False,
    restore: Definition | None = None,
    name: str | None = None,
) -> KernelSource:
    """Return the kernel (states..., u, time, dt) -> (trajectory, completed) of a fixed number of steps.

    one_step : as `step` returns it, or any kernel (states..., inputs..., time, dt) -> states
    u : (steps, m), a row of the inputs joined for each step; absent where there are none
    held : u is (m,), the same in all steps
    every : row i of `trajectory` (steps // every + 1, n) holds the states joined after i `every` steps, row 0 the start
    restore : state -> state after each step, such as scaling a quaternion back to length one
    completed : steps taken; OS_E_OUTPUT where fewer than `steps`, since the next state would not be finite. Rows not
        reached are NaN.

    Raises
    ------
    InputError : `every` is not from 1 to steps, one_step has other ports, or inputs and trajectory together hold more
        than 16,384 numbers, which do not belong on a stack.
    """
    kernel = name or f"{one_step.name}_series"
    check_size(kernel, "steps", steps, 1, LARGEST)
    check_size(kernel, "every", every, 1, steps)
    known = {port.name: port for port in one_step.inputs}
    if missing := [each for each in (*states, *([] if time is None else [time]), "dt") if each not in known]:
        raise InputError(f"{kernel}: {one_step.name} has no argument `{missing[0]}`; it has {', '.join(known)}.")
    state_ports = tuple(known[each] for each in states)
    inputs = tuple(port for each, port in known.items() if each not in {*states, time, "dt"})
    clock = () if time is None else (known[time],)
    n, m = sum(port.size for port in state_ports), sum(port.size for port in inputs)
    if tuple(known) != tuple(port.name for port in (*state_ports, *inputs, *clock, known["dt"])):
        raise InputError(
            f"{kernel}: the arguments of {one_step.name} must be its states, inputs, time and dt in order."
        )
    back = lower_or(restore, identity("restore", n))
    rows = steps // every + 1
    if (numbers := rows * n + (m if held else steps * m)) > LARGEST:
        raise InputError(
            f"{kernel}: inputs and trajectory hold {numbers} numbers, at most {LARGEST}. Take a larger `every`, "
            "inputs that are held, or several calls."
        )
    joined = Port("u", (m,) if held else (steps, m), "SI") if m else None
    if one_step.twin is None:
        raise InputError(f"{kernel}: {one_step.name} is straight-line code; its steps need a kernel with a twin.")
    return instantiate(
        "integrate",
        kernel,
        {"advance": one_step, "restore": back},
        {
            "N": n,
            "M": m,
            "TIME": len(clock),
            "HELD": 1 if held else steps,
            "STEPS": steps,
            "EVERY": every,
            "ROWS": rows,
        },
        inputs=(*state_ports, *([joined] if joined else []), *clock, known["dt"]),
        outputs=(Port("trajectory", (rows, n), "SI"), Port("completed", (), "-", lower=0.0, upper=float(steps))),
        twin=twins.integrate(n, m, len(clock), steps, every, held, one_step.twin, evaluator(back)),
        operations=steps * (one_step.operations + operation_count(back)),
    )
