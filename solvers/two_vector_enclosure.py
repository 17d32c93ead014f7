"""Two cones: the weights of the smallest provable ball in closed form (one bounded scalar search)."""

from dataclasses import dataclass

from optsat.attitude.davenport import quaternion_from_dcm
from optsat.attitude.two_vector import best_weights, collinear, wahba_dcm
from optsat.forms import EnclosureForm, Point, required
from optsat.solution import Termination


@dataclass(frozen=True)
class TwoVectorEnclosure:
    """Golden section on the log weight ratio in its exact bracket. Source: robust Wahba specification section 6."""

    name: str = "two_vector_enclosure"

    def accepts(self, form: object) -> bool:
        """Return whether the set is bounded by exactly two non-collinear cones."""
        return (
            isinstance(form, EnclosureForm)
            and form.admissible.count == form.admissible.cone_count == 2
            and not collinear(form.admissible.b_B, form.admissible.r_N)
        )

    def run(self, form: object, start: Point | None = None) -> Point:
        """Return the optimal weights (`dual`) and their Davenport attitude (`x`)."""
        form = required(form, EnclosureForm, self.name)
        known = form.admissible
        weights = best_weights(known.b_B, known.r_N, known.angle_bound_rad)
        q_BN = quaternion_from_dcm(wahba_dcm(known.b_B, known.r_N, weights))
        return Point(x=q_BN, dual=weights, termination=Termination.CONVERGED, iterations=24)
