"""Catalogue: every kernel that is offered by name, where its definition stands, and what it takes."""

import importlib
import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

from optsat.errors import InputError, UnknownOptionError, nearest_name
from optsat.kernels.source import KernelSource
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction

Kernel: TypeAlias = GeneratedFunction | KernelSource
Precision: TypeAlias = Literal["double", "float"]

ARITHMETIC: Mapping[Precision, Mapping[str, float]] = {
    "double": {"tiny": 1e-300, "rounding": 2.0**-52},
    "float": {"tiny": 1e-30, "rounding": 2.0**-23},
}
"""What a definition may ask of the numbers it will run on: the least divisor, and the spacing of numbers at 1."""

_DOCUMENTED = re.compile(r"^(\w+(?:, \w+)*) : (.+)$", re.MULTILINE)


@dataclass(frozen=True)
class Parameter:
    """One number or choice that is built into a kernel: its name, its default, and what it means."""

    name: str
    default: Any
    says: str


@dataclass(frozen=True)
class Entry:
    """One kernel that is offered.

    definition : "module:function", a function of keyword parameters that returns a generated function or kernel source
    fixed : parameters that the name stands for, such as the number of vectors
    """

    definition: str
    says: str
    fixed: Mapping[str, Any] = field(default_factory=dict)

    def function(self) -> Callable[..., Kernel]:
        """Return the defining function; nothing is built."""
        module, _, name = self.definition.partition(":")
        found: Callable[..., Kernel] = getattr(importlib.import_module(module), name)
        return found

    def parameters(self) -> tuple[Parameter, ...]:
        """Return what a caller may choose; nothing is built."""
        function = self.function()
        said = _said_of_parameters(inspect.getdoc(function) or "")
        return tuple(
            Parameter(each.name, each.default, said.get(each.name, ""))
            for each in inspect.signature(function).parameters.values()
            if each.name not in self.fixed
        )


@dataclass(frozen=True)
class Description:
    """A kernel as it was built: its ports and the operations of one sample."""

    name: str
    says: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    operations: int

    def __str__(self) -> str:
        ports = f"({', '.join(map(str, self.inputs))}) -> {', '.join(map(str, self.outputs))}"
        return f"{self.name}: {self.says}\n  {ports}\n  {self.operations} operations"


CATALOGUE: Mapping[str, Entry] = {
    **{
        name: Entry(f"optsat.symbolic.attitude_functions:{name}", says)
        for name, says in {
            "dcm_from_quaternion": "direction cosine matrix of a quaternion",
            "quaternion_from_dcm": "quaternion of a direction cosine matrix, half turns included",
            "mrp_from_quaternion": "modified Rodrigues parameters of a quaternion, in the unit ball",
            "quaternion_from_mrp": "quaternion of modified Rodrigues parameters, shadow set or not",
            "mrp_switch": "modified Rodrigues parameters taken to the shadow set where they leave the unit ball",
            "rotation_vector_from_quaternion": "axis times angle of a quaternion, the angle at most pi",
            "quaternion_from_rotation_vector": "quaternion of axis times angle",
            "euler321_from_quaternion": "yaw, pitch and roll of a quaternion",
            "quaternion_from_euler321": "quaternion of yaw, pitch and roll",
            "quaternion_compose": "attitude of C relative to N from those of C to B and B to N",
            "quaternion_error_angle": "angle between two attitudes, accurate where it is small",
        }.items()
    },
    "rigid_body_step": Entry(
        "optsat.export.model_kernels:rigid_body_step", "attitude and angular velocity of a rigid body after dt, by RK4"
    ),
    "magnetic_field": Entry(
        "optsat.export.model_kernels:magnetic_field", "the Earth's magnetic field at a place, as a tilted dipole"
    ),
    "sun": Entry(
        "optsat.export.model_kernels:sun", "direction of the Sun, and whether a place is in the Earth's shadow"
    ),
    **{
        f"wahba_{n}": Entry(
            "optsat.estimators.wahba_quartic:wahba_quartic",
            f"attitude of least weighted squared error from {n} vectors, with its margin of observability",
            {"vectors": n},
        )
        for n in range(2, 11)
    },
    "certified_two_vector": Entry(
        "optsat.estimators.certified_pair:certified_two_vector",
        "attitude from two vectors of bounded error, with the angle that its error never exceeds",
    ),
    **{
        f"certified_attitude_{n}": Entry(
            "optsat.kernels.certified_attitude:certified_attitude",
            f"attitude from {n} vectors of bounded error, with the angle that its error never exceeds",
            {"vectors": n},
        )
        for n in range(2, 11)
    },
    "extended_filter_7": Entry(
        "optsat.estimators.attitude_filter:extended_filter_7",
        "extended Kalman filter step of attitude and angular velocity, star tracker and gyro",
    ),
    "unscented_filter_7": Entry(
        "optsat.estimators.attitude_filter:unscented_filter_7",
        "unscented Kalman filter step of attitude and angular velocity, star tracker and gyro",
    ),
    "unscented_filter_7_loops": Entry(
        "optsat.estimators.unscented_loops:unscented_filter_7_loops",
        "the same unscented Kalman filter step in loops, for little flash",
    ),
    **{
        f"attitude_bank_{modes}": Entry(
            "optsat.estimators.bank_kernels:attitude_bank",
            f"step of {modes} joint hypotheses of faults of {what}, with attitude, rate and torques",
            {"modes": modes},
        )
        for modes, what in {
            16: "gyro and star tracker",
            32: "gyro, star tracker and thrusters together",
            128: "gyro, star tracker and thrusters axis by axis",
        }.items()
    },
    "translation_bank_16": Entry(
        "optsat.estimators.bank_kernels:translation_bank_16",
        "step of 16 joint hypotheses of faults of GPS receiver and accelerometer, with position and velocity",
    ),
}
"""Entry by public name."""


