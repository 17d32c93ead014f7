"""Definition: what a kernel needs of a symbolic function, and its arguments in the order that a template wants."""

from collections.abc import Sequence
from typing import Any, Protocol

from optsat.errors import InputError, nearest_name
from optsat.kernels.lowering import lower
from optsat.kernels.program import Program
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


def port_of(definition: Definition, name: str) -> Port:
    """Return the argument of that name.

    Raises
    ------
    InputError : there is none; the nearest is offered.
    """
    ports = {port.name: port for port in definition.inputs}
    if name not in ports:
        raise InputError(f"{definition.name} has no argument `{name}`.{nearest_name(name, list(ports))}")
    return ports[name]
