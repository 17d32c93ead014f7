"""Targets: the computers that kernels are exported for, their compilers, and the simulators that run a self-test."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Precision = Literal["float", "double"]


@dataclass(frozen=True)
class Target:
    """One kind of flight computer.

    compilers : names of the C compiler, the first found is used; flags : that choose the processor
    simulator : command in front of a self-test's file; () runs the file itself
    optimisation : flag that suits it
    link : flags of a self-test; files : of `optsat/export/c` that a self-test is linked with
    natural : precision of its floating-point unit; the other one is refused by nobody but may be slow
    """

    name: str
    says: str
    compilers: tuple[str, ...]
    natural: Precision
    optimisation: str
    flags: tuple[str, ...] = ()
    simulator: tuple[str, ...] = ()
    link: tuple[str, ...] = ()
    files: tuple[str, ...] = ()

    @property
    def prefix(self) -> str:
        """What stands before the names of the binary tools, such as `nm`."""
        return "arm-none-eabi-" if self.files else ""


def _cortex(name: str, natural: Precision, unit: str, board: str) -> Target:
    processor = name.removeprefix("cortex-")
    return Target(
        name=name,
        says=f"Arm Cortex-{processor.upper()} with the floating-point unit {unit}",
        compilers=("arm-none-eabi-gcc",),
        natural=natural,
        optimisation="-Os",
        flags=(f"-mcpu={name}", "-mthumb", "-mfloat-abi=hard", f"-mfpu={unit}"),
        simulator=(
            *("qemu-system-arm", "-M", board, "-cpu", name, "-nographic", "-monitor", "none", "-serial", "none"),
            *("-semihosting-config", "enable=on,target=native", "-kernel"),
        ),
        link=("--specs=rdimon.specs", "-T", "board.ld"),
        files=("cortex_m/start.c", "cortex_m/board.ld"),
    )


TARGETS: Mapping[str, Target] = {
    target.name: target
    for target in (
        Target("desktop", "this computer", ("cc", "gcc", "clang"), "double", "-O2"),
        _cortex("cortex-m4", "float", "fpv4-sp-d16", "mps2-an386"),
        _cortex("cortex-m7", "double", "fpv5-d16", "mps2-an500"),
    )
}
"""Target by name."""
