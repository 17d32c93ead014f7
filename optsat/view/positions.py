"""Positions: the instants of a long record that a slider offers, faults and refusals kept before all others."""

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


def slider_positions(state: NDArray[np.int8], marked: Mask, most: int) -> Indices:
    """Return at most `most` epochs in order: both sides of every change, the marked epochs, then even steps.

    state : (T, k) what the epochs are told apart by; marked : (T,) faults and refusals

    Where there is no room, the earlier of these three is thinned last, and evenly.
    """
    count = len(state)
    if count <= most:
        return np.arange(count)
    change = np.any(state[1:] != state[:-1], axis=1)
    edge = np.zeros(count, dtype=bool)
    edge[[0, -1]] = True
    edge[:-1] |= change
    edge[1:] |= change
    kept = np.zeros(count, dtype=bool)
    for wanted in (edge & marked, edge, marked, np.ones(count, dtype=bool)):
        room = most - int(kept.sum())
        fresh = np.flatnonzero(wanted & ~kept)
        if len(fresh) > room:
            fresh = (
                fresh[np.unique(np.linspace(0, len(fresh) - 1, room).round().astype(np.int64))] if room else fresh[:0]
            )
        kept[fresh] = True
    return np.flatnonzero(kept)
