"""Record: what is known of a compiled kernel without loading it."""

import json
from dataclasses import asdict, dataclass
from typing import Any

from optsat.kernels.unit import Real
from optsat.port import Port


@dataclass(frozen=True)
class KernelRecord:
    """Ports and origin of one compiled kernel.

    source : SHA-256 of the C text for one sample at a time, the same on every machine; text : of the C text compiled
    key : SHA-256 over text, flags, compiler, target, C library and ABI
    library : SHA-256 of the compiled library; empty where none is, as is the key
    has_short_loops : that pay to be unrolled
    width : samples in a tile; has_tiles : whether the kernel computes on tiles
    libm : C functions used whose last bits depend on the machine; none means the same bits everywhere
    operations : arithmetic operations of one sample, or of one iteration where they are not fixed
    target : the processor as the compiler was told it; features : instruction sets of the machine it was built on
    """

    name: str
    real: Real
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    has_status: bool = False
    libm: tuple[str, ...] = ()
    operations: int = 0
    source: str = ""
    text: str = ""
    key: str = ""
    library: str = ""
    width: int = 1
    has_tiles: bool = False
    has_short_loops: bool = False
    compiler: str = ""
    flags: tuple[str, ...] = ()
    target: tuple[str, ...] = ()
    c_library: str = ""
    features: tuple[str, ...] = ()

    def to_json(self) -> str:
        """Return the record as JSON."""
        return json.dumps(asdict(self), separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> "KernelRecord":
        """Return the record that `to_json` wrote.

        Raises
        ------
        ValueError, TypeError, KeyError : the text is none.
        """
        document = json.loads(text)
        for name in ("inputs", "outputs"):
            document[name] = tuple(Port(**_with_tuples(port)) for port in document[name])
        return cls(**_with_tuples(document))

    def __str__(self) -> str:
        ports = f"({', '.join(map(str, self.inputs))}) -> {', '.join(map(str, self.outputs))}"
        return f"{self.name}{ports}{', status' if self.has_status else ''}; {self.real}, {self.operations} operations"


def _with_tuples(document: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in document.items()}
