"""Gaussian update: arguments, Cholesky factor, likelihood and results that the Gaussian filters share."""

import math
from dataclasses import dataclass
from functools import reduce

from optsat.attitude.backend import Value, reciprocal
from optsat.estimators.filter_model import FilterModel, Noise, noise_matrix, noise_port, symmetric
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate

# a pivot this small beside its diagonal entry, in roundings, is no number but what rounding left
_LEAST_PIVOT = 4.0


@dataclass(frozen=True)
class Arguments:
    """Symbols of one filter step: state, covariance, inputs by name, measurement and noise covariances."""

    ports: tuple[Port, ...]
    symbols: tuple[Value, ...]
    x: Value
    P: Value
    u: dict[str, Value]
    z: Value
    Q: Value
    R: Value


def arguments(model: FilterModel, noise: Noise) -> Arguments:
    """Return fresh symbols for a step of this model; of covariances the lower triangle is read."""
    import casadi as ca

    n, m = model.state_size, model.measurement_size
    u_ports = model.input_ports
    ports = (
        Port("x", (n,), "SI"),
        Port("P", (n, n), "SI", positive_definite=True),
        *u_ports,
        Port("z", (m,), "SI"),
        noise_port("Q", n, noise),
        noise_port("R", m, noise),
    )
    symbols = tuple(ca.SX.sym(port.name, port.rows, port.columns) for port in ports)
    x, P, *u, z, Q, R = symbols
    return Arguments(
        ports=ports,
        symbols=symbols,
        x=x,
        P=symmetric(P),
        u={port.name: value for port, value in zip(u_ports, u, strict=True)},
        z=z,
        Q=noise_matrix(ports[-2], Q),
        R=noise_matrix(ports[-1], R),
    )


@dataclass(frozen=True)
class Factor:
    """Lower Cholesky factor L of a symmetric matrix, M = L L^T, and its pivots, the squares of the diagonal.

    A pivot that is lost in rounding or negative is taken as 1, so that nothing becomes NaN; `definite` then is 0.
    """

    L: Value
    pivots: tuple[Value, ...]
    inverse_diagonal: tuple[Value, ...]
    definite: Value

    def solve(self, B: Value) -> Value:
        """Return L^-1 B."""
        import casadi as ca

        rows: list[Value] = []
        for i in range(self.L.shape[0]):
            rest = B[i, :]
            for k in range(i):
                rest = rest - self.L[i, k] * rows[k]
            rows.append(rest * self.inverse_diagonal[i])
        return ca.vertcat(*rows)


def cholesky(M: Value, rounding: float) -> Factor:
    """Return the factor of a symmetric CasADi matrix, of which the lower triangle is read.

    rounding : spacing of the numbers at 1
    """
    import casadi as ca

    n = M.shape[0]
    L = ca.SX.zeros(n, n)
    pivots, inverses, positives = [], [], []
    for j in range(n):
        pivot = M[j, j] - ca.sumsqr(L[j, :j]) if j else M[j, j]
        positive = pivot > _LEAST_PIVOT * rounding * M[j, j]
        positives.append(positive)
        pivots.append(ca.if_else(positive, pivot, 1))
        L[j, j] = ca.sqrt(pivots[j])
        inverses.append(reciprocal(L[j, j]))
        for i in range(j + 1, n):
            rest = M[i, j] - ca.dot(L[i, :j], L[j, :j]) if j else M[i, j]
            L[i, j] = rest * inverses[j]
    return Factor(ca.tril(L), tuple(pivots), tuple(inverses), reduce(ca.logic_and, positives))


def log_likelihood(factor: Factor, whitened: Value) -> Value:
    """Return the logarithm of the density of an innovation, from its covariance's factor and L^-1 innovation."""
    import casadi as ca

    determinant = sum((ca.log(pivot) for pivot in factor.pivots), ca.SX(0))
    return -0.5 * (ca.sumsqr(whitened) + determinant + len(factor.pivots) * math.log(2 * math.pi))


def step_function(
    name: str, given: Arguments, x: Value, P: Value, innovation: Value, S: Value, likelihood: Value, definite: Value
) -> GeneratedFunction:
    """Return the step with its named results."""
    n, m = x.shape[0], innovation.shape[0]
    return generate(
        name,
        inputs=list(zip(given.ports, given.symbols, strict=True)),
        outputs=[
            (Port("x", (n,), "SI"), x),
            (Port("P", (n, n), "SI", positive_definite=True), P),
            (Port("innovation", (m,), "SI"), innovation),
            (Port("S", (m, m), "SI"), S),
            (Port("log_likelihood", (), "-"), likelihood),
            (Port("definite", (), "-", lower=0.0, upper=1.0), definite),
        ],
    )
