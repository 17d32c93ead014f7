"""Linear discrete model: a system near an operating point, its inputs and its scalar sensors, all by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import InputError, nearest_name
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, port_named


@dataclass(frozen=True, eq=False)
class LinearSensor:
    """One scalar channel y = H x + D u + noise; units are the channel's own.

    name : what faults and tables call it
    H : (n,) sensitivity to each state
    sigma : standard deviation of its white noise, a sample
    D : (m,) sensitivity to each input; None for none
    cost : what it costs to add it, in any unit; only compared

    Raises
    ------
    InputError : not finite; sigma not positive; cost negative.
    """

    name: str
    H: ArrayLike
    sigma: float
    D: ArrayLike | None = None
    cost: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "H", finite_array(f"{self.name}.H", self.H, (None,)))
        if self.D is not None:
            object.__setattr__(self, "D", finite_array(f"{self.name}.D", self.D, (None,)))
        sigma = float(finite_array(f"{self.name}.sigma", self.sigma, ()))
        if not sigma > 0.0:
            raise InputError(
                f"sensor `{self.name}`: sigma must be above 0, got {sigma:g}; no channel is without noise."
            )
        if not float(finite_array(f"{self.name}.cost", self.cost, ())) >= 0.0:
            raise InputError(f"sensor `{self.name}`: cost must not be negative, got {self.cost:g}.")


@dataclass(frozen=True, eq=False)
class LinearDiscreteModel:
    """x(k+1) = A x(k) + B u(k) + w(k), one scalar channel for each sensor, sampled every dt [s].

    inputs : name of each column of B
    Q : (n, n) covariance of w, a step; positive semi-definite

    Raises
    ------
    InputError : shapes do not fit, a name appears twice, Q is not symmetric positive semi-definite, dt not positive.
    """

    A: ArrayLike
    B: ArrayLike
    Q: ArrayLike
    inputs: tuple[str, ...]
    sensors: tuple[LinearSensor, ...]
    dt: float

    def __post_init__(self) -> None:
        n = len(finite_array("A", self.A, (None, None)))
        for name, shape in (("A", (n, n)), ("B", (n, len(self.inputs))), ("Q", (n, n))):
            object.__setattr__(self, name, finite_array(name, getattr(self, name), shape))
        if not float(finite_array("dt", self.dt, (), "s")) > 0.0:
            raise InputError(f"`dt` must be above 0 s, got {self.dt:g}.")
        _check_covariance(np.asarray(self.Q))
        if not self.sensors:
            raise InputError("`sensors` is empty: a model without a sensor has no outputs. Give at least one.")
        for sensor in self.sensors:
            self._check_sensor(sensor)
        _check_distinct([*self.inputs, *(sensor.name for sensor in self.sensors)])

    def _check_sensor(self, sensor: LinearSensor) -> None:
        finite_array(f"{sensor.name}.H", sensor.H, (len(np.asarray(self.A)),))
        if sensor.D is not None:
            finite_array(f"{sensor.name}.D", sensor.D, (len(self.inputs),))

    @property
    def C(self) -> Array:
        """(p, n) sensitivity of the channels to the states."""
        return np.array([sensor.H for sensor in self.sensors])

    @property
    def D(self) -> Array:
        """(p, m) sensitivity of the channels to the inputs."""
        none = np.zeros(len(self.inputs))
        return np.array([none if sensor.D is None else sensor.D for sensor in self.sensors])

    @property
    def sigma(self) -> Array:
        """(p,) standard deviation of the channels."""
        return np.array([sensor.sigma for sensor in self.sensors])

    def channel(self, name: str) -> tuple[Array, Array]:
        """Return how an additive fault on an input or a sensor enters: (n,) the states' step, (p,) the outputs.

        Raises
        ------
        InputError : no input and no sensor has this name.
        """
        names = [sensor.name for sensor in self.sensors]
        if name in self.inputs:
            column = self.inputs.index(name)
            return np.asarray(self.B)[:, column], self.D[:, column]
        if name in names:
            return np.zeros(len(np.asarray(self.A))), np.eye(len(names))[names.index(name)]
        raise InputError(
            f"`{name}` is no input and no sensor of the model.{nearest_name(name, [*self.inputs, *names])}"
        )

    def with_sensors(self, *added: LinearSensor) -> "LinearDiscreteModel":
        """Return the model with these sensors behind its own."""
        return replace(self, sensors=(*self.sensors, *added))


def linear_model(
    step: GeneratedFunction,
    measurement: GeneratedFunction,
    at: Mapping[str, ArrayLike],
    *,
    states: Sequence[str],
    inputs: Sequence[str],
    Q: ArrayLike,
    sigma: Mapping[str, ArrayLike],
    dt: float,
) -> LinearDiscreteModel:
    """Return the linear model of a symbolic step and measurement at an operating point, Jacobians exact.

    A vector port gives one channel an entry, named `port[0]`, `port[1]`, ...; a scalar port keeps its name.

    Parameters
    ----------
    step : outputs are the next states, in the order of `states`
    measurement : of any of the same arguments; each output is a sensor
    at : value of every argument of both functions
    states, inputs : names of arguments of `step`
    Q : (n, n) covariance of the step, all states joined
    sigma : standard deviation by output of `measurement`, a number or one an entry
    dt : time between samples [s]

    Raises
    ------
    InputError : a name is unknown, a value or sigma is missing, a shape does not fit.
    """
    sizes = {name: port_named(step.inputs, name, step.name).size for name in (*states, *inputs)}
    A, B = (_jacobian(step, {name: sizes[name] for name in names}, at) for names in (states, inputs))
    H, D = (_jacobian(measurement, {name: sizes[name] for name in names}, at) for names in (states, inputs))
    sigmas = np.concatenate([_sigma_of(port, sigma) for port in measurement.outputs])
    names = [name for port in measurement.outputs for name in _channels(port)]
    sensors = tuple(LinearSensor(name, h, float(s), d) for name, h, s, d in zip(names, H, sigmas, D, strict=True))
    ports = {port.name: port for port in step.inputs}
    return LinearDiscreteModel(A, B, Q, tuple(c for name in inputs for c in _channels(ports[name])), sensors, dt)


def _jacobian(function: GeneratedFunction, arguments: Mapping[str, int], at: Mapping[str, ArrayLike]) -> Array:
    """All outputs by these arguments, whose sizes are given; those the function does not have change nothing."""
    values, own = _values(function, at), {port.name for port in function.inputs}
    rows = []
    for output in function.outputs:
        row = [np.zeros((output.size, 0))]
        for name, size in arguments.items():
            none = np.zeros((output.size, size))
            row.append(function.jacobian(output.name, name)(**values) if name in own else none)
        rows.append(np.hstack(row))
    return np.vstack(rows)


def _values(function: GeneratedFunction, at: Mapping[str, ArrayLike]) -> dict[str, Any]:
    missing = [port.name for port in function.inputs if port.name not in at]
    if missing:
        raise InputError(
            f"`at` lacks {', '.join(f'`{name}`' for name in missing)}: {function.name} is linearised at a value of "
            "every argument."
        )
    return {port.name: at[port.name] for port in function.inputs}


def _channels(port: Port) -> list[str]:
    return [port.name] if port.size == 1 else [f"{port.name}[{i}]" for i in range(port.size)]


def _sigma_of(port: Port, sigma: Mapping[str, ArrayLike]) -> Array:
    if port.name not in sigma:
        raise InputError(f"`sigma` lacks the output `{port.name}` [{port.unit}].")
    value = finite_array(f"sigma[{port.name!r}]", sigma[port.name], unit=port.unit)
    if value.shape not in ((), (port.size,)):
        raise InputError(f"`sigma[{port.name!r}]` must be a number or ({port.size},) [{port.unit}], got {value.shape}.")
    return np.full(port.size, value)


def _check_covariance(Q: Array) -> None:
    largest = float(np.max(np.abs(Q), initial=0.0))
    if not np.allclose(Q, Q.T, rtol=0.0, atol=1e-9 * largest):
        raise InputError(
            f"`Q` must be symmetric, its halves differ by {np.max(np.abs(Q - Q.T)):.3g}. Use (Q + Q.T) / 2."
        )
    least = float(np.min(np.linalg.eigvalsh(Q)))
    if least < -1e-12 * largest:
        raise InputError(f"`Q` must be positive semi-definite, its least eigenvalue is {least:.3g}.")


def _check_distinct(names: Sequence[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"`{name}` names {names.count(name)} inputs or sensors. Give each its own name.")
