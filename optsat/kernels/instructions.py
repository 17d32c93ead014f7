"""Instructions: the virtual machine's code of a CasADi SX function, read into a program."""

from collections.abc import Sequence
from typing import Any

from optsat.errors import InputError
from optsat.kernels.codes import ARITY, COPIES, REFUSED
from optsat.kernels.program import Constant, Input, Node, Operation, Pattern, Program


def read_instructions(vm: Any, names_in: Sequence[str] = (), names_out: Sequence[str] = ()) -> Program:
    """Return the program of a CasADi SXFunction, one node for each instruction.

    names_in, names_out : of the arguments and results; CasADi's own unless given

    Raises
    ------
    InputError : no SXFunction, or an instruction that has no meaning in a kernel; the message says the cure.
    """
    _check_sx(vm)
    names = code_names()
    nodes: list[Node] = []
    node_in_slot: dict[int, int] = {}
    results = [[0] * vm.nnz_out(k) for k in range(vm.n_out())]
    for k in range(vm.n_instructions()):
        code, read, written = names[vm.instruction_id(k)], vm.instruction_input(k), vm.instruction_output(k)
        if code == "OUTPUT":
            results[written[0]][written[1]] = node_in_slot[read[0]]
            continue
        if code in COPIES:
            node_in_slot[written[0]] = node_in_slot[read[0]]
            continue
        node: Node
        if code == "INPUT":
            node = Input(*read)
        elif code == "CONST":
            node = Constant(vm.instruction_constant(k))
        elif code in ARITY:
            node = Operation(code, tuple(node_in_slot[slot] for slot in read[: ARITY[code]]))
        else:
            raise InputError(f"{vm.name()}: instruction {k} is {code}, {REFUSED.get(code, 'which no kernel knows')}.")
        # slots are used again as soon as their value is no longer needed
        node_in_slot[written[0]] = len(nodes)
        nodes.append(node)
    inputs = tuple(_pattern(name, vm.sparsity_in(k)) for k, name in enumerate(names_in or vm.name_in()))
    outputs = tuple(_pattern(name, vm.sparsity_out(k)) for k, name in enumerate(names_out or vm.name_out()))
    return Program(vm.name(), inputs, outputs, tuple(nodes), tuple(map(tuple, results)))


def code_names() -> dict[int, str]:
    """Return CasADi's name of each operation by its number, without the prefix."""
    import casadi as ca

    return {getattr(ca, name): name.removeprefix("OP_") for name in dir(ca) if name.startswith("OP_")}


def _check_sx(vm: Any) -> None:
    import casadi as ca

    if not isinstance(vm, ca.Function):
        raise InputError(f"`function` must be a CasADi function of SX symbols, got {type(vm).__name__}.")
    if not vm.is_a("SXFunction"):
        cure = "use `.expand()`" if vm.is_a("MXFunction") else "write it as an expression of SX symbols"
        raise InputError(f"{vm.name()} is no function of SX symbols but a CasADi {vm.class_name()}: {cure}.")


def _pattern(name: str, sparsity: Any) -> Pattern:
    return Pattern(name, sparsity.rows(), sparsity.columns(), tuple(sparsity.colind()), tuple(sparsity.row()))
