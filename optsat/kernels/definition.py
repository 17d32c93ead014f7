"""Definition: what a kernel needs of a symbolic function, and its arguments in the order that a template wants."""

from collections.abc import Sequence
from typing import Any, Protocol

from optsat.errors import InputError, nearest_name
from optsat.kernels.evaluate import evaluator
from optsat.kernels.lowering import lower
from optsat.kernels.program import Program
from optsat.kernels.source import KernelSource, Twin
from optsat.kernels.status import Status
from optsat.port import Port


class Definition(Protocol):
    """A CasADi SX function with named ports, such as a GeneratedFunction."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def inputs(self) -> tuple[Port, ...]:
        """Its arguments."""
        ...

    @property
    def outputs(self) -> tuple[Port, ...]:
        """Its results."""
        ...

    @property
    def casadi(self) -> Any:
        """The CasADi function of the same arguments and results."""
        ...


def lower_in_order(definition: Definition, order: Sequence[str]) -> Program:
    """Return the program of a definition with its arguments in another order.

    order : the names of arguments, more than it takes where one is not needed
    """
    import casadi as ca

    symbols = {port.name: ca.SX.sym(port.name, port.rows, port.columns) for port in definition.inputs}
    results = definition.casadi.call([symbols[port.name] for port in definition.inputs])
    names = [name for name in order if name in symbols]
    return lower(
        ca.Function(definition.name, [symbols[name] for name in names], results),
        names_in=names,
        names_out=[port.name for port in definition.outputs],
    )


def lower_or(definition: Definition | None, otherwise: Program) -> Program:
    """Return the program of a definition, or the other one where there is none."""
    return otherwise if definition is None else lower_in_order(definition, [port.name for port in definition.inputs])


def twin_of(program: Program) -> Twin:
    """Return the program run in Python, with the status that straight-line code has."""
    leaf = evaluator(program)
    return lambda x: (int(Status.OK), leaf(x))


def with_twin(each: Definition | KernelSource, order: Sequence[str]) -> tuple[Program | KernelSource, Twin]:
    """Return what fills a slot, its arguments in that order, and the same in Python.

    Raises
    ------
    InputError : a kernel takes them in another order, or is straight-line code and has no twin.
    """
    if not isinstance(each, KernelSource):
        program = lower_in_order(each, order)
        return program, twin_of(program)
    if [port.name for port in each.inputs] != list(order):
        raise InputError(
            f"{each.name} must take {', '.join(order)} in this order, it takes "
            f"{', '.join(port.name for port in each.inputs)}."
        )
    if each.twin is None:
        raise InputError(f"{each.name} is straight-line code; give the function that it was made of instead.")
    return each, each.twin


def port_of(definition: Definition | KernelSource, name: str) -> Port:
    """Return the argument of that name.

    Raises
    ------
    InputError : there is none; the nearest is offered.
    """
    ports = {port.name: port for port in definition.inputs}
    if name not in ports:
        raise InputError(f"{definition.name} has no argument `{name}`.{nearest_name(name, list(ports))}")
    return ports[name]
