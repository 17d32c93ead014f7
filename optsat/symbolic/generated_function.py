"""Generated function: one symbolic definition, called by sample or by batch, compiled, with exact Jacobians."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from optsat.attitude.backend import Value, is_symbolic
from optsat.errors import InputError, nearest_name
from optsat.kernels.arguments import ordered
from optsat.port import Port

if TYPE_CHECKING:
    from optsat.kernels.elementary import Math
    from optsat.kernels.kernel import Kernel
    from optsat.kernels.unit import Real
    from optsat.symbolic.evaluation import Evaluation


@dataclass(frozen=True, eq=False, repr=False)
class GeneratedFunction:
    """A CasADi SX function with named ports; make one with `generate`.

    Arrays in, arrays out, by position or by name; a single output comes unpacked, several as a tuple. CasADi arguments
    give CasADi results, so functions compose. It is computed by CasADi's machine, and by compiled code with the same
    bits once that pays, see `optsat.symbolic.evaluation`; `kernel` gives the fastest form at once.
    """

    name: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    casadi: Any
    _evaluation: "Evaluation" = field(init=False)

    def __post_init__(self) -> None:
        from optsat.symbolic.evaluation import Evaluation

        object.__setattr__(self, "_evaluation", Evaluation(self.name, self.inputs, self.outputs, self.casadi))

    def __reduce__(self) -> tuple[Any, ...]:
        # what was compiled stays here: the cache of the other process has it too
        return GeneratedFunction, (self.name, self.inputs, self.outputs, self.casadi)

    def __call__(self, *args: Value, **kwargs: Value) -> Any:
        """Return the outputs for one sample.

        Raises
        ------
        InputError : an argument is missing, not finite or of the wrong shape; the message names the port.
        UnknownOptionError : a keyword is no port of this function.
        """
        if is_symbolic(*args, *kwargs.values()):
            results = self.casadi.call(ordered(self.name, self.inputs, args, kwargs))
            return results[0] if len(results) == 1 else tuple(results)
        return self._evaluation.call(*args, **kwargs)

    def batch(self, *args: Value, threads: int = 1, **kwargs: Value) -> Any:
        """Return the outputs (N, *shape) for N samples; an input without sample axis is shared.

        threads : how many compute, once it is compiled, at least 1024 samples each

        Raises
        ------
        InputError : as for a call; also when no input has a sample axis, or their lengths differ.
        """
        return self._evaluation.batch(threads, args, kwargs)

    def kernel(self, real: "Real" = "double", math: "Math" = "own") -> "Kernel":
        """Return it compiled, now unless the cache holds it: microseconds a call, several samples at once in a batch.

        real : "float" computes in single precision
        math : "own" elementary functions, fast and with the same bits on every machine; "libm" the bits of a call

        Raises
        ------
        InputError : an operation or constant that no kernel can have, or too many operations.
        """
        return self._evaluation.kernel(real, math)

    def c_source(self, target: str = "host", real: "Real" = "double", math: "Math" = "own") -> str:
        """Return it as C99 that needs no other file: `NAME_call` of one sample, `NAME_batch` of many.

        target : "host"; checked C for flight computers is written by `optsat.export.export.export_c`

        Raises
        ------
        InputError : another target, or as for `kernel`.
        """
        if target != "host":
            raise InputError(
                f"{self.name}.c_source: `target` must be 'host', got {target!r}. Flight code has guards, a header and "
                "a self-test beside it: use optsat.export.export.export_c, or `optsat export`."
            )
        from optsat.kernels.open_kernel import source_of
        from optsat.kernels.unit import library_text

        return library_text(source_of(self, math), real)

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
