"""Thrusters: one pair for each axis of the body, whose torque may differ from the command when they fail."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array, finite_array
from optsat.errors import InputError
from optsat.models.faults import Fault, ThrusterFaultKind
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


@dataclass(frozen=True)
class ThrusterPairs:
    """Two thrusters for each axis of B, `arm` [m] from the centre of mass, of force `force` [N] at most nominally.

    greatest_torque : about each axis with the valves fully open [N m]; also what a pair stuck open gives
    signed : whether a pair also turns the body the other way, so that commands may be negative

    Raises
    ------
    InputError : a number is not finite and > 0, or the nominal torque exceeds the greatest.
    Source: seed 000 eq. (14) and its table of the spacecraft.
    """

    force: float = 5.0
    arm: float = 0.5
    greatest_torque: float = 12.0
    signed: bool = False

    def __post_init__(self) -> None:
        check_scalar("force", self.force, "N", low=0.0, low_open=True)
        check_scalar("arm", self.arm, "m", low=0.0, low_open=True)
        check_scalar("greatest_torque", self.greatest_torque, "N m", low=self.nominal_torque)

    @property
    def nominal_torque(self) -> float:
        """Torque of one pair at its nominal force, 2 force arm [N m]."""
        return 2 * self.force * self.arm

    def torque(self) -> GeneratedFunction:
        """Return torque_B = responds efficiency command + (1 - responds) held [N m], axis by axis.

        responds : 1 where the valves follow the command, 0 where they do not; efficiency in [0, 1]; held [N m]

        healthy: responds 1, efficiency 1; reduced: 1, in (0, 1); closed: 1, 0; locked: 0, held constant; open: 0, held
        = greatest torque.
        Source: seed 000 eq. (14), u = sigma lambda u_c + (1 - sigma) u_delta; its Greek letters are restored.
        """
        import casadi as ca

        command, responds, efficiency, held = (
            ca.SX.sym(name, 3) for name in ("command_torque_B", "responds", "efficiency", "held_torque_B")
        )
        return generate(
            "thruster_torque",
            inputs=[
                (Port("command_torque_B", (3,), "N m"), command),
                (Port("responds", (3,), "-", lower=0.0, upper=1.0), responds),
                (Port("efficiency", (3,), "-", lower=0.0, upper=1.0), efficiency),
                (Port("held_torque_B", (3,), "N m"), held),
            ],
            outputs=[(Port("torque_B", (3,), "N m"), responds * efficiency * command + (1 - responds) * held)],
        )

    def condition(self, t: Array, faults: Sequence[Fault]) -> tuple[Array, Array, Array]:
        """Return responds, efficiency and held_torque_B, each (..., 3), at times t (...) [s]; faults of sensors are
        left out, and of two faults of an axis at once the later in the list counts.
        """
        responds, efficiency = np.ones((*t.shape, 3)), np.ones((*t.shape, 3))
        held = np.zeros((*t.shape, 3))
        for fault in faults:
            if not fault.part.is_thruster:
                continue
            at = fault.active(t), fault.part.axis
            responds[at], efficiency[at], held[at] = self._stuck(fault)
        return responds, efficiency, held

    def _stuck(self, fault: Fault) -> tuple[float, float, float]:
        if fault.kind is ThrusterFaultKind.REDUCED:
            return 1.0, fault.value[0], 0.0
        if fault.kind is ThrusterFaultKind.CLOSED:
            return 1.0, 0.0, 0.0
        if fault.kind is ThrusterFaultKind.OPEN:
            return 0.0, 1.0, self.greatest_torque
        return 0.0, 1.0, fault.value[0]

    def check_command(self, name: str, command_torque_B: object) -> Array:
        """Return commands (..., 3) [N m] that the thrusters can follow.

        Raises
        ------
        InputError : not numbers, above the greatest torque, or negative though a pair turns one way only.
        """
        command = finite_array(name, command_torque_B, None, "N m")  # type: ignore[arg-type]
        if command.ndim == 0 or command.shape[-1] != 3:
            raise InputError(f"`{name}` must have shape (..., 3) [N m], got {command.shape}.")
        least = -self.greatest_torque if self.signed else 0.0
        refused = np.argwhere((command < least) | (command > self.greatest_torque))
        if len(refused):
            *rows, axis = map(int, refused[0])
            value = float(command[(*rows, axis)])
            row = f" of row {rows[0]}" if rows else ""
            cure = " Set `signed` where a pair turns both ways." if -self.greatest_torque <= value < 0 else ""
            raise InputError(
                f"`{name}` must be from {least:g} to {self.greatest_torque:g} [N m]: axis {'xyz'[axis]}{row} holds "
                f"{value:g}.{cure}"
            )
        return command
