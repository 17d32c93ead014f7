"""Isolability: nats by independent routes, exact zeros, what is said about them."""

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.errors import InputError
from optsat.estimators.isolability import AdditiveFault, Isolability, isolability
from optsat.models.linear_discrete import LinearDiscreteModel, LinearSensor
from optsat.models.single_axis import single_axis

TORQUE = AdditiveFault("torque", {"torque": 3.0})
GYRO = AdditiveFault("gyro", {"gyro": 0.3})
STAR = AdditiveFault("star", {"star": 0.01})


def simulated(model: LinearDiscreteModel, x: Array, u: Array, w: Array, added: Array) -> Array:
    """Outputs (N, p) of the difference equation, sample after sample, each over its sensor's sigma."""
    outputs = []
    for u_k, w_k, added_k in zip(u, w, added, strict=True):
        outputs.append((model.C @ x + model.D @ u_k + added_k) / model.sigma)
        x = np.asarray(model.A) @ x + np.asarray(model.B) @ u_k + w_k
    return np.array(outputs)


def responses(model: LinearDiscreteModel, samples: int, what: str, name: str = "") -> Array:
    """Outputs to a unit first state, rate noise of one sigma, or unit signal, one column for each unknown."""
    n, m, p = len(np.asarray(model.A)), len(model.inputs), len(model.sensors)
    columns = []
    for k in range(n if what == "state" else samples):
        x, u, w, added = np.zeros(n), np.zeros((samples, m)), np.zeros((samples, n)), np.zeros((samples, p))
        if what == "state":
            x[k] = 1.0
        elif what == "noise":
            w[k, -1] = np.sqrt(np.asarray(model.Q)[-1, -1])
        elif name in model.inputs:
            u[k, model.inputs.index(name)] = 1.0
        else:
            added[k, [sensor.name for sensor in model.sensors].index(name)] = 1.0
        columns.append(simulated(model, x, u, w, added).ravel())
    return np.array(columns).T


def by_least_squares(model: LinearDiscreteModel, samples: int, fault: AdditiveFault, others: tuple[str, ...]) -> float:
    """Half the least of |residual / sigma|^2 + |noise|^2: no covariance of the outputs, no projector."""
    (name,) = fault.sizes
    signal = np.where(np.arange(samples) * model.dt >= fault.onset - 1e-9, fault.sizes[name], 0.0)
    change = responses(model, samples, "signal", name) @ signal
    free = np.hstack(
        [responses(model, samples, "state"), *(responses(model, samples, "signal", other) for other in others)]
    )
    noise = responses(model, samples, "noise")
    system = np.block([[noise, free], [np.eye(samples), np.zeros((samples, free.shape[1]))]])
    goal = np.append(change, np.zeros(samples))
    length = np.linalg.norm(system, axis=0)
    system = system[:, length > 0] / length[length > 0]
    return 0.5 * float(np.sum((goal - system @ np.linalg.lstsq(system, goal, rcond=1e-12)[0]) ** 2))


@pytest.mark.parametrize(
    "sensors",
    [("star", "gyro"), ("gyro",), ("star",), ("star", "gyro", "second gyro"), ("gyro", "second gyro", "pressure")],
)
def test_nats_are_those_of_a_least_squares_fit_with_the_noise_as_unknowns(sensors: tuple[str, ...]) -> None:
    model = single_axis(sensors)
    faults = [TORQUE, *(fault for fault in (GYRO, STAR) if fault.name in sensors)]
    result = isolability(model, faults, 3.0)
    for i, fault in enumerate(faults):
        assert result.detection[i] == pytest.approx(by_least_squares(model, 30, fault, ()), rel=1e-7)
        rest = tuple(other.name for other in faults if other is not fault)
        assert result.against_others[i] == pytest.approx(by_least_squares(model, 30, fault, rest), rel=1e-7, abs=1e-7)
        for j, other in enumerate(faults):
            if i != j:
                expected = by_least_squares(model, 30, fault, (other.name,))
                assert result.distinguishability[i, j] == pytest.approx(expected, rel=1e-7, abs=1e-7)
                assert result.indistinguishable[i, j] == (expected < 1e-7)


