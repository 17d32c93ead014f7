"""Certificate: a claim that a stand-alone check accepts or rejects without any solver."""

from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True)
class Verdict:
    """Outcome of a check: whether the claim stands, and why not."""

    accepted: bool
    reason: str

    def __bool__(self) -> bool:
        return self.accepted


class Certificate(Protocol):
    """What every certificate offers."""

    @property
    def claim(self) -> str:
        """The claim, one sentence with its figures."""
        ...

    @property
    def error_bound(self) -> float:
        """Guaranteed error in the answer's unit."""
        ...

    def margin(self) -> float:
        """Signed slack of the recomputed proof: >= 0 when the claim stands."""
        ...

    def verify(self) -> Verdict:
        """Recompute the proof from the stored data; no solver is imported."""
        ...

    def to_json(self) -> str:
        """Return the certificate as a JSON text that `from_json` restores exactly."""
        ...
