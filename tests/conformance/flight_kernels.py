"""Kernels that use every feature of the flight form, small enough to be compiled in every way by every test."""

import functools
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from optsat.arrays import Array
from optsat.export.bundle import Bundle
from optsat.export.catalogue import Kernel
from optsat.export.export import gather
from optsat.kernels.source import KernelSource
from optsat.port import Port
from optsat.symbolic.generated_function import generate

_NEWTON = """
enum { newton_root_CAP = 80 };

typedef struct {
    os_real_t guess[newton_root_CAP];
} newton_root_work_t;

/* The square root of each argument by Newton's iteration from above. */
static os_status_t newton_root_body(const os_real_t *x, os_real_t *y, newton_root_work_t *work)
{
    uint32_t unsettled = 0U;
    for (uint32_t i = 0U; i < 2U; i++) {
        os_real_t root = os_fmax(x[i], (os_real_t)1.0);
        bool settled = false;
        for (uint32_t k = 0U; k < (uint32_t)newton_root_CAP; k++) {
            const os_real_t next = (os_real_t)0.5 * (root + (x[i] / root));
            settled = settled || (next >= root);
            root = settled ? root : next;
            work->guess[k] = root;
        }
        unsettled += settled ? 0U : 1U;
        y[i] = work->guess[newton_root_CAP - 1];
    }
    return (unsettled == 0U) ? OS_OK : OS_E_NOT_CONVERGED;
}
"""


def _newton(x: Array) -> tuple[int, Array]:
    y, unsettled = np.zeros(2), 0
    for i in range(2):
        a = float(x[i])
        root, settled = max(a, 1.0), False
        for _ in range(80):
            following = 0.5 * (root + a / root)
            settled = settled or following >= root
            root = root if settled else following
        unsettled += not settled
        y[i] = root
    return (6 if unsettled else 0), y


def newton_root() -> KernelSource:
    """A template: status, working memory, a twin in Python."""
    return KernelSource(
        name="newton_root",
        inputs=(Port("square", (2,), "m^2", lower=0.0, upper=1e6),),
        outputs=(Port("root", (2,), "m", lower=0.0),),
        body=_NEWTON,
        has_status=True,
        operations=4,
        twin=_newton,
    )


def mean_direction() -> Kernel:
    """Directions of any length and their weights, up to four of them, as many as the count says."""
    b, weights = ca.SX.sym("b_B", 4, 3), ca.SX.sym("weights", 4)
    mean = b.T @ weights
    return generate(
        "mean_direction",
        inputs=[
            (Port("b_B", (4, 3), "-", direction=1e-3, counted=True), b),
            (Port("weights", (4,), "-", lower=0.0, upper=10.0, counted=True, padding=0.0), weights),
        ],
        outputs=[(Port("mean_B", (3,), "-", unit_norm=1e-3, safe=(0.0, 0.0, 1.0)), mean / ca.norm_2(mean))],
    )


def covariance_step() -> Kernel:
    """A filter's covariance over one step: state and a result beside it."""
    P, Q, dt = ca.SX.sym("P", 2, 2), ca.SX.sym("Q", 2, 2), ca.SX.sym("dt")
    F = ca.vertcat(ca.horzcat(1, dt), ca.horzcat(0, 1))
    predicted = F @ P @ F.T + Q
    symmetric = (predicted + predicted.T) / 2
    covariance = Port("P", (2, 2), "rad^2", positive_definite=True, upper=1e6)
    return generate(
        "covariance_step",
        inputs=[
            (covariance, P),
            (Port("Q", (2, 2), "rad^2", positive_definite=True, upper=1.0), Q),
            (Port("dt", (), "s", lower=1e-3, upper=10.0), dt),
        ],
        outputs=[(covariance, symmetric), (Port("deviation", (), "rad", lower=0.0), ca.sqrt(symmetric[0, 0]))],
    )


def turned_attitude() -> Kernel:
    """The attitude half way from none: the last good one is kept."""
    q = ca.SX.sym("q_RN", 4)
    sign = ca.if_else(q[3] >= 0, 1, -1)
    half = sign * q + ca.vertcat(0, 0, 0, 1)
    return generate(
        "turned_attitude",
        inputs=[(Port("q_RN", (4,), "-", unit_norm=1e-2), q)],
        outputs=[(Port("q_BN", (4,), "-", unit_norm=1e-3), half / ca.norm_2(half))],
    )


KERNELS: Mapping[str, Callable[[], Kernel] | None] = {
    "newton_root": newton_root,
    "mean_direction": mean_direction,
    "covariance_step": covariance_step,
    "turned_attitude": turned_attitude,
    "dcm_from_quaternion": None,
    "quaternion_from_dcm": None,
    "rigid_body_step": None,
    "wahba_4": None,
    "unscented_filter_7_loops": None,
}
"""Kernel by name; None is one of the catalogue."""

KEPT = {"turned_attitude": ("q_BN",)}


@functools.cache
def bundle_of(name: str, target: str = "desktop", precision: str = "double") -> Bundle:
    make = KERNELS.get(name)
    kept = {name: KEPT[name]} if name in KEPT else {}
    return gather([name if make is None else make()], target, precision, {}, kept)


def written(bundle: Bundle, folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in bundle.texts({}).items():
        (folder / name).write_text(text)
    return folder


def tool(name: str) -> str:
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"{name} is not on the path")
    return path