def test_nats_are_the_mean_log_likelihood_ratio_of_simulated_runs() -> None:
    model, samples, runs = single_axis(), 50, 400
    rng = np.random.default_rng(6)
    free = np.hstack([responses(model, samples, "state"), responses(model, samples, "signal", "star")])
    noise = responses(model, samples, "noise")
    system = np.block([[noise, free], [np.eye(samples), np.zeros((samples, free.shape[1]))]])
    length = np.linalg.norm(system, axis=0)
    basis = np.linalg.qr(system[:, length > 0] / length[length > 0])[0]
    pad = np.zeros(samples)
    signal = np.where(np.arange(samples) >= 10, 3.0, 0.0)
    change = np.append(responses(model, samples, "signal", "torque") @ signal, pad)

    def misfit(goal: Array) -> float:
        return 0.5 * float(np.sum((goal - basis @ (basis.T @ goal)) ** 2))

    ratios = []
    for _ in range(runs):
        w = np.column_stack([np.zeros(samples), rng.normal(0, np.sqrt(1e-6), samples)])
        y = simulated(model, rng.normal(size=2), signal[:, None], w, rng.normal(size=(samples, 2)) * model.sigma)
        goal = np.append(y.ravel(), pad)
        ratios.append(misfit(goal) - misfit(goal - change))
    nats = isolability(model, [TORQUE, STAR], 5.0).distinguishability[0, 1]
    # the ratio is Gaussian with variance twice its mean
    assert np.mean(ratios) == pytest.approx(nats, abs=3.5 * np.sqrt(2 * nats / runs))
    assert np.var(ratios) == pytest.approx(2 * nats, rel=0.3)


def test_closed_forms() -> None:
    pressure = isolability(single_axis(("gyro", "pressure")), [TORQUE, GYRO], 5.0)
    # the pressure alone: 40 samples of 3 N m at 0.5 N m
    assert pressure.distinguishability[0, 1] == pytest.approx(40 * (3 / 0.5) ** 2 / 2, rel=1e-9)
    # the difference of two gyros alone: 40 samples of 0.3 rad/s at sqrt(2) 0.01 rad/s
    gyros = isolability(single_axis(("gyro", "second gyro")), [TORQUE, GYRO], 5.0)
    assert gyros.distinguishability[1, 0] == pytest.approx(40 * (0.3 / 0.01) ** 2 / 4, rel=1e-9)


def test_the_size_of_a_fault_scales_the_nats_and_not_the_zeros() -> None:
    faults = [AdditiveFault("torque", {"torque": 3e-9}), AdditiveFault("gyro", {"gyro": 3e6})]
    with_star = isolability(single_axis(), faults, 5.0)
    assert not with_star.indistinguishable.any()
    assert with_star.detection[0] == pytest.approx(isolability(single_axis(), [TORQUE], 5.0).detection[0] * 1e-18)
    assert isolability(single_axis(("gyro",)), faults, 5.0).indistinguishable.sum() == 2


@pytest.mark.parametrize("window", [0.5, 2.0, 20.0])
def test_zeros_do_not_depend_on_the_window(window: float) -> None:
    faults = [AdditiveFault(fault.name, fault.sizes, 0.2) for fault in (TORQUE, GYRO, STAR)]
    result = isolability(single_axis(), faults, window)
    assert not result.indistinguishable.any()
    assert result.masked.all()
    assert result.groups(0.0) == ()


def test_it_says_what_cannot_be_told() -> None:
    double = optsat.isolability(single_axis(), [TORQUE, GYRO, STAR], 5.0)
    assert double.says[0] == (
        "A fault of torque is told from each other fault, but not from gyro and star failing together."
    )
    pair = isolability(single_axis(("gyro",)), [TORQUE, GYRO], 5.0)
    assert pair.says == (
        "Faults of torque and gyro cannot be told apart with gyro: what the one does to the measurements in 5 s, the "
        "other can do as well.",
    )
    assert pair.groups() == (("torque", "gyro"),)
    assert double.groups() == ()
    assert double.groups(10.0) == (("torque", "star"),)
    assert isolability(single_axis(), [TORQUE, GYRO], 5.0).says == ()


