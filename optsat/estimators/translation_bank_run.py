"""Translation bank run: faults of GPS receiver and accelerometer, and the orbit, from telemetry."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from optsat.arrays import Array, finite_array
from optsat.errors import InputError
from optsat.estimators.bank_input import logs_together, sorted_samples, stacked
from optsat.estimators.bank_model import BankModel
from optsat.estimators.bank_result import BankResult
from optsat.estimators.bank_run import run_bank
from optsat.estimators.translation_bank import TranslationBank
from optsat.estimators.translation_bank_model import translation_bank_model
from optsat.kernels.kernel import Kernel
from optsat.kernels.open_kernel import make_kernel
from optsat.models.accelerometer import Axes
from optsat.records.telemetry import Telemetry

_ARRAYS = {"gps_N": "gps_r_N", "accelerometer": "accelerometer"}


class TranslationBankFilter:
    """A bank compiled, or taken from the cache, ready to run on logs and sample by sample.

    bank : its parameters; model : its functions; kernel : one step, which takes and gives arrays by the names of its
    ports and may be called with many runs at once
    """

    def __init__(self, bank: TranslationBank | None = None) -> None:
        """bank : the defaults unless given."""
        self.bank = TranslationBank() if bank is None else bank
        self.model: BankModel = translation_bank_model(self.bank)
        self.kernel: Kernel = make_kernel(self.model.kernel_source(f"translation_bank_{self.model.structure.modes}"))

    def start(self, r_N: ArrayLike, v_N: ArrayLike) -> dict[str, Array]:
        """Return the state of N runs before their first sample, by the names of the kernel's ports.

        r_N : (N, 3) [m]; v_N : (N, 3) [m/s], both known to the priors of the bank

        Raises
        ------
        InputError : other shapes, or not finite.
        """
        r = finite_array("r_N", r_N, (None, 3), "m")
        v = finite_array("v_N", v_N, (len(r), 3), "m/s")
        return self.model.state_at_start({"r_N": r, "v_N": v}, self.bank.fault_prior)

    def run(
        self,
        telemetry: Telemetry | Sequence[Telemetry],
        r_N: ArrayLike | None = None,
        v_N: ArrayLike | None = None,
        q_BN: ArrayLike | None = None,
        specific_force_B: ArrayLike | None = None,
        keep_modes: bool = True,
        after: BankResult | None = None,
    ) -> BankResult:
        """Return what the bank finds in one log, or in N logs of equally many rows.

        r_N : (3,) or (N, 3) [m], v_N : (3,) or (N, 3) [m/s] : at the first row, as well known as the bank's priors say
        q_BN : (N, T, 4) attitude at every row, such as that of an attitude bank; needed where axes of B are read
        specific_force_B : (N, T, 3) of forces known on board, from the row before to each row [m/s^2]; else none
        keep_modes : whether the result holds the probability of every mode at every row
        after : result of the rows before these, to go on from; then no start is needed

        Raises
        ------
        InputError : shapes differ, a log lacks a sensor of the bank, or the attitude is needed and not given.
        BankFailedError : a number is beyond all measure.
        """
        logs = logs_together(telemetry)
        samples = sorted_samples(self.model, {port: stacked(logs, name) for port, name in _ARRAYS.items()})
        shape = (len(logs), len(logs[0]))
        if q_BN is None and self.bank.axes is Axes.BODY:
            raise InputError("`q_BN` (N, T, 4) is needed: this bank reads accelerations along the axes of B.")
        identity = np.broadcast_to([0.0, 0.0, 0.0, 1.0], (*shape, 4))
        held = {
            "q_BN": identity if q_BN is None else finite_array("q_BN", q_BN, (*shape, 4)),
            "specific_force_B": np.zeros((*shape, 3))
            if specific_force_B is None
            else finite_array("specific_force_B", specific_force_B, (*shape, 3), "m/s^2"),
        }
        t = np.stack([log.t for log in logs])
        if after is not None:
            if len(after.t) != len(logs):
                raise InputError(f"`after` is the result of {len(after.t)} logs, got {len(logs)} to go on with.")
            return run_bank(self.model, self.kernel, after.state, t, held, samples, keep_modes, after)
        if r_N is None or v_N is None:
            raise InputError("`r_N` [m] and `v_N` [m/s] at the first row are needed to start from.")
        state = self.start(*(_rows(name, value, len(logs)) for name, value in (("r_N", r_N), ("v_N", v_N))))
        return run_bank(self.model, self.kernel, state, t, held, samples, keep_modes)


def _rows(name: str, value: ArrayLike, runs: int) -> Array:
    array = finite_array(name, value)
    if array.shape not in ((3,), (runs, 3)):
        raise InputError(f"`{name}` must have shape (3,) or ({runs}, 3), got {array.shape}.")
    return np.broadcast_to(array, (runs, 3)).copy()