def build(name: str, precision: Precision = "double", **parameters: Any) -> Kernel:
    """Return the kernel of that name.

    precision : of the arithmetic it will run in, for kernels that depend on its rounding or smallest divisor
    parameters : those of `CATALOGUE[name].parameters()`

    Raises
    ------
    InputError : no such kernel or precision (the nearest name is offered), or a parameter that its definition refuses.
    UnknownOptionError : the kernel has no such parameter; the nearest is offered.
    """
    return entry_named(name).function()(**chosen(name, precision, parameters))


def chosen(name: str, precision: Precision, parameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keyword arguments of the definition: what the caller chose, the precision asks, and the name fixes.

    Raises
    ------
    InputError, UnknownOptionError : as for `build`.
    """
    entry = entry_named(name)
    if precision not in ARITHMETIC:
        raise InputError(f"`precision` must be 'double' or 'float', got {precision!r}.")
    known = [parameter.name for parameter in entry.parameters()]
    for given in parameters:
        if given not in known:
            hint = nearest_name(given, known) if known else " It takes none."
            raise UnknownOptionError(f"Kernel {name} has no parameter `{given}`.{hint}")
    needed = {key: value for key, value in ARITHMETIC[precision].items() if key in known}
    return {**needed, **parameters, **entry.fixed}


def entry_named(name: str) -> Entry:
    """Return the entry of that name.

    Raises
    ------
    InputError : there is none; the nearest name is offered.
    """
    if name not in CATALOGUE:
        raise InputError(f"There is no kernel `{name}`.{nearest_name(name, list(CATALOGUE))}")
    return CATALOGUE[name]


def describe(name: str, precision: Precision = "double", **parameters: Any) -> Description:
    """Build the kernel of that name and return its ports and operation count.

    Raises
    ------
    InputError, UnknownOptionError : as for `build`.
    """
    from optsat.kernels.lowering import lower

    kernel = build(name, precision, **parameters)
    operations = kernel.operations if isinstance(kernel, KernelSource) else lower(kernel.casadi).operation_count
    return Description(name, entry_named(name).says, kernel.inputs, kernel.outputs, operations)


def _said_of_parameters(docstring: str) -> dict[str, str]:
    return dict(_said_one_by_one(docstring))


def _said_one_by_one(docstring: str) -> Iterator[tuple[str, str]]:
    for names, says in _DOCUMENTED.findall(docstring):
        for name in names.split(", "):
            yield name, says
