"""Point of an alignment solver: why it stopped, read from the curvature at its answer."""

import numpy as np

from optsat.arrays import Array
from optsat.attitude.alignment import Curvature
from optsat.forms import AlignmentForm, Point
from optsat.solution import Termination


def alignment_point(form: AlignmentForm, q_BN: Array, here: Curvature) -> Point:
    """Return the point with CONVERGED at a strict or flat minimum, STALLED at a saddle."""
    stopped = Termination.CONVERGED if here.sharpness > 1 or len(here.free_axes_B) else Termination.STALLED
    return Point(x=q_BN, dual=np.zeros(0), termination=stopped)
