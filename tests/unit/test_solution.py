"""Solution: a required proof is there, or the error keeps the answer."""

import itertools

import numpy as np
import pytest

import optsat
from optsat.errors import NotProvenError
from optsat.solution import Proof, Solution, Termination


def solution(proof: Proof, termination: Termination = Termination.CONVERGED) -> Solution[str]:
    return Solution("answer", termination, proof)


ORDER = [Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL]


@pytest.mark.parametrize(("weaker", "stronger"), list(itertools.combinations(ORDER, 2)))
def test_a_stronger_proof_satisfies_a_weaker_demand_only(weaker: Proof, stronger: Proof) -> None:
    assert solution(stronger).require(weaker).proof is stronger
    with pytest.raises(NotProvenError):
        solution(weaker).require(stronger)


@pytest.mark.parametrize("proof", list(Proof))
def test_every_proof_satisfies_itself_and_require_returns_the_same_object(proof: Proof) -> None:
    found = solution(proof)
    assert found.require(proof) is found


@pytest.mark.parametrize("proof", [Proof.NOTHING, Proof.UNDECIDED])
@pytest.mark.parametrize("demand", [*ORDER, Proof.INFEASIBLE])
def test_nothing_and_undecided_prove_nothing(proof: Proof, demand: Proof) -> None:
    with pytest.raises(NotProvenError):
        solution(proof).require(demand)


def test_infeasible_stands_beside_the_order() -> None:
    for proof in ORDER:
        for held, demanded in ((proof, Proof.INFEASIBLE), (Proof.INFEASIBLE, proof)):
            with pytest.raises(NotProvenError):
                solution(held).require(demanded)


def test_the_error_keeps_the_solution_and_says_both_facts() -> None:
    found = solution(Proof.FEASIBLE, Termination.MAX_ITERATIONS)
    with pytest.raises(NotProvenError) as caught:
        found.require(Proof.GLOBAL)
    assert caught.value.solution is found
    message = str(caught.value)
    for fact in (
        "GLOBAL was required",
        "the answer satisfies the constraints",
        "iteration limit reached",
        "error.solution",
    ):
        assert fact in message


def test_triad_on_data_that_disagree_is_kept_in_the_error() -> None:
    b_B = np.array([(1.0, 0, 0), (np.cos(1.1), np.sin(1.1), 0)])
    r_N = np.array([(1.0, 0, 0), (np.cos(1.0), np.sin(1.0), 0)])
    with pytest.raises(NotProvenError) as caught:
        optsat.wahba(b_B, r_N, (3, 1), method="triad")
    kept = caught.value.solution
    assert isinstance(kept, Solution)
    np.testing.assert_allclose(kept.answer.dcm_BN @ r_N[0], b_B[0], atol=1e-15)
    assert kept.residuals["distance_to_optimum_rad"] == pytest.approx(0.025, rel=0.01)
