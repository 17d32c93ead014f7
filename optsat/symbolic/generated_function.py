"""Generated function: one symbolic definition, called by sample or by batch, with exact Jacobians."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.attitude.backend import Value, is_symbolic
from optsat.errors import InputError, UnknownOptionError, nearest_name
from optsat.port import Port


@dataclass(frozen=True, eq=False, repr=False)
class GeneratedFunction:
    """A CasADi SX function with named ports; make one with `generate`.

    Arrays in, arrays out, by position or by name; a single output comes unpacked, several as a tuple. CasADi arguments
    give CasADi results, so functions compose.
    """

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    casadi: Any

    def __call__(self, *args: Value, **kwargs: Value) -> Any:
        """Return the outputs for one sample.

        Raises
        ------
        InputError : an argument is missing, not finite or of the wrong shape; the message names the port.
        UnknownOptionError : a keyword is no port of this function.
        """
        values = self._ordered(args, kwargs)
        if is_symbolic(*values):
            results = self.casadi.call(list(values))
            return results[0] if len(results) == 1 else tuple(results)
        columns = [port.sample(self.name, value) for port, value in zip(self.inputs, values, strict=True)]
        results = self.casadi.call(columns)
        return _unpacked([p.from_columns(r.full())[0] for p, r in zip(self.outputs, results, strict=True)])

    def batch(self, *args: Value, **kwargs: Value) -> Any:
        """Return the outputs (N, *shape) for N samples in one CasADi call; an input without sample axis is shared.

        Raises
        ------
        InputError : as for a call; also when no input has a sample axis, or their lengths differ.
        """
        ordered = zip(self.inputs, self._ordered(args, kwargs), strict=True)
        arrays = [(port, port.samples(self.name, value)) for port, value in ordered]
        lengths = {port.name: len(array) for port, array in arrays if array.shape != port.shape}
        if len(set(lengths.values())) != 1:
            got = ", ".join(f"`{name}` {length}" for name, length in lengths.items()) or "none"
            raise InputError(f"{self.name}.batch: the inputs must hold the same number of samples; lengths: {got}.")
        count = next(iter(lengths.values()))
        if count == 0:
            return _unpacked([np.zeros((0, *port.shape)) for port in self.outputs])
        results = self.casadi.call([port.to_columns(array) for port, array in arrays])
        return _unpacked([port.from_columns(result.full()) for port, result in zip(self.outputs, results, strict=True)])

    def jacobian(self, of: str, wrt: str) -> "GeneratedFunction":
        """Return the exact derivative (of.size, wrt.size) of output `of` by input `wrt`, matrices counted by rows.

        Raises
        ------
        InputError : no such port.
        """
        import casadi as ca

        output, argument = port_named(self.outputs, of, self.name), port_named(self.inputs, wrt, self.name)
        flat = [ca.SX.sym(port.name, port.size) for port in self.inputs]
        arguments = [shaped(port, symbol) for port, symbol in zip(self.inputs, flat, strict=True)]
        result = self.casadi.call(arguments)[self.outputs.index(output)]
        derivative = ca.jacobian(flattened(output, result), flat[self.inputs.index(argument)])
        name = f"d_{of}_d_{wrt}"
        return generate(
            f"{self.name}_{name}",
            inputs=list(zip(self.inputs, arguments, strict=True)),
            outputs=[(Port(name, (output.size, argument.size), _per(output.unit, argument.unit)), derivative)],
        )

    def symbols(self) -> list[Any]:
        """Return fresh SX symbols, one for each input, to build another function on this one."""
        import casadi as ca

        return [ca.SX.sym(port.name, port.rows, port.columns) for port in self.inputs]

    def _ordered(self, args: tuple[Value, ...], kwargs: dict[str, Value]) -> list[Value]:
        names = [port.name for port in self.inputs]
        if len(args) > len(names):
            raise InputError(f"{self.name} takes {len(names)} arguments, got {len(args)}: {self!r}.")
        given = dict(zip(names, args, strict=False))
        for name, value in kwargs.items():
            if name not in names:
                raise UnknownOptionError(f"{self.name} has no input `{name}`.{nearest_name(name, names)}")
            if name in given:
                raise InputError(f"{self.name}: `{name}` was given by position and by name.")
            given[name] = value
        for port in self.inputs:
            if port.name not in given:
                raise InputError(f"{self.name}: input {port} is missing.")
        return [given[name] for name in names]

    def __repr__(self) -> str:
        return f"{self.name}({', '.join(map(str, self.inputs))}) -> {', '.join(map(str, self.outputs))}"


def generate(
    name: str, inputs: Sequence[tuple[Port, Value]], outputs: Sequence[tuple[Port, Value]]
) -> GeneratedFunction:
    """Return a function from pairs of port and CasADi SX: symbols for the inputs, expressions for the outputs.

    Raises
    ------
    InputError : a shape differs from its port, a name appears twice, an input is no symbol, or an expression uses a
        symbol that is no input.
    """
    import casadi as ca

    Port(name, (), "-")  # the same rule of names
    for kind, pairs in (("input", inputs), ("output", outputs)):
        names = [port.name for port, _ in pairs]
        if repeated := {each for each in names if names.count(each) > 1}:
            raise InputError(f"{name}: {kind} `{min(repeated)}` appears twice.")
    symbols = [_matching(name, port, value) for port, value in inputs]
    for (port, _), symbol in zip(inputs, symbols, strict=True):
        if not symbol.is_valid_input():
            raise InputError(f"{name}: input `{port.name}` must be a CasADi symbol, got the expression {symbol}.")
    expressions = [ca.densify(_matching(name, port, value)) for port, value in outputs]
    function = ca.Function(name, symbols, expressions, {"allow_free": True})
    if function.has_free():
        raise InputError(f"{name}: the outputs use {', '.join(map(str, function.get_free()))}, which is no input.")
    return GeneratedFunction(name, tuple(p for p, _ in inputs), tuple(p for p, _ in outputs), function)


def port_named(ports: Sequence[Port], name: str, function: str) -> Port:
    """Return the port of that name.

    Raises
    ------
    InputError : there is none; the nearest name is offered.
    """
    for port in ports:
        if port.name == name:
            return port
    raise InputError(f"{function} has no port `{name}`.{nearest_name(name, [port.name for port in ports])}")


def flattened(port: Port, value: Value) -> Value:
    """Return a CasADi matrix as a column, counted by rows as NumPy does."""
    import casadi as ca

    return ca.vec(value.T) if len(port.shape) == 2 else value


def shaped(port: Port, column: Value) -> Value:
    """Return a column, counted by rows, as a CasADi matrix of the port's shape."""
    import casadi as ca

    return ca.reshape(column, port.columns, port.rows).T if len(port.shape) == 2 else column


def _per(unit: str, other: str) -> str:
    if other == "-":
        return unit
    return f"{'1' if unit == '-' else unit}/({other})"


def _matching(function: str, port: Port, value: Value) -> Value:
    import casadi as ca

    matrix = ca.SX(value)
    if matrix.shape != (port.rows, port.columns):
        raise InputError(f"{function}: {port} does not match an expression of shape {matrix.shape}.")
    return matrix


def _unpacked(results: list[Any]) -> Any:
    return results[0] if len(results) == 1 else tuple(results)
