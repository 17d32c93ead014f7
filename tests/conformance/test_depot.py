"""Attitude problem depot: every method right or refused, every certificate valid and good, nothing silently wrong."""

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
import pytest

import optsat
from optsat.arrays import Array
from optsat.attitude import dcm, quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.determine import WahbaMethod
from optsat.errors import InputError, NotProvenError, UnsupportedFormError

Problem = dict[str, Any]
Depot = Callable[[str], list[Problem]]
Grade = Literal["right", "digits", "WRONG"]

METHODS: tuple[WahbaMethod, ...] = get_args(WahbaMethod)


@pytest.fixture(scope="module")
def depot(shared_data: Callable[[str], Path]) -> Depot:
    folder = shared_data("depot")

    def read(*names: str) -> list[Problem]:
        return [problem for name in names for problem in json.loads((folder / f"{name}.json").read_text())["problems"]]

    return lambda which: read("classical", "hard") if which == "posed" else read("refused")


def numbers(value: Any) -> Array:
    return np.array(value, dtype=np.float64)


def data(problem: Problem) -> tuple[Array, Array, Array, Array]:
    b_B, r_N, weights, bound = (numbers(problem[name]) for name in ("b_B", "r_N", "weights", "angle_bound_rad"))
    return b_B, r_N, weights, bound


def radius(expected: Problem) -> float:
    return float(expected["radius_rad"])


def turned(q_BN: Array, expected: Any) -> float:
    wanted = numbers(expected)
    return float(quaternion.error_angle(q_BN, wanted / np.linalg.norm(wanted)))


def grade(error_rad: float, tolerance_rad: float) -> Grade:
    if error_rad <= tolerance_rad:
        return "right"
    return "digits" if error_rad <= max(1e-6, 10 * tolerance_rad) else "WRONG"


def wahba_verdict(problem: Problem, method: WahbaMethod) -> str:
    """Return `refused`, `right`, `digits`, `unbounded` (with an optimal answer) or `WRONG`."""
    b_B, r_N, weights, _ = data(problem)
    try:
        solution = optsat.wahba(b_B, r_N, weights, method=method, norm_policy="silent")
    except (NotProvenError, UnsupportedFormError):
        return "refused"
    answer, expected = solution.answer, problem["expect"]
    if solution.proof is not optsat.Proof.GLOBAL or answer.status.name != expected["status"]:
        return "WRONG"
    if answer.status is AttitudeStatus.OK:
        return grade(turned(answer.q_BN, expected["q_BN"]), expected["tolerance_rad"])
    missed = 1 - answer.q_BN @ numbers(expected["optimal_set_projector"]) @ answer.q_BN
    smallest = expected.get("q_BN_smallest_rotation")
    if abs(missed) > 1e-12 or (smallest is not None and turned(answer.q_BN, smallest) > 1e-12):
        return "WRONG"
    return "unbounded"


@pytest.mark.parametrize("method", METHODS)
def test_no_method_is_silently_wrong(depot: Depot, method: WahbaMethod) -> None:
    verdicts = {problem["name"]: wahba_verdict(problem, method) for problem in depot("posed")}
    assert not [name for name, verdict in verdicts.items() if verdict in ("WRONG", "digits")]
    expected = {
        "davenport": {"right": 49, "unbounded": 6},
        "svd": {"right": 49, "unbounded": 6},
        "two_vector": {"right": 27, "refused": 28},
        "triad": {"right": 15, "refused": 40},
    }
    assert Counter(verdicts.values()) == expected[method]


def test_answers_of_the_default_method_in_every_field(depot: Depot) -> None:
    for problem in depot("posed"):
        b_B, r_N, weights, _ = data(problem)
        answer, expected = optsat.wahba(b_B, r_N, weights, norm_policy="silent").answer, problem["expect"]
        assert answer.loss == pytest.approx(float(expected["loss"]), rel=1e-9, abs=1e-20), problem["name"]
        assert answer.weights.sum() == pytest.approx(1.0, abs=1e-15)
        assert len(answer.free_axes_B) == expected["top_eigenvalue_multiplicity"] - 1, problem["name"]
        np.testing.assert_allclose(answer.dcm_BN, dcm.from_quaternion(answer.q_BN), atol=0)
        if expected["status"] == "OK":
            tolerance = 2 * expected["tolerance_rad"]
            np.testing.assert_allclose(answer.dcm_BN, numbers(expected["dcm_BN"]), atol=tolerance, rtol=0)


