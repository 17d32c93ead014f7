"""Hypothesis bank: all joint hypotheses of independent faults, mixed bit by bit around one prediction."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate

from optsat.errors import InputError
from optsat.kernels.definition import Definition, lower_in_order
from optsat.kernels.evaluate import evaluator
from optsat.kernels.instantiate import instantiate
from optsat.kernels.sizes import check_size
from optsat.kernels.slots import of_one
from optsat.kernels.source import Example, KernelSource
from optsat.kernels.twins.hypothesis_bank import HypothesisBankTwin
from optsat.port import Port

LARGEST_FLOOR = 1e-30
"""A larger floor lets impossible modes push their far-off states into the others at every step."""

INVALID = -1000.0
"""Log density of a sample that a healthy channel cannot send, such as a quaternion of length zero."""

FARTHEST = 36.0
"""Square of the distance, in deviations, from which on the density of an erratic sample falls no further."""

MOST_LANES = 16


@dataclass(frozen=True)
class Channel:
    """What fails as a whole: rows of the measurement, the bit of its fault or None where it never fails.

    erratic_deviation : of each row, what a biased, drifting or noisy channel errs by, in the unit of the row
    """

    rows: int
    bit: int | None
    erratic_deviation: float


@dataclass(frozen=True)
class BankStructure:
    """Sizes and places of a bank.

    states : of the error state, those of failing actuators last
    channels : in the order in which they are used
    actuated : bit of each state that an actuator's fault drives, and its prior variance when it fails
    F_pattern, H_pattern : (row, column) of the numbers that are not zero by structure, by rows
    """

    states: int
    bits: int
    channels: tuple[Channel, ...]
    actuated: tuple[tuple[int, float], ...]
    F_pattern: tuple[tuple[int, int], ...]
    H_pattern: tuple[tuple[int, int], ...]

    @property
    def modes(self) -> int:
        """Number of joint hypotheses; bit b of a mode's number says whether fault b is there."""
        return 1 << self.bits

    @property
    def packed(self) -> int:
        """Numbers of the lower triangle of a covariance."""
        return self.states * (self.states + 1) // 2

    @property
    def measured(self) -> int:
        """Rows of all channels."""
        return sum(channel.rows for channel in self.channels)


