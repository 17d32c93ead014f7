"""Fold: each value of a program computed once, constants beforehand, and nothing that no result needs."""

import math
from functools import cache
from typing import Any

from optsat.kernels.codes import COMMUTATIVE
from optsat.kernels.program import Constant, Node, Operation, Program


def fold(program: Program) -> Program:
    """Return a program of the same results, to the bit, with equal nodes merged, constants folded and dead code gone.

    Constants are folded by CasADi's virtual machine, so that no compiler evaluates them in its own way.
    """
    nodes: list[Node] = []
    number_of: dict[Node, int] = {}
    merged: list[int] = []
    for node in program.nodes:
        if isinstance(node, Operation):
            node = _folded(Operation(node.code, tuple(merged[i] for i in node.operands)), nodes)
        number = number_of.setdefault(_key(node), len(nodes))
        if number == len(nodes):
            nodes.append(node)
        merged.append(number)
    results = [[merged[i] for i in result] for result in program.results]
    return _without_dead_code(program, nodes, results)


def _key(node: Node) -> Node:
    if isinstance(node, Operation) and node.code in COMMUTATIVE:
        return Operation(node.code, tuple(sorted(node.operands)))
    return node


def _folded(operation: Operation, nodes: list[Node]) -> Node:
    values = [node.value for i in operation.operands if isinstance(node := nodes[i], Constant)]
    if len(values) < len(operation.operands):
        return operation
    if operation.code == "COPYSIGN" and math.isnan(values[1]):
        return Constant(abs(values[0]))
    return Constant(float(_machine(operation.code, len(values))(*values)))


@cache
def _machine(code: str, arity: int) -> Any:
    # through symbols: an operation on SX constants would be simplified, such as NaN * 0 to 0
    import casadi as ca

    symbols = [ca.SX.sym("a"), ca.SX.sym("b")][:arity]
    number = getattr(ca, f"OP_{code}")
    result = ca.SX.unary(number, *symbols) if arity == 1 else ca.SX.binary(number, *symbols)
    return ca.Function("machine", symbols, [result])


def _without_dead_code(program: Program, nodes: list[Node], results: list[list[int]]) -> Program:
    live = {i for result in results for i in result}
    for i in reversed(range(len(nodes))):
        node = nodes[i]
        if i in live and isinstance(node, Operation):
            live.update(node.operands)
    kept = sorted(live)
    place = {i: k for k, i in enumerate(kept)}

    def moved(node: Node) -> Node:
        if isinstance(node, Operation):
            return Operation(node.code, tuple(place[i] for i in node.operands))
        return node

    return Program(
        program.name,
        program.inputs,
        program.outputs,
        tuple(moved(nodes[i]) for i in kept),
        tuple(tuple(place[i] for i in result) for result in results),
    )
