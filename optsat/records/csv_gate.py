"""Gate of a CSV log: which rows are sound, and why each other one was refused."""

from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.records.csv_table import Table
from optsat.records.record import BadRow, Mask


class Gate:
    """The rows in which one measurement is still sound; each refusal is noted once, with its first reason."""

    def __init__(self, file: str, names: list[str], table: Table, bad: list[BadRow]) -> None:
        self.file, self.names, self.table, self.bad = file, names, table, bad
        self.sound: Mask = np.ones(len(table.lines), dtype=bool)

    def refuse(self, rows: Mask, column: int, reason: str, values: Array | None = None) -> None:
        """Note each newly unsound row; `reason` may hold {text}, the cell as written, and {value}, from `values`."""
        for i in map(int, np.flatnonzero(rows & self.sound)):
            text = self.table.texts[i][column].strip()
            said = reason.format(text=repr(text), value=np.nan if values is None else float(values[i]))
            self.bad.append(BadRow(self.file, int(self.table.lines[i]), self.names[column], said))
        self.sound &= ~rows

    def refuse_unfit(self, present: Mask, columns: list[int]) -> None:
        """Refuse cells that are no numbers, and empty ones where the measurement is present."""
        for j in columns:
            self.refuse(self.table.broken[:, j], j, "{text} is not a finite number")
        for j in columns:
            self.refuse(present & self.table.empty[:, j], j, "the cell is empty, but its measurement is not")

    def filled(self, columns: list[int]) -> Mask:
        """Return the rows in which any of these cells holds something."""
        return np.asarray(~self.table.empty[:, columns].all(axis=1))


def in_time_order(gate: Gate, column: int, factor: float) -> tuple[Table, Array]:
    """Return the rows with a good time, as few left out as possible so that times [s] increase, and those times."""
    t = gate.table.values[:, column] * factor
    gate.refuse_unfit(np.ones(len(t), dtype=bool), [column])
    rows = np.flatnonzero(gate.sound)
    rows = rows[_longest_increasing(t[rows])]
    late = np.ones(len(t), dtype=bool)
    late[rows] = False
    gate.refuse(late, column, "the time {text} is repeated or out of order")
    return gate.table.select(rows), t[rows]


def _longest_increasing(t: Array) -> NDArray[np.int64]:
    """Return the indices of the longest strictly increasing part of `t`, the earlier row where there is a choice.

    One row whose clock jumped ahead must not cost all rows after it, so comparing neighbours is not enough.
    """
    if np.all(np.diff(t) > 0):
        return np.arange(len(t))
    # patience sorting, run backwards: ties and steps back then keep the row that stands first in the file
    tails: list[float] = []
    heads: list[int] = []
    following = np.full(len(t), -1)
    for i in range(len(t) - 1, -1, -1):
        place = bisect_left(tails, -t[i])
        following[i] = heads[place - 1] if place else -1
        tails[place : place + 1] = [-float(t[i])]
        heads[place : place + 1] = [i]
    chain = [heads[-1]]
    while following[chain[-1]] >= 0:
        chain.append(int(following[chain[-1]]))
    return np.array(chain)
