"""Graph: one function for all nodes of a sparse graph, each coupled to its neighbours by a weighted sum."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from optsat.errors import InputError
from optsat.kernels.definition import Definition, lower_in_order, lower_or, port_of
from optsat.kernels.evaluate import evaluator
from optsat.kernels.instantiate import instantiate
from optsat.kernels.slots import identity
from optsat.kernels.source import KernelSource
from optsat.kernels.twins.graph import GraphTwin
from optsat.port import Port

LARGEST = 65_536
"""Numbers that the states of all nodes may hold together."""


def graph(
    node: Definition,
    adjacency: Any,
    states: Sequence[str],
    gathered: str,
    degree: str | None = None,
    own: Sequence[str] = (),
    send: Definition | None = None,
    result: str = "x",
    reorder: bool = True,
    name: str | None = None,
) -> KernelSource:
    """Return the kernel (x, own..., shared...) -> `result` of all nodes at once.

    For node i: node(x_i, sum_j adjacency[i, j] send(x_j), sum_j adjacency[i, j], own_i, shared), the sums in the order
    in which the matrix stores its entries.

    node : whose results joined are as long as its `states` joined, their rates or next values; `gathered` and `degree`
        name the arguments that are the sums, `own` those that each node has of its own; all nodes share the others
    adjacency : (nodes, nodes) weights, a sparse or dense matrix; row i holds the neighbours that node i listens to
    x : (nodes, n), the states joined; an argument of `own` has shape (nodes, size)
    send : x -> what neighbours see of it, x itself unless given
    reorder : keep neighbours close in memory (reverse Cuthill-McKee); no bit of the result depends on it

    Status: OS_E_OUTPUT where a result is not finite, OS_E_NOT_FINITE for such an argument.

    Raises
    ------
    InputError : the matrix is not square and finite, the sizes of node, sum and result do not match, or the states of
        all nodes together hold more than 65,536 numbers.
    """
    kernel = name or f"{node.name}_graph"
    rows, column, weight = _compressed(kernel, adjacency)
    nodes = len(rows) - 1
    state_ports, own_ports = [port_of(node, each) for each in states], [port_of(node, each) for each in own]
    sums = [port_of(node, gathered), *([] if degree is None else [port_of(node, degree)])]
    taken = {*states, *own, *(port.name for port in sums)}
    shared = [port for port in node.inputs if port.name not in taken]
    k, a = sum(port.size for port in state_ports), sum(port.size for port in own_ports)
    passed = lower_or(send, identity("send", k))
    g = sums[0].size
    sent = sum(pattern.length(dense=True) for pattern in passed.outputs)
    if sum(port.size for port in node.outputs) != k or sent != g:
        raise InputError(
            f"{kernel}: {node.name} must give {k} results, as many as its states, and gather {sent} numbers, as many "
            f"as a node sends; it gives {sum(port.size for port in node.outputs)} and gathers {g}."
        )
    if nodes * k > LARGEST:
        raise InputError(f"{kernel}: {nodes} nodes of {k} numbers are more than {LARGEST}; split the graph.")
    program = lower_in_order(node, [port.name for port in (*state_ports, *sums, *own_ports, *shared)])
    order = _order(rows, column) if reorder else np.arange(nodes)
    moved_rows, moved_column, moved_weight = _moved(rows, column, weight, order)
    edges = len(column)
    return instantiate(
        "graph",
        kernel,
        {"send": passed, "node": program},
        {"NODES": nodes, "K": k, "G": g, "DEGREES": len(sums) - 1, "A": a, "C": sum(port.size for port in shared)},
        inputs=(
            Port("x", (nodes, k), "SI"),
            *(Port(port.name, (nodes, port.size), port.unit, lower=port.lower, upper=port.upper) for port in own_ports),
            *shared,
        ),
        outputs=(Port(result, (nodes, k), "SI"),),
        # a C array holds one number at least
        tables={
            "ORDER": order.tolist(),
            "ROWS": moved_rows,
            "COLUMN": moved_column or [0],
            "WEIGHT": moved_weight or [0.0],
        },
        twin=GraphTwin(
            send=evaluator(passed),
            node=evaluator(program),
            rows=rows.tolist(),
            column=column.tolist(),
            weight=weight.tolist(),
            k=k,
            a=a,
            takes_degree=degree is not None,
        ),
        operations=nodes * (program.operation_count + passed.operation_count) + edges * (2 * g + 1),
    )


def _compressed(kernel: str, adjacency: Any) -> tuple[Any, Any, Any]:
    from scipy.sparse import csr_array

    matrix = csr_array(adjacency)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or matrix.shape[0] == 0:
        raise InputError(f"{kernel}: `adjacency` must be a square matrix of nodes, got shape {matrix.shape}.")
    weight = np.asarray(matrix.data, float)
    if not np.isfinite(weight).all():
        raise InputError(f"{kernel}: `adjacency` holds weights that are not finite.")
    return matrix.indptr, matrix.indices, weight


def _order(rows: Any, column: Any) -> Any:
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    nodes = len(rows) - 1
    pattern = csr_array((np.ones(len(column)), column, rows), shape=(nodes, nodes))
    return reverse_cuthill_mckee(csr_array(pattern + pattern.T), symmetric_mode=True)


def _moved(rows: Any, column: Any, weight: Any, order: Any) -> tuple[list[int], list[int], list[float]]:
    """The graph with its nodes in another order, the entries of each row in theirs."""
    place = np.argsort(order)
    starts, columns, weights = [0], [], []
    for node in order:
        entries = slice(rows[node], rows[node + 1])
        columns += place[column[entries]].tolist()
        weights += weight[entries].tolist()
        starts.append(len(columns))
    return starts, columns, weights