def blind() -> Isolability:
    """Torque with a pressure transducer only: a step on the first state's like cannot be seen."""
    model = LinearDiscreteModel(
        np.eye(2),
        [[0.0, 1.0], [1.0, 0.0]],
        np.zeros((2, 2)),
        ("seen", "hidden"),
        (LinearSensor("s", [0.0, 1.0], 1.0),),
        1.0,
    )
    faults = [AdditiveFault(name, {name: 1.0}, 1.0) for name in ("seen", "hidden", "s")]
    return isolability(model, faults, 6.0)


def test_faults_that_nothing_sees() -> None:
    result = blind()
    assert result.undetectable.tolist() == [False, True, False]
    assert result.says[0].startswith("A fault of hidden cannot be seen at all with s: in 6 s")
    assert len(result.says) == 3
    assert result.groups() == (("seen", "hidden", "s"),)


def test_small_faults_are_hardly_told() -> None:
    small = AdditiveFault("torque", {"torque": 1.6})
    (line, *_) = isolability(single_axis(), [small, STAR, AdditiveFault("gyro", {"gyro": 1e-4})], 5.0).says[3:]
    assert line == (
        "A fault of torque of this size is hardly told from one of star: 2.5 nats in 5 s, a decision needs 3."
    )
    (line,) = isolability(single_axis(), [AdditiveFault("torque", {"torque": 0.3})], 5.0).says
    assert line == "A fault of torque of this size is hardly seen: 0.12 nats in 5 s, a decision needs 3."


def test_a_zero_that_rounding_hides_is_flagged() -> None:
    # position of a chain of six integrators: the signal of the far end is nearly drowned in the first state
    chain = np.eye(6) + np.eye(6, k=1)
    position = LinearSensor("position", np.eye(6)[0], 1.0)
    model = LinearDiscreteModel(chain, np.eye(6)[:, 5:], np.zeros((6, 6)), ("far",), (position,), 1.0)
    long = isolability(model, [AdditiveFault("far", {"far": 1.0}), AdditiveFault("position", {"position": 1.0})], 200.0)
    assert not long.clear
    assert long.says[-1].startswith("Rounding hides whether some zeros are exact")
    assert isolability(single_axis(), [TORQUE, GYRO, STAR], 20.0).clear


def test_a_fault_covered_one_way_only() -> None:
    model = single_axis(("star", "gyro"))
    faults = [GYRO, AdditiveFault("electronics", {"gyro": 0.1, "star": 0.01})]
    result = isolability(model, faults, 5.0)
    assert result.indistinguishable.tolist() == [[False, True], [False, False]]
    assert result.says[0].startswith(
        "A fault of gyro cannot be told from one of electronics with star, gyro: what it does"
    )


@pytest.mark.parametrize(
    ("faults", "window", "message"),
    [
        ([], 5.0, "`faults` is empty"),
        ([TORQUE, TORQUE], 5.0, "2 are called `torque`"),
        (
            [AdditiveFault("x", {"gyra": 1.0})],
            5.0,
            "`gyra` is no input and no sensor of the model. Did you mean `gyro`",
        ),
        ([TORQUE], 1.0, "sets in at 1 s, after the window of 1 s"),
        ([TORQUE], 5.03, "whole number of samples of 0.1 s, got 5.03 s"),
        ([TORQUE], 0.0, "whole number of samples"),
        ([TORQUE], float("nan"), "`window` must be finite"),
        ([TORQUE], 250.0, "more than 4000 outputs"),
    ],
)
def test_bad_questions(faults: list[AdditiveFault], window: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        isolability(single_axis(), faults, window)


def test_bad_faults() -> None:
    with pytest.raises(InputError, match="fault `x` changes nothing"):
        AdditiveFault("x", {})
    with pytest.raises(InputError, match="sizes of fault x"):
        AdditiveFault("x", {"gyro": float("inf")})
    with pytest.raises(InputError, match="`onset` must not be negative, got -1 s"):
        AdditiveFault("x", {"gyro": 1.0}, -1.0)
