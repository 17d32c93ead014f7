"""Effect: what one figure is in two runs, and how far they are apart."""

from dataclasses import dataclass

from optsat.campaign.intervals import Interval

SIGNIFICANT = 0.05


@dataclass(frozen=True)
class Effect:
    """What one figure is in both runs, and how far the second is from the first.

    what : "metric", or "mean", "median", "95 % quantile", "rate" of the column `of`
    cases_a, cases_b : how many entered; interval : None where there is none, and `by` says why
    adjusted_p : of all effects of the comparison together, by Holm
    """

    what: str
    of: str
    a: float
    b: float
    cases_a: int
    cases_b: int
    interval: Interval | None
    by: str
    adjusted_p: float | None = None

    @property
    def significant(self) -> bool:
        """Whether the difference is larger than chance explains."""
        return self.adjusted_p is not None and self.adjusted_p < SIGNIFICANT
