"""Solution: the answer, why the solver stopped, what is proven, and residuals recomputed from the problem."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from optsat.errors import NotProvenError

if TYPE_CHECKING:
    from optsat.certificates.certificate import Certificate

A = TypeVar("A")


class Termination(enum.Enum):
    """Why the solver stopped."""

    CONVERGED = "converged"
    MAX_ITERATIONS = "iteration limit reached"
    TIME_LIMIT = "time limit reached"
    STALLED = "no further progress"
    NUMERICAL_ERROR = "numerical error"


class Proof(enum.Enum):
    """What is proven about the answer, whatever the solver said."""

    NOTHING = "nothing is proven"
    UNDECIDED = "the check was not sharp enough to decide"
    FEASIBLE = "the answer satisfies the constraints"
    STATIONARY = "the answer satisfies the first-order conditions"
    GLOBAL = "the answer is a global optimum"
    INFEASIBLE = "no answer exists"


_STRENGTH = {Proof.NOTHING: 0, Proof.UNDECIDED: 0, Proof.FEASIBLE: 1, Proof.STATIONARY: 2, Proof.GLOBAL: 3}


@dataclass(frozen=True)
class Solution(Generic[A]):
    """What `solve` returns.

    answer : the problem's own result type
    termination, proof : why the solver stopped, what is proven; two different facts
    residuals : recomputed from the problem, never the solver's opinion
    certificate : a proof that `verify()` re-checks without a solver, where the problem has one
    stats : solver name, iterations and what else is worth reading
    """

    answer: A
    termination: Termination
    proof: Proof
    residuals: Mapping[str, float] = field(default_factory=dict)
    certificate: "Certificate | None" = None
    stats: Mapping[str, Any] = field(default_factory=dict)

    def require(self, proof: Proof) -> "Solution[A]":
        """Return self when at least `proof` is established.

        Raises
        ------
        NotProvenError : it is not; the solution is kept in `error.solution`.
        """
        enough = self.proof is proof or (
            self.proof in _STRENGTH and proof in _STRENGTH and _STRENGTH[self.proof] >= _STRENGTH[proof] > 0
        )
        if not enough:
            raise NotProvenError(
                f"{proof.name} was required ({proof.value}), but {self.proof.value}; "
                f"the solver stopped because: {self.termination.value}. The answer is kept in error.solution.",
                self,
            )
        return self
