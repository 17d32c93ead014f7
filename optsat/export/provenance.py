"""Provenance: what a generated file was made of, in words that are the same whenever and wherever it is made."""

from collections.abc import Sequence
from dataclasses import dataclass

from optsat._version import __version__
from optsat.export.definition import Definition, sha256
from optsat.export.glossary import conditions, described
from optsat.export.interface import Interface
from optsat.export.target import Precision, Target
from optsat.port import Port

EMITTER = "1"
"""Version of the generated text; raised when the same model gives other C."""


@dataclass(frozen=True)
class Measured:
    """What only compiling and running a kernel tells; None where it was not done.

    stack : bytes; outside : library functions that come on top; compiler : that measured it
    error : of float against double, largest over the stored vectors
    """

    stack: int | None = None
    outside: tuple[str, ...] = ()
    compiler: str = ""
    error: float | None = None


def provenance(
    definition: Definition, interface: Interface, target: Target, precision: Precision, measured: Measured
) -> list[str]:
    """Return the lines of the comment at the head of the header and the source."""
    source = definition.source
    operations = ", ".join(f"{code} {count}" for code, count in definition.operations.items())
    return [
        f"kernel        {source.name}",
        f"model         SHA-256 {definition.model}",
        f"parameters    SHA-256 {definition.parameters_hash}",
        *(f"    {name} = {value}" for name, value in sorted(definition.parameters.items())),
        f"body          SHA-256 {sha256(source.body)}",
        f"made with     optsat {__version__}, emitter {EMITTER}, CasADi {casadi_version()}",
        f"real type     {precision}",
        f"operations    {source.operations}{' of one iteration' if source.has_status else ''}: {operations}",
        f"libm          {', '.join(source.libm) or 'none, so the bits are the same on every IEEE machine'}",
        f"stack         {_stack(target, measured)}",
        *_error(precision, measured),
        "",
        "Arguments:",
        *_listed(source.inputs),
        "Results:",
        *_listed(source.outputs),
        *(["State: " + ", ".join(port.name for port in interface.state)] if interface.state else []),
    ]


def casadi_version() -> str:
    """Return the version of CasADi, which the symbolic functions come from."""
    import casadi as ca

    return str(ca.CasadiMeta.version())


def _stack(target: Target, measured: Measured) -> str:
    if measured.stack is None:
        return f"not measured: no compiler for {target.name} that states it"
    outside = f", and what {', '.join(measured.outside)} takes" if measured.outside else ""
    return f"at most {measured.stack} bytes on {target.name}{outside} ({measured.compiler})"


def _error(precision: Precision, measured: Measured) -> list[str]:
    if precision == "double":
        return []
    if measured.error is None:
        return ["float error   not measured: the self-test was not run"]
    return [f"float error   at most {measured.error:.3g} against double over the stored vectors, in the results' units"]


def _listed(ports: Sequence[Port]) -> list[str]:
    lines = []
    for port in ports:
        checked = conditions(port)
        lines.append(f"    {port.name} {port.shape} {described(port)}" + (f"; {checked}" if checked else ""))
    return lines
