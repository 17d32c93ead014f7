"""Linearise: the exact matrices A and B of a system at a point."""

from collections.abc import Sequence

from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, flattened, generate, port_named, shaped


def linearise(derivative: GeneratedFunction, states: Sequence[str], inputs: Sequence[str]) -> GeneratedFunction:
    """Return A = d(outputs)/d(states) and B = d(outputs)/d(inputs) as a function of all inputs of `derivative`.

    Outputs, states and inputs are each joined to one column in the given order; matrices are counted by rows. All SI:
    an entry carries the unit of its row over that of its column. Serves rates (continuous) and steps (discrete).

    Raises
    ------
    InputError : a name is no input of `derivative`.
    """
    import casadi as ca

    flat = {port.name: ca.SX.sym(port.name, port.size) for port in derivative.inputs}
    arguments = [shaped(port, flat[port.name]) for port in derivative.inputs]
    results = derivative.casadi.call(arguments)
    column = ca.vertcat(*(flattened(port, result) for port, result in zip(derivative.outputs, results, strict=True)))
    matrices = []
    for letter, names in (("A", states), ("B", inputs)):
        at = ca.vertcat(*(flat[port_named(derivative.inputs, name, derivative.name).name] for name in names))
        jacobian = ca.jacobian(column, at)
        matrices.append((Port(letter, jacobian.shape, "SI"), jacobian))
    return generate(
        f"{derivative.name}_linear", inputs=list(zip(derivative.inputs, arguments, strict=True)), outputs=matrices
    )