def hypothesis_bank(
    name: str,
    structure: BankStructure,
    predict: Definition,
    observe: Definition,
    shift: Definition,
    reference: Sequence[Port],
    carried: Sequence[Port],
    inputs: Sequence[Port],
    floor: float = 1e-60,
    example: Example | None = None,
) -> KernelSource:
    """Return the kernel of one step of a bank of 2^bits Gaussians that share a reference.

    (probability, mean, covariance, reference..., carried..., inputs...) -> (the same without the inputs,
    fault_probability, deviation, deviation_variance, merged_covariance, log_evidence)

    probability : (modes,), of any sum; mean : (states, modes) about the reference
    covariance : (states (states + 1) / 2, modes), lower triangles by rows, semidefinite
    fault_probability : (bits,); deviation, deviation_variance : of each actuated state, where its axis has failed
    merged_covariance : (states, states) of all modes together, whose mean is the reference; log_evidence : log density
    predict : (reference, carried, inputs) -> reference after the motion, F, process noise (states,), chance to fail and
        to recover of each bit, then of each actuated state: shift and variance that a step of the command brings to a
        failed axis, deviation of a healthy one
    observe : (reference, carried, inputs) -> of each channel 0 missing, 1 valid or 2 invalid, and the log density of a
        failed one that needs no state; of each row innovation and noise variance; H; what is carried on
    shift : (reference, state) -> reference moved by an error state
    reference : ends with the deviations that the actuated states are about
    floor : of a mode's probability, at most 1e-30
    example : arguments that belong together, for the self-test of flight code

    Status: OS_E_NOT_FINITE for such an argument, OS_E_STATE where the probabilities are none or a variance is negative,
    OS_E_OUTPUT where a result is not finite; all results are then NaN.

    Raises
    ------
    InputError : more than 10 bits, a floor that is too high, or functions that do not fit the structure.

    Source: Blom & Bar-Shalom, IEEE Trans. Automatic Control 33 (1988), with a transition matrix that is a Kronecker
    product of 2 x 2 chains: one stage for each factor instead of a product with all of it.
    """
    check_size(name, "bits", structure.bits, 1, 10)
    if not 0.0 < floor <= LARGEST_FLOOR:
        raise InputError(
            f"{name}: `floor` must be in (0, {LARGEST_FLOOR:g}], got {floor!r}: with a larger one, modes that are "
            "impossible push their far-off states into the others. For likelier changes raise the chance to fail."
        )
    n, modes, actuated = structure.states, structure.modes, len(structure.actuated)
    sizes = {
        "MODES": modes,
        "HALF": modes // 2,
        "BITS": structure.bits,
        "LANES": min(modes, MOST_LANES),
        "STATES": n,
        "PACKED": structure.packed,
        "ACTUATED": actuated,
        "FIRST_ACTUATED": n - actuated,
        "CHANNELS": len(structure.channels),
        "MEASURED": structure.measured,
        # compilers warn of loops over rows that an array of one could not hold
        "WIDEST": max(3, *(channel.rows for channel in structure.channels)),
        "REFERENCE": sum(port.size for port in reference),
        "CARRIED": sum(port.size for port in carried),
        "INPUTS": sum(port.size for port in inputs),
        "F_NONZEROS": len(structure.F_pattern),
        "H_NONZEROS": len(structure.H_pattern),
    }
    sizes["PREDICTED"] = sizes["REFERENCE"] + sizes["F_NONZEROS"] + n + 2 * structure.bits + 3 * actuated
    sizes["OBSERVED"] = (
        2 * (sizes["CHANNELS"] + sizes["MEASURED"]) + sizes["H_NONZEROS"] + sizes["CARRIED"]
    )  # fmt: skip
    state = (
        Port("probability", (modes,), "-", lower=0.0),
        Port("mean", (n, modes), "SI"),
        Port("covariance", (structure.packed, modes), "SI"),
        *reference,
        *carried,
    )
    outputs = (
        *state,
        Port("fault_probability", (structure.bits,), "-", lower=0.0, upper=1.0 + 1e-9),
        *(Port(each, (actuated,), unit) for each, unit in _DEVIATION if actuated),
        Port("merged_covariance", (n, n), "SI"),
        Port("log_evidence", (), "-"),
    )
    sizes["RESULTS"] = sum(port.size for port in outputs)
    order = [port.name for port in (*reference, *carried, *inputs)]
    programs = {
        "predict": lower_in_order(predict, order),
        "observe": lower_in_order(observe, order),
        "shift": lower_in_order(shift, [*(port.name for port in reference), "state"]),
        "exp": of_one("EXP"),
        "log": of_one("LOG"),
    }
    begins = list(accumulate((channel.rows for channel in structure.channels), initial=0))
    whole = {
        # C has no arrays of length zero
        "BIT_OF_ACTUATED": [bit for bit, _ in structure.actuated] or [-1],
        "BIT_OF_CHANNEL": [-1 if channel.bit is None else channel.bit for channel in structure.channels],
        "CHANNEL_BEGIN": begins,
        "F_BEGIN": _row_starts(structure.F_pattern, n),
        "F_COLUMN": [column for _, column in structure.F_pattern],
        "H_BEGIN": _row_starts(structure.H_pattern, structure.measured),
        "H_COLUMN": [column for _, column in structure.H_pattern],
    }
    real = {
        "PRIOR_VARIANCE": [float(variance) for _, variance in structure.actuated] or [0.0],
        "ERRATIC_VARIANCE": [float(channel.erratic_deviation) ** 2 for channel in structure.channels],
    }
    constants = {
        "FLOOR": floor,
        "INVALID": INVALID,
        "FARTHEST": FARTHEST,
        "LOG_TWO_PI": math.log(2.0 * math.pi),
        "TWICE_LOG_TWO": 2.0 * math.log(2.0),
    }
    return instantiate(
        "hypothesis_bank",
        name,
        programs,
        sizes,
        inputs=(*state, *inputs),
        outputs=outputs,
        constants=constants,
        tables={**whole, **real},
        twin=HypothesisBankTwin(
            structure, sizes, constants, {slot: evaluator(program) for slot, program in programs.items()}
        ),
        operations=_operations(structure) + programs["predict"].operation_count + programs["observe"].operation_count,
        example=example,
        has_short_loops=True,
    )


_DEVIATION = (("deviation", "SI"), ("deviation_variance", "SI"))


def _row_starts(pattern: Sequence[tuple[int, int]], rows: int) -> list[int]:
    return list(accumulate((sum(row == r for row, _ in pattern) for r in range(rows)), initial=0))


def _operations(structure: BankStructure) -> int:
    """Additions, multiplications and divisions of the loops over modes, exponentials and logarithms as twenty each."""
    n, packed = structure.states, structure.packed
    row = [sum(r == i for r, _ in structure.F_pattern) for i in range(n)]
    mixing = structure.bits * (5 + 3 * n + 6 * packed)
    prediction = 2 * sum(row) * (n + 1) + 2 * sum(row[j] * (n - j) for j in range(n))
    update = structure.measured * (2 * n + 4 * packed) + 80 * len(structure.channels)
    return structure.modes * (mixing + prediction + update + 4 * packed + 60)
