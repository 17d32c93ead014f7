"""Filter model: a motion and a measurement with additive noise, as every Gaussian filter takes it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Literal, TypeAlias

from optsat.attitude.backend import Value, reciprocal
from optsat.errors import InputError
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, port_named

Noise: TypeAlias = Literal["full", "diagonal"]


@dataclass(frozen=True, eq=False)
class FilterModel:
    """x_next = f(x, u) + w, z = h(x_next, u) + v, with w and v independent, of covariance Q and R.

    transition : f; its outputs, in order, are the `states` after the step, scalars or columns
    measurement : h; its inputs are states or others, its outputs joined are z
    states : inputs of `transition` that joined are x; what remains of the inputs of both is u
    unit_length : states that are scaled to length one after prediction and update, such as a quaternion
    sign_free : outputs of `measurement` that are known up to their sign, such as a quaternion: the measured one is
        taken on the side of the predicted one

    Raises
    ------
    InputError : a name is none of a port, or ports of one name differ in shape.
    """

    transition: GeneratedFunction
    measurement: GeneratedFunction
    states: Sequence[str]
    unit_length: Sequence[str] = ()
    sign_free: Sequence[str] = ()

    def __post_init__(self) -> None:
        f, h = self.transition, self.measurement
        ports = [port_named(f.inputs, name, f.name) for name in self.states]
        if [port.shape for port in ports] != [port.shape for port in f.outputs]:
            raise InputError(
                f"{f.name}: its outputs must be the states {', '.join(map(str, ports))} after the step, got "
                f"{', '.join(map(str, f.outputs))}."
            )
        for port in (*ports, *h.outputs):
            if len(port.shape) > 1:
                raise InputError(f"States and measurements must be scalars or columns, got {port}.")
        for name in self.unit_length:
            port_named(ports, name, f"The state of {f.name}")
        for name in self.sign_free:
            port_named(h.outputs, name, h.name)
        known = {port.name: port for port in f.inputs}
        for port in h.inputs:
            if port.name in known and known[port.name].shape != port.shape:
                raise InputError(
                    f"{f.name} and {h.name} both take `{port.name}`, with the shapes {known[port.name].shape} and "
                    f"{port.shape}; name the two differently."
                )

    @property
    def state_ports(self) -> tuple[Port, ...]:
        """Ports of the parts of x."""
        return tuple(port_named(self.transition.inputs, name, self.transition.name) for name in self.states)

    @property
    def input_ports(self) -> tuple[Port, ...]:
        """Ports of u."""
        ports = {port.name: port for port in (*self.transition.inputs, *self.measurement.inputs)}
        return tuple(port for name, port in ports.items() if name not in self.states)

    @property
    def state_size(self) -> int:
        """Length of x."""
        return sum(port.size for port in self.state_ports)

    @property
    def measurement_size(self) -> int:
        """Length of z."""
        return sum(port.size for port in self.measurement.outputs)

    def f(self, u: dict[str, Value]) -> Callable[[Value], Value]:
        """Return x_next as a function of x in CasADi, at the inputs u by name."""
        return lambda x: self._joined(self.transition, x, u)

    def h(self, u: dict[str, Value]) -> Callable[[Value], Value]:
        """Return z as a function of x in CasADi, at the inputs u by name."""
        return lambda x: self._joined(self.measurement, x, u)

    def scaled(self, x: Value) -> Value:
        """Return x with the states of `unit_length` scaled to that."""
        import casadi as ca

        parts = parts_of(x, self.state_ports)
        shares = {name: reciprocal(ca.sqrt(ca.sumsqr(parts[name]))) for name in self.unit_length}
        return ca.vertcat(*(shares[name] * part if name in shares else part for name, part in parts.items()))

    def on_the_side_of(self, predicted: Value, z: Value) -> Value:
        """Return z with the parts of `sign_free` turned to the side of the predicted ones."""
        import casadi as ca

        ports = self.measurement.outputs
        near, measured = parts_of(predicted, ports), parts_of(z, ports)
        for name in self.sign_free:
            measured[name] = measured[name] * ca.if_else(ca.dot(measured[name], near[name]) < 0, -1, 1)
        return ca.vertcat(*measured.values())

    def _joined(self, function: GeneratedFunction, x: Value, u: dict[str, Value]) -> Value:
        import casadi as ca

        known = parts_of(x, self.state_ports) | u
        return ca.vertcat(*function.casadi.call([known[port.name] for port in function.inputs]))


def parts_of(column: Value, ports: Sequence[Port]) -> dict[str, Value]:
    """Return the parts of a CasADi column that joins the values of these ports, by name."""
    ends = accumulate(port.size for port in ports)
    return {port.name: column[end - port.size : end] for port, end in zip(ports, ends, strict=True)}


def noise_port(name: str, size: int, noise: Noise) -> Port:
    """Return the port of a noise covariance: the matrix, or NAME_diagonal.

    Raises
    ------
    InputError : `noise` is neither "full" nor "diagonal".
    """
    if noise == "full":
        return Port(name, (size, size), "SI")
    if noise == "diagonal":
        return Port(f"{name}_diagonal", (size,), "SI", lower=0.0)
    raise InputError(f"`noise` must be 'full' or 'diagonal', got {noise!r}.")


def noise_matrix(port: Port, symbol: Value) -> Value:
    """Return the covariance of a noise port in CasADi; of a full matrix the lower triangle is read."""
    import casadi as ca

    return ca.diag(symbol) if len(port.shape) == 1 else symmetric(symbol)


def symmetric(matrix: Value) -> Value:
    """Return the symmetric CasADi matrix that has the lower triangle of this one."""
    import casadi as ca

    return ca.tril2symm(ca.tril(matrix))
