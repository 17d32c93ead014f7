"""Model kernels: the spacecraft models with their parameters built in, as they are offered by name."""

from collections.abc import Sequence

from optsat.arrays import Array
from optsat.models.epoch import Epoch
from optsat.models.magnetic_field import TiltedDipole
from optsat.models.rigid_body import EXAMPLE_INERTIA, RigidBody
from optsat.models.sun import Sun
from optsat.symbolic.generated_function import GeneratedFunction, generate

EXAMPLE_EPOCH = "2021-03-20T12:00:00Z"
"""Epoch of the example scenario, which the kernels count t from unless told otherwise."""


def rigid_body_step(
    inertia_B: Array | Sequence[Sequence[float]] = EXAMPLE_INERTIA, substeps: int = 1
) -> GeneratedFunction:
    """Return `rigid_body_step`: q_BN and omega_BN_B after dt under a torque held in B.

    inertia_B : inertia matrix (3, 3) about the centre of mass [kg m^2]
    substeps : equal Runge-Kutta steps inside dt

    Raises
    ------
    InputError : no body has this inertia, or substeps < 1.
    """
    return RigidBody(inertia_B).step(substeps)


def magnetic_field(epoch: str = EXAMPLE_EPOCH) -> GeneratedFunction:
    """Return `magnetic_field`: field_N [T] of the tilted dipole as a function of t [s] and r_N [m].

    epoch : the instant t = 0, ISO 8601, UTC unless an offset is given

    Raises
    ------
    InputError : the epoch is no date.
    """
    return TiltedDipole(Epoch.from_utc(epoch)).field()


def sun(epoch: str = EXAMPLE_EPOCH) -> GeneratedFunction:
    """Return `sun`: sun_N, the unit vector to the Sun, and in_shadow (1 or 0), as a function of t [s] and r_N [m].

    epoch : the instant t = 0, ISO 8601, UTC unless an offset is given

    Raises
    ------
    InputError : the epoch is no date.
    """
    model = Sun(Epoch.from_utc(epoch))
    direction, eclipse = model.direction(), model.eclipse()
    t, r_N = eclipse.symbols()
    return generate(
        "sun",
        inputs=list(zip(eclipse.inputs, (t, r_N), strict=True)),
        outputs=[(direction.outputs[0], direction(t)), (eclipse.outputs[0], eclipse(t, r_N))],
    )
