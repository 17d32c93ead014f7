"""Bank: hypotheses that share a state, each with its own Gaussian filter and probability."""

import math
from collections.abc import Sequence

from optsat.errors import InputError
from optsat.kernels.definition import Definition, lower_or, with_twin
from optsat.kernels.evaluate import evaluator
from optsat.kernels.instantiate import instantiate, operation_count
from optsat.kernels.sizes import check_size
from optsat.kernels.slots import column, identity, of_one, second
from optsat.kernels.source import KernelSource
from optsat.kernels.twins.bank import BankTwin
from optsat.port import Port

LARGEST_FLOOR = 1e-30
"""A larger floor lets modes that are impossible push their far-off states into the others at every step."""


def bank(
    each: Definition | KernelSource,
    modes: int,
    per_mode: Sequence[str],
    floor: float = 1e-60,
    restore: Definition | None = None,
    near: Definition | None = None,
    name: str | None = None,
) -> KernelSource:
    """Return the kernel of one step of an interacting multiple model estimator with up to `modes` modes.

    (x, P, log_probability, ..., transition, count) -> (x, P, log_probability, failed, mean, covariance, log_evidence)

    each : filter of one mode, (x, P, ...) -> (x, P, ..., log_likelihood, ...), perhaps with a result `definite`
    per_mode : arguments of the filter that differ between modes, one row each; the others all modes share
    x : (modes, n); P : (modes, n * n), symmetric matrices by rows; log_probability : (modes,), of any sum
    transition : (modes, modes), of row i the probabilities to go from mode i to each other, which sum to one
    count : modes in use, the first ones; what belongs to the others is not looked at and passes through
    failed : (modes,) 1 where the filter of a mode failed: its mixed state stays, its probability is the floor
    mean, covariance : (n,), (n, n) of all modes together; log_evidence : log density of the measurement
    floor : of a mode's probability, at most 1e-30; kept as a logarithm, so that in float it does not vanish
    restore : x -> x after a mean, such as scaling a quaternion to length one
    near : (reference, x) -> x of the same meaning on the side of the reference, such as the sign of a quaternion

    Status: OS_E_RANGE where count or transition are none, OS_E_STATE where all filters failed, OS_E_NOT_FINITE for such
    an argument; all results but `failed` are then NaN.

    Raises
    ------
    InputError : modes is not from 2 to 128, the filter has not these arguments and results, or the floor is too high.

    Source: Blom & Bar-Shalom, IEEE Trans. Automatic Control 33 (1988); moments about the most probable state.
    """
    kernel = name or f"{each.name}_bank"
    check_size(kernel, "modes", modes, 2, 128)
    if not 0.0 < floor <= LARGEST_FLOOR:
        raise InputError(
            f"{kernel}: `floor` must be in (0, {LARGEST_FLOOR:g}], got {floor!r}: with a larger one, modes that are "
            "impossible push their far-off states into the others. For likelier changes of mode raise `transition`."
        )
    n = _check_ports(kernel, each, per_mode)
    one, run = with_twin(each, [port.name for port in each.inputs])
    places, strides, ports, transition = _layout(each.inputs[2:], per_mode, modes, n)
    starts = [0]
    for port in each.outputs:
        starts.append(starts[-1] + port.size)
    offset = {port.name: start for port, start in zip(each.outputs, starts, strict=False)}
    likelihood = offset["log_likelihood"]
    programs = {
        "restore": lower_or(restore, identity("restore", n)),
        "near": lower_or(near, second("near", column(n, "reference"), column(n, "x"))),
        "exp": of_one("EXP"),
        "log": of_one("LOG"),
    }
    leaves = {slot: evaluator(program) for slot, program in programs.items()}
    definite = offset.get("definite", likelihood)
    states, covariances = Port("x", (modes, n), "SI"), Port("P", (modes, n * n), "SI")
    probability = Port("log_probability", (modes,), "-")
    arguments = len(places)
    return instantiate(
        "bank",
        kernel,
        {"filter": one, **programs},
        {
            "MODES": modes,
            "N": n,
            "ARGUMENTS": arguments,
            "RESULTS": starts[-1],
            "LIKELIHOOD": likelihood,
            "DEFINITE": definite,
            "TRANSITION": transition,
        },
        inputs=(
            *(states, covariances, probability, *ports),
            Port("transition", (modes, modes), "-", lower=0.0, upper=1.0),
            Port("count", (), "-", lower=1.0, upper=float(modes), safe=1.0),
        ),
        outputs=(
            *(states, covariances, probability, Port("failed", (modes,), "-", lower=0.0, upper=1.0)),
            *(Port("mean", (n,), "SI"), Port("covariance", (n, n), "SI", positive_definite=True)),
            Port("log_evidence", (), "-"),
        ),
        constants={"FLOOR": math.log(floor)},
        tables={"PLACE": places, "STRIDE": strides},
        twin=BankTwin(
            run,
            **leaves,
            modes=modes,
            n=n,
            place=tuple(places),
            stride=tuple(strides),
            transition=transition,
            likelihood=likelihood,
            definite=definite,
            floor=math.log(floor),
        ),
        operations=modes * operation_count(one) + (modes + 1) * modes * (3 * n + 2 * n * (n + 1)) + 4 * modes * modes,
    )


def _check_ports(kernel: str, one: Definition | KernelSource, per_mode: Sequence[str]) -> int:
    first, results = [port.name for port in one.inputs[:2]], [port.name for port in one.outputs]
    if first != ["x", "P"] or results[:2] != ["x", "P"] or "log_likelihood" not in results:
        raise InputError(
            f"{kernel}: {one.name} must take x and P first and give x, P and log_likelihood, got "
            f"({', '.join(port.name for port in one.inputs)}) -> ({', '.join(results)})."
        )
    known = [port.name for port in one.inputs[2:]]
    if unknown := [each for each in per_mode if each not in known]:
        raise InputError(f"{kernel}: `per_mode` names `{unknown[0]}`, {one.name} takes {', '.join(known)}.")
    return one.inputs[0].size


def _layout(
    others: Sequence[Port], per_mode: Sequence[str], modes: int, n: int
) -> tuple[list[int], list[int], list[Port], int]:
    """Where each argument of the filter stands for mode 0, and how far from it that of the next; the bank's ports."""
    places, strides, ports = [0] * (n + n * n), [0] * (n + n * n), []
    at = modes * (n + n * n + 1)
    for port in others:
        own = port.name in per_mode
        places += range(at, at + port.size)
        strides += [port.size if own else 0] * port.size
        at += modes * port.size if own else port.size
        rows = (modes, port.size) if port.shape else (modes,)
        ports.append(Port(port.name, rows, port.unit, lower=port.lower, upper=port.upper) if own else port)
    return places, strides, ports, at
