"""The bank of the worked step: three channels about one axis, as a kernel and for the dense bank."""

import casadi as ca
import numpy as np

from optsat.estimators.bank_model import chain_over, pattern_of
from optsat.estimators.bank_samples import log_normal, log_sum
from optsat.kernels.hypothesis_bank import BankStructure, Channel, hypothesis_bank
from optsat.kernels.source import KernelSource
from optsat.port import Port
from optsat.symbolic.generated_function import generate

T, J = 0.1, 350.0
F = np.array([[1.0, T, T * T / (2 * J)], [0.0, 1.0, T / J], [0.0, 0.0, 1.0]])
R_STAR, R_GYRO, B = 1.54e-6, 1e-4, 0.3
CHAINS = [(2e-4, 5e-3), (2e-4, 5e-3), (1e-3, 1e-2)]


def one_axis() -> KernelSource:
    """A gyro, a star tracker and a thruster about one axis; sample: star, gyro, command, kinds of both."""
    ports = [Port("reference", (3,), "SI"), Port("last", (2,), "SI"), Port("sample", (5,), "SI")]
    reference, last, sample = (ca.SX.sym(port.name, port.size) for port in ports)
    arguments = list(zip(ports, (reference, last, sample), strict=True))
    pattern, values = pattern_of(ca.sparsify(ca.SX(F)))
    moved = ca.DM(F) @ reference + ca.DM([T * T / (2 * J), T / J, 0.0]) * sample[2]
    chains = [chance for chain in CHAINS for chance in chain_over(*chain, ca.SX(1))]
    predicted = ca.vertcat(moved, values, 0.0, 1e-6, 0.01, *chains, 0.0, 0.0, -reference[2])
    s_star, s_gyro = 1e-6 * R_STAR, 1e-6 * R_GYRO
    quarter = np.log(0.25)
    free_star = quarter + log_normal((sample[0] - last[0]) ** 2 / (2 * s_star), 2 * s_star)
    dead, frozen = sample[1] ** 2 / s_gyro, (sample[1] - last[1]) ** 2 / (2 * s_gyro)
    free_gyro = quarter + log_sum(log_normal(dead, s_gyro), log_normal(frozen, 2 * s_gyro))
    innovation = [sample[0] - reference[0], sample[1] - reference[1]]
    observed = ca.vertcat(sample[3:5], free_star, free_gyro, *innovation, R_STAR, R_GYRO, 1, 1, sample[0:2])
    error = ca.SX.sym("state", 3)
    return hypothesis_bank(
        "one_axis",
        BankStructure(3, 3, (Channel(1, 1, B), Channel(1, 0, B)), ((2, 36.0),), pattern, ((0, 0), (1, 1))),
        generate("predict", arguments, [(Port("predicted", (predicted.numel(),), "SI"), predicted)]),
        generate("observe", arguments, [(Port("observed", (observed.numel(),), "SI"), observed)]),
        generate("shift", [arguments[0], (Port("state", (3,), "SI"), error)], [(ports[0], reference + error)]),
        ports[:1],
        ports[1:2],
        ports[2:],
    )
