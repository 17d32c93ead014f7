"""Attitude bank run: faults, attitude and torques from the telemetry of one or many spacecraft."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, Mask, finite_array
from optsat.errors import InputError
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.attitude_bank_model import attitude_bank_model
from optsat.estimators.bank_input import logs_together, sorted_samples, stacked
from optsat.estimators.bank_model import BankModel
from optsat.estimators.bank_result import BankResult
from optsat.estimators.bank_run import run_bank
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel
from optsat.models.parts import PRESSURE
from optsat.records.telemetry import Telemetry

_COMMAND_SLACK = 1e-9


class AttitudeBankFilter:
    """A bank compiled, or taken from the cache, ready to run on logs and sample by sample.

    bank : its parameters; model : its functions; kernel : one step, which takes and gives arrays by the names of its
    ports and may be called with many runs at once
    """

    def __init__(self, bank: AttitudeBank | None = None) -> None:
        """bank : the defaults unless given."""
        self.bank = AttitudeBank() if bank is None else bank
        self.model: BankModel = attitude_bank_model(self.bank)
        self.kernel: Kernel = make_kernel(self.model.kernel_source(f"attitude_bank_{self.model.structure.modes}"))

    def start(
        self,
        q_BN: ArrayLike,
        omega_BN_B: ArrayLike,
        command_B: ArrayLike,
        fault_prior: ArrayLike | None = None,
        spread: ArrayLike | None = None,
    ) -> dict[str, Array]:
        """Return the state of N runs before their first sample, by the names of the kernel's ports.

        q_BN : (N, 4) [-]; omega_BN_B : (N, 3) [rad/s], both known to the priors of the bank
        command_B : (N, 3) torque commanded until then [N m]
        fault_prior : probability of every fault, or of each; spread : deviation of rotation, rate and, where there is
        one, bias, about each axis; both those of the bank unless given, as after an outage they may not be

        Raises
        ------
        InputError : other shapes, not finite, a quaternion that is not of length 1, or no probability.
        """
        q = finite_array("q_BN", q_BN, (None, 4))
        omega, command = (
            finite_array(name, value, (len(q), 3), unit)
            for name, value, unit in (("omega_BN_B", omega_BN_B, "rad/s"), ("command_B", command_B, "N m"))
        )
        length = np.linalg.norm(q, axis=-1)
        if (np.abs(length - 1.0) > 1e-6).any():
            row = int(np.argmax(np.abs(length - 1.0)))
            raise InputError(f"`q_BN` must be unit quaternions (scalar last): row {row} has length {length[row]:.6g}.")
        known = {
            "q_BN": q / length[:, None],
            "omega_BN_B": omega,
            "last_star_BN": np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(q), 4)),
            "last_command_B": command,
        }
        return self.model.state_at_start(known, self.bank.fault_prior if fault_prior is None else fault_prior, spread)

    def run(
        self,
        telemetry: Telemetry | Sequence[Telemetry],
        q_BN: ArrayLike | None = None,
        omega_BN_B: ArrayLike | None = None,
        keep_modes: bool = True,
        after: BankResult | None = None,
    ) -> BankResult:
        """Return what the bank finds in one log, or in N logs of equally many rows.

        q_BN : (4,) or (N, 4), omega_BN_B : (3,) or (N, 3) [rad/s] : at the first row, as well known as the bank's
        priors say; unless given, those that star tracker and gyro send there
        keep_modes : whether the result holds the probability of every mode at every row
        after : result of the rows before these, to go on from; then no start is needed

        Raises
        ------
        InputError : the logs differ in length or lack a sensor of the bank, or the first row has no valid sample to
            start from. BankFailedError : a number is beyond all measure.
        """
        logs = logs_together(telemetry)
        samples = sorted_samples(self.model, {name: self._stacked(logs, name) for name in self._arrays()})
        command = np.stack([log.command_torque_B for log in logs])
        self._check_command(command)
        if after is None:
            usable = samples.received[:, 0] & ~samples.invalid[:, 0]
            before = command[:, 0]
            state = self.start(*self._first(samples.values, usable, q_BN, omega_BN_B), before)
        else:
            before, state = after.held_on["command_B"], after.state
            if len(before) != len(logs):
                raise InputError(f"`after` is the result of {len(before)} logs, got {len(logs)} to go on with.")
        # a row's command acts from then on, so that up to the next row is the one before
        held = {"command_B": np.concatenate([before[:, None], command[:, :-1]], axis=1)}
        return run_bank(
            self.model,
            self.kernel,
            state,
            np.stack([log.t for log in logs]),
            held,
            samples,
            keep_modes,
            after,
            {"command_B": command[:, -1].copy()},
        )

    def _check_command(self, command: Array) -> None:
        least = -self.bank.greatest_torque if self.bank.signed else 0.0
        beyond = np.argwhere(
            (command < least - _COMMAND_SLACK) | (command > self.bank.greatest_torque + _COMMAND_SLACK)
        )
        if len(beyond):
            log, row, axis = (int(k) for k in beyond[0])
            hint = "" if self.bank.signed else " Thruster pairs that also turn the other way need `signed=True`."
            raise InputError(
                f"`command_torque_B` must be from {least:g} to {self.bank.greatest_torque:g} N m: row {row}, axis "
                f"{axis} of log {log} holds {command[log, row, axis]:g}.{hint}"
            )

    def _arrays(self) -> dict[str, str]:
        """Return the array of the telemetry that each port of samples takes."""
        known = {
            "star_BN": "star_q_BN",
            "gyro_B": "gyro_omega_BN_B",
            "skewed_gyro": "skewed_gyro_rate",
            "pressure_B": "pressure_torque_B",
        }
        return {device.port.name: known[device.port.name] for device in self.model.samples.devices}

    def _stacked(self, logs: Sequence[Telemetry], port: str) -> Array:
        found = stacked(logs, self._arrays()[port])
        if port == "pressure_B":
            found = found[..., [PRESSURE.index(part) for part in self.bank.channels if part in PRESSURE]]
        return found

    def _first(
        self, values: dict[str, Array], usable: Mask, q_BN: ArrayLike | None, omega_BN_B: ArrayLike | None
    ) -> tuple[Array, Array]:
        runs, channels = len(usable), self.model.samples.channels
        star, gyro = values["star_BN"][:, 0], values["gyro_B"][:, 0]
        for name, given, columns in (("q_BN", q_BN, slice(0, 1)), ("omega_BN_B", omega_BN_B, slice(1, 4))):
            if given is None and not usable[:, columns].all():
                run = int(np.argmax(~usable[:, columns].all(axis=1)))
                parts = ", ".join(part.value for part in channels[columns])
                raise InputError(f"Row 0 of log {run} has no valid sample of {parts}; give `{name}` at the first row.")
        q = star / np.linalg.norm(star, axis=-1, keepdims=True) if q_BN is None else _rows("q_BN", q_BN, runs, 4)
        return q, gyro if omega_BN_B is None else _rows("omega_BN_B", omega_BN_B, runs, 3)


def _rows(name: str, value: ArrayLike, runs: int, width: int) -> Array:
    array = finite_array(name, value)
    if array.shape not in ((width,), (runs, width)):
        raise InputError(f"`{name}` must have shape ({width},) or ({runs}, {width}), got {array.shape}.")
    return np.broadcast_to(array, (runs, width)).copy()
