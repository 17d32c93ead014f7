"""Interpreted: what runs a kernel where no compiler does, and the one warning that says so."""

import warnings
from functools import cache

from optsat.errors import OptsatError
from optsat.kernels.casadi_form import CasadiForm
from optsat.kernels.definition import Definition
from optsat.kernels.form import Form
from optsat.kernels.python_form import PythonForm
from optsat.kernels.record import KernelRecord
from optsat.kernels.source import KernelSource


class CompilerMissing(UserWarning):  # a warning
    """Kernels run interpreted, slower and with the same results, since they cannot be compiled."""


def interpreted(definition: Definition | KernelSource, record: KernelRecord, reason: OptsatError) -> Form:
    """Return the kernel as CasADi's machine or as its Python twin runs it; warns once of each reason.

    Raises
    ------
    the reason : there is neither, or the kernel computes with floats, which only C does.
    """
    if record.real == "float":
        raise reason
    form: Form
    if not isinstance(definition, KernelSource):
        form = CasadiForm(definition.casadi, record)
    elif definition.twin is not None:
        form = PythonForm(definition.twin, record)
    else:
        raise reason
    _warn_once(str(reason))
    return form


@cache
def _warn_once(reason: str) -> None:
    warnings.warn(
        f"Kernels run interpreted, several to hundreds of times slower: {reason} `optsat doctor` says more.",
        CompilerMissing,
        stacklevel=5,
    )
