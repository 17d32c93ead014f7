"""Interface: which ports of a kernel are arguments, results and kept state of its flight form."""

from dataclasses import dataclass
from functools import cached_property

from optsat.errors import InputError, nearest_name
from optsat.kernels.source import KernelSource
from optsat.port import Port

RESERVED = frozenset({"count", "scaled", "ready"})
"""Members that the flight form adds to its structures."""


@dataclass(frozen=True)
class Interface:
    """The flight form of a kernel: a function of structures, with a state where something is carried over.

    A port that is argument and result of the same name is state, where there are other arguments. Results in `kept` are
    state too: after a failure they hold their last good value.

    Raises
    ------
    InputError : a kept result is unknown, or a port has the name of a member that the flight form adds.
    """

    source: KernelSource
    kept: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [port.name for port in self.source.outputs]
        for name in self.kept:
            if name not in names:
                raise InputError(f"{self.source.name} has no result `{name}` to keep.{nearest_name(name, names)}")
        for port in (*self.source.inputs, *self.source.outputs):
            if port.name in RESERVED:
                raise InputError(f"{self.source.name}: the flight form needs the name `{port.name}`; rename the port.")
        if not self.source.inputs or not self.source.outputs:
            raise InputError(f"{self.source.name} needs an argument and a result to be flight code.")
        for port in self.state:
            if port.counted or port.direction is not None:
                raise InputError(f"{self.source.name}: {port} is state, so it has no count and needs `unit_norm`.")
        if len({port.shape[0] for port in self.counted}) > 1:
            listed = ", ".join(map(str, self.counted))
            raise InputError(
                f"{self.source.name}: ports with one run-time count must have equally many rows: {listed}."
            )

    @cached_property
    def recurrent(self) -> tuple[Port, ...]:
        """Arguments that a step replaces by results of the same name."""
        results = {port.name: port for port in self.source.outputs}
        found = tuple(p for p in self.source.inputs if p.name in results and results[p.name].shape == p.shape)
        # with nothing else to take, it is a map of one quantity, such as a switch to another chart, and no step
        return found if len(found) < len(self.source.inputs) else ()

    @cached_property
    def state(self) -> tuple[Port, ...]:
        """What is carried from one step to the next."""
        carried = {port.name for port in self.recurrent}
        return (*self.recurrent, *(p for p in self.source.outputs if p.name in self.kept and p.name not in carried))

    @cached_property
    def arguments(self) -> tuple[Port, ...]:
        """Members of the structure `in`."""
        carried = {port.name for port in self.recurrent}
        return tuple(port for port in self.source.inputs if port.name not in carried)

    @property
    def counted(self) -> tuple[Port, ...]:
        """Arguments whose number of rows is told at run time."""
        return tuple(port for port in self.source.inputs if port.counted)

    @property
    def scales(self) -> bool:
        """Whether arguments are scaled to length 1 and counted."""
        return any(port.direction is not None for port in self.source.inputs)

    @property
    def verdicts(self) -> tuple[Port, ...]:
        """Results that are 1 where the others can be trusted."""
        return tuple(port for port in self.source.outputs if port.verdict)

    @property
    def has_work(self) -> bool:
        """Whether the caller gives working memory: a template's, not a leaf's."""
        return self.source.has_status

    @cached_property
    def first_in(self) -> dict[str, int]:
        """Where each argument begins in x."""
        return _firsts(self.source.inputs)

    @cached_property
    def first_out(self) -> dict[str, int]:
        """Where each result begins in y."""
        return _firsts(self.source.outputs)

    @property
    def length_in(self) -> int:
        """Numbers in x."""
        return sum(port.size for port in self.source.inputs)

    @property
    def length_out(self) -> int:
        """Numbers in y."""
        return sum(port.size for port in self.source.outputs)

    @property
    def initial(self) -> str:
        """Name of the function that sets the state."""
        return f"{self.source.name.removesuffix('_step')}_init"

    @property
    def function(self) -> str:
        """Name of the function that computes; with a state it makes one step, and its name says so."""
        name = self.source.name
        return name if not self.state or name.endswith("_step") else f"{name}_step"

    @property
    def functions(self) -> tuple[str, ...]:
        """The functions that the flight form exports."""
        return (self.initial, self.function) if self.state else (self.function,)


def _firsts(ports: tuple[Port, ...]) -> dict[str, int]:
    found, first = {}, 0
    for port in ports:
        found[port.name] = first
        first += port.size
    return found
