"""Graph: the twin of `graph.c`."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optsat.arrays import Array
from optsat.kernels.evaluate import Leaf
from optsat.kernels.status import Status


@dataclass(frozen=True)
class GraphTwin:
    """Node after node in their own order: where they stand in memory changes no sum.

    rows, column, weight : the graph in compressed rows; k, a : numbers of a state, and of what a node has of its own
    """

    send: Leaf
    node: Leaf
    rows: Sequence[int]
    column: Sequence[int]
    weight: Sequence[float]
    k: int
    a: int
    takes_degree: bool

    def __call__(self, x: Array) -> tuple[int, Array]:
        nodes = len(self.rows) - 1
        state, own, shared = np.split(x, [nodes * self.k, nodes * (self.k + self.a)])
        state, own = state.reshape(nodes, self.k), own.reshape(nodes, self.a)
        with np.errstate(all="ignore"):
            sent = [self.send(each) for each in state]
            results = []
            for i in range(nodes):
                total, degree = np.zeros_like(sent[0]), 0.0
                for edge in range(self.rows[i], self.rows[i + 1]):
                    degree += self.weight[edge]
                    total = total + self.weight[edge] * sent[self.column[edge]]
                given = [state[i], total, [degree] if self.takes_degree else [], own[i], shared]
                results.append(self.node(np.concatenate(given)))
        y = np.concatenate(results)
        if np.isfinite(y).all():
            return Status.OK, y
        return (Status.OUTPUT if np.isfinite(x).all() else Status.NOT_FINITE), y
