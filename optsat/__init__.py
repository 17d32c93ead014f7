"""optsat: attitude software that can be trusted in flight, from one symbolic description of a spacecraft.

Importing this package loads no other; every public name but `solve` loads its own module on first use.
"""

import importlib
from typing import TYPE_CHECKING, Any

from optsat._version import __version__

# the module of the verb bears its name: loaded later, it would take the verb's place in this namespace
from optsat.solve import solve

if TYPE_CHECKING:
    from optsat.attain import goal_attain, minimax
    from optsat.attitude.status import AttitudeStatus
    from optsat.determine import CertifiedBatch, certify_attitude, certify_attitude_batch, wahba, worst_case_wahba
    from optsat.errors import InputError, NotProvenError, OptsatError, RecordError, UnknownOptionError
    from optsat.estimators.attitude_series import AttitudeSeries, Window, certify_record
    from optsat.estimators.isolability import AdditiveFault, Isolability, isolability
    from optsat.estimators.isolation import Isolation, isolate
    from optsat.export.export import Export, export_c
    from optsat.export.offered import kernel
    from optsat.kernels.kernel import Kernel
    from optsat.kernels.open_kernel import make_kernel, open_kernel
    from optsat.pareto import pareto_sweep
    from optsat.problems.attainment import Attainment
    from optsat.problems.certified_attitude import CertifiedAttitude, CertifiedAttitudeProblem
    from optsat.problems.component_box import ComponentBox
    from optsat.problems.goal_attainment import GoalAttainment
    from optsat.problems.minimax import Minimax
    from optsat.problems.pareto_front import ParetoFront, ParetoPoint
    from optsat.problems.wahba import Wahba, WahbaAttitude
    from optsat.records.csv_log import read_csv_log, write_csv_log
    from optsat.records.record import Record, VectorChannel
    from optsat.robust import WorstCase, robust_minimax
    from optsat.solution import Proof, Solution, Termination
    from optsat.statistical_bound import statistical_angle_bound

_HOME = {
    "AdditiveFault": "optsat.estimators.isolability",
    "Attainment": "optsat.problems.attainment",
    "AttitudeSeries": "optsat.estimators.attitude_series",
    "AttitudeStatus": "optsat.attitude.status",
    "CertifiedAttitude": "optsat.problems.certified_attitude",
    "CertifiedAttitudeProblem": "optsat.problems.certified_attitude",
    "CertifiedBatch": "optsat.determine",
    "ComponentBox": "optsat.problems.component_box",
    "Export": "optsat.export.export",
    "GoalAttainment": "optsat.problems.goal_attainment",
    "InputError": "optsat.errors",
    "Isolability": "optsat.estimators.isolability",
    "Isolation": "optsat.estimators.isolation",
    "Kernel": "optsat.kernels.kernel",
    "Minimax": "optsat.problems.minimax",
    "NotProvenError": "optsat.errors",
    "OptsatError": "optsat.errors",
    "ParetoFront": "optsat.problems.pareto_front",
    "ParetoPoint": "optsat.problems.pareto_front",
    "Proof": "optsat.solution",
    "Record": "optsat.records.record",
    "RecordError": "optsat.errors",
    "Solution": "optsat.solution",
    "Termination": "optsat.solution",
    "UnknownOptionError": "optsat.errors",
    "VectorChannel": "optsat.records.record",
    "Wahba": "optsat.problems.wahba",
    "WahbaAttitude": "optsat.problems.wahba",
    "Window": "optsat.estimators.attitude_series",
    "WorstCase": "optsat.robust",
    "certify_attitude": "optsat.determine",
    "certify_attitude_batch": "optsat.determine",
    "certify_record": "optsat.estimators.attitude_series",
    "export_c": "optsat.export.export",
    "goal_attain": "optsat.attain",
    "isolability": "optsat.estimators.isolability",
    "isolate": "optsat.estimators.isolation",
    "kernel": "optsat.export.offered",
    "make_kernel": "optsat.kernels.open_kernel",
    "minimax": "optsat.attain",
    "open_kernel": "optsat.kernels.open_kernel",
    "pareto_sweep": "optsat.pareto",
    "read_csv_log": "optsat.records.csv_log",
    "robust_minimax": "optsat.robust",
    "statistical_angle_bound": "optsat.statistical_bound",
    "wahba": "optsat.determine",
    "worst_case_wahba": "optsat.determine",
    "write_csv_log": "optsat.records.csv_log",
}

__all__ = [
    "AdditiveFault",
    "Attainment",
    "AttitudeSeries",
    "AttitudeStatus",
    "CertifiedAttitude",
    "CertifiedAttitudeProblem",
    "CertifiedBatch",
    "ComponentBox",
    "Export",
    "GoalAttainment",
    "InputError",
    "Isolability",
    "Isolation",
    "Kernel",
    "Minimax",
    "NotProvenError",
    "OptsatError",
    "ParetoFront",
    "ParetoPoint",
    "Proof",
    "Record",
    "RecordError",
    "Solution",
    "Termination",
    "UnknownOptionError",
    "VectorChannel",
    "Wahba",
    "WahbaAttitude",
    "Window",
    "WorstCase",
    "__version__",
    "certify_attitude",
    "certify_attitude_batch",
    "certify_record",
    "export_c",
    "goal_attain",
    "isolability",
    "isolate",
    "kernel",
    "make_kernel",
    "minimax",
    "open_kernel",
    "pareto_sweep",
    "read_csv_log",
    "robust_minimax",
    "solve",
    "statistical_angle_bound",
    "wahba",
    "worst_case_wahba",
    "write_csv_log",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'optsat' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
