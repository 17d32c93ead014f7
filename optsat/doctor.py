"""Examine the installation: what is there, what is missing, whether it computes."""

import enum
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata

from optsat._version import __version__
from optsat.campaign.threads import THREAD_VARIABLES

REQUIRED = (
    "numpy",
    "scipy",
    "casadi",
    "clarabel",
    "cvxpy",
    "matplotlib",
    "pint",
    "pydantic",
    "rich",
    "threadpoolctl",
    "typer",
)
EXTRAS = {
    "results": ("h5netcdf", "h5py", "xarray"),
    "cluster": ("distributed",),
    "peers": ("ahrs", "bsk", "filterpy", "pymoo", "stonesoup"),
}


class Health(enum.Enum):
    """How a part of the installation is."""

    OK = "ok"
    ABSENT = "absent"  # and not needed
    BROKEN = "broken"


@dataclass(frozen=True)
class Finding:
    """One line of the examination: the subject, how it is, and why or what to do."""

    subject: str
    health: Health
    says: str


def examine() -> list[Finding]:
    """Return the findings: versions, extras, machine and self-checks, in that order."""
    return [
        Finding("optsat", Health.OK, __version__),
        Finding("python", Health.OK, platform.python_version()),
        *(_required(name) for name in REQUIRED),
        *(_extra(extra, name) for extra, names in EXTRAS.items() for name in names),
        Finding("processor", Health.OK, f"{platform.machine()}, {_usable_cores()} cores usable"),
        Finding("threads", Health.OK, _threads()),
        *_kernels(),
        *(check() for check in SELF_CHECKS),
    ]


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _required(name: str) -> Finding:
    version = _version(name)
    if version is None:
        return Finding(name, Health.BROKEN, f"not installed; get it with: pip install {name}")
    return Finding(name, Health.OK, version)


def _extra(extra: str, name: str) -> Finding:
    version = _version(name)
    if version is None:
        return Finding(name, Health.ABSENT, f"not needed; get it with: pip install 'optsat[{extra}]'")
    return Finding(name, Health.OK, version)


def _usable_cores() -> int:
    # a container or batch system may grant fewer cores than the machine has; macOS cannot say
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _threads() -> str:
    said = [f"{name}={os.environ[name]}" for name in THREAD_VARIABLES if name in os.environ]
    return ", ".join(said) or "as the libraries choose (OMP_NUM_THREADS is not set)"


def _kernels() -> list[Finding]:
    try:
        from optsat.kernels.health import examine_kernels

        facts = examine_kernels()
    except (ImportError, RuntimeError) as error:
        return [Finding("kernels", Health.BROKEN, str(error))]
    return [Finding(fact.subject, Health(fact.state), fact.says) for fact in facts]


def _casadi_computes() -> Finding:
    try:
        import casadi as ca

        x = ca.SX.sym("x")
        slope = float(ca.Function("slope", [x], [ca.gradient(ca.sin(x), x)])(0.0))
    except (ImportError, RuntimeError) as error:
        return Finding("self-check casadi", Health.BROKEN, str(error))
    return _judge("self-check casadi", "the derivative of sin at 0", slope, 1.0)


def _clarabel_solves() -> Finding:
    try:
        import numpy as np

        from optsat.forms import ConicForm
        from optsat.solvers.clarabel import Clarabel

        disc = ConicForm(
            q=np.ones(2),
            A=np.array([[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0]]),
            b=np.array([1.0, 0.0, 0.0]),
            cones=(("second_order", 3),),
        )
        least = float(Clarabel().run(disc).x.sum())
    except (ImportError, RuntimeError) as error:
        return Finding("self-check clarabel", Health.BROKEN, str(error))
    return _judge("self-check clarabel", "the least x + y on the unit disc", least, -(2**0.5))


def _attitude_certified() -> Finding:
    try:
        import numpy as np

        from optsat.determine import certify_attitude

        axes = np.eye(3)[:2]
        attitude = certify_attitude(axes, axes, 0.01)
        verdict = attitude.certificate.verify()
    except (ImportError, RuntimeError) as error:
        return Finding("self-check certified attitude", Health.BROKEN, str(error))
    if not verdict:
        return Finding("self-check certified attitude", Health.BROKEN, f"certificate rejected: {verdict.reason}")
    # two orthogonal cones with equal weights: s1 = 1 - cos(eps), s2 = -cos(eps)
    versine = 2 * np.sin(0.005) ** 2
    exact = float(2 * np.arctan(np.sqrt(versine / (1 - versine))))
    return _judge("self-check certified attitude", "the bound [rad] of two axes within 0.01", attitude.bound_rad, exact)


def _judge(subject: str, what: str, got: float, exact: float) -> Finding:
    if abs(got - exact) < 1e-6:
        return Finding(subject, Health.OK, f"{what} is {exact:.6g}")
    return Finding(subject, Health.BROKEN, f"{what} should be {exact:.6g}, got {got:.6g}; reinstall it")


# each takes well below a second; a check reports what it cannot do, it never raises
SELF_CHECKS: tuple[Callable[[], Finding], ...] = (
    _casadi_computes,
    _clarabel_solves,
    _attitude_certified,
)
