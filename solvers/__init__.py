"""Solvers: one file, one back end or method; the ordered table below is the whole registry."""

if __name__ != "optsat.solvers":
    raise ImportError(f"import optsat.solvers, not {__name__}")

from optsat.solve import Solver
from optsat.solvers.cell_cover import CellCoverSolver
from optsat.solvers.clarabel import Clarabel
from optsat.solvers.compiled_minmax import CompiledMinMax
from optsat.solvers.conic_minmax import ConicMinMax
from optsat.solvers.davenport import Davenport
from optsat.solvers.ipopt import Ipopt
from optsat.solvers.scaled_semidefinite import ScaledSemidefinite
from optsat.solvers.slsqp import Slsqp
from optsat.solvers.sqp import Sqp
from optsat.solvers.subpaving import SubpavingSolver
from optsat.solvers.svd import SingularValues
from optsat.solvers.two_vector import Triad, TwoVector
from optsat.solvers.two_vector_enclosure import TwoVectorEnclosure

# the order is the preference: `solve` takes the first that accepts the form
SOLVERS: tuple[Solver, ...] = (
    Davenport(),
    SingularValues(),
    TwoVector(),
    Triad(),
    TwoVectorEnclosure(),
    ScaledSemidefinite(),
    CellCoverSolver(),
    SubpavingSolver(),
    Clarabel(),
    ConicMinMax(),
    Ipopt(),
    Sqp("daqp"),
    Sqp("osqp"),
    Sqp("ipqp"),
    Slsqp(),
    CompiledMinMax(),
)