def certificate_fault(attitude: optsat.CertifiedAttitude, exact: Problem, accepted: list[str]) -> str | None:
    """Return what is wrong with a certified attitude by the depot's grading, None when nothing is."""
    if attitude.status.name not in accepted:
        return f"status {attitude.status.name}, accepted {accepted}"
    if not attitude.certificate.verify():
        return f"not verified: {attitude.certificate.verify().reason}"
    if attitude.status is not AttitudeStatus.OK or exact["status"] != "OK":
        return None
    if attitude.bound_rad < radius(exact) * (1 - 1e-9):
        return f"invalid: {attitude.bound_rad} below {exact['radius_rad']}"
    if attitude.bound_rad > 1.01 * radius(exact) + 1e-6:
        return f"not good: {attitude.bound_rad} against {exact['radius_rad']}"
    return None


def test_certificates_at_the_given_weights(depot: Depot) -> None:
    faults = {}
    for problem in depot("posed"):
        b_B, r_N, weights, bound = data(problem)
        attitude = optsat.certify_attitude(b_B, r_N, bound, weights=weights, norm_policy="silent")
        exact = problem["expect"]["certificate"]
        # a contradiction of two directions may be proven where the given weights alone prove nothing
        accepted = [exact["status"], *problem.get("accept_certificate_status", [])]
        faults[problem["name"]] = certificate_fault(attitude, exact, accepted)
    assert not {name: fault for name, fault in faults.items() if fault}
    assert len(faults) == 55


def test_certificates_at_the_best_weights(depot: Depot) -> None:
    """Two vectors against the exact radius; more vectors no worse than the given weights, wherever these prove."""
    faults = {}
    for problem in depot("posed"):
        b_B, r_N, _, bound = data(problem)
        attitude = optsat.certify_attitude(b_B, r_N, bound, norm_policy="silent")
        given, best = problem["expect"]["certificate"], problem["expect"].get("certificate_best_weights")
        fault = None
        if best is not None:
            fault = certificate_fault(attitude, best, problem.get("accept_certificate_status", [best["status"]]))
        elif not attitude.certificate.verify():
            fault = "not verified"
        elif given["status"] == "INCONSISTENT":
            fault = None if attitude.status is AttitudeStatus.INCONSISTENT else "inconsistency missed"
        elif given["status"] == "OK" and not attitude.bound_rad <= radius(given) * (1 + 1e-4):
            fault = f"{attitude.bound_rad} above the bound {given['radius_rad']} of the given weights"
        faults[problem["name"]] = fault
    assert not {name: fault for name, fault in faults.items() if fault}


def test_the_truth_lies_within_every_bound(depot: Depot) -> None:
    compared = 0
    for problem in depot("posed"):
        # the truth is stated as admissible by the presence of its angle to the optimum
        if "angle_to_true_rad" not in problem["expect"] or "q_true_BN" not in problem:
            continue
        b_B, r_N, _, bound = data(problem)
        attitude = optsat.certify_attitude(b_B, r_N, bound, norm_policy="silent")
        assert turned(attitude.q_BN, problem["q_true_BN"]) <= attitude.bound_rad, problem["name"]
        compared += 1
    assert compared >= 24


def test_the_faulty_pair_is_named(depot: Depot) -> None:
    faulty = [problem for problem in depot("posed") if "faulty_pair" in problem]
    assert len(faulty) == 1
    b_B, r_N, _, bound = data(faulty[0])
    isolation = optsat.isolate(b_B, r_N, bound)
    assert isolation.candidates == ((faulty[0]["faulty_pair"],),)
    assert isolation.isolated


def refused_argument(problem: Problem, name: str) -> Any:
    """Return one argument of a refused problem, its words nan and inf read as numbers, other words left as they are."""
    words = {"nan": np.nan, "inf": np.inf}

    def read(value: Any) -> Any:
        return [read(item) for item in value] if isinstance(value, list) else words.get(value, value)

    return read(problem[name])


def test_all_refused_inputs_name_their_argument(depot: Depot) -> None:
    refused = depot("refused")
    assert len(refused) == 16
    calls: Counter[str] = Counter()
    for problem in refused:
        b_B, r_N, weights, bound = (refused_argument(problem, n) for n in ("b_B", "r_N", "weights", "angle_bound_rad"))
        named = problem["expect"]["argument_named"].split(", ")
        if named != ["angle_bound_rad"]:
            with pytest.raises(InputError) as caught:
                optsat.wahba(b_B, r_N, weights)
            assert all(f"`{name}`" in str(caught.value) for name in named), problem["name"]
            calls["wahba"] += 1
        with pytest.raises(InputError) as caught:
            optsat.certify_attitude(b_B, r_N, bound, weights=weights)
        assert all(f"`{name}`" in str(caught.value) for name in named), problem["name"]
        calls["certify_attitude"] += 1
    assert calls == {"wahba": 12, "certify_attitude": 16}
