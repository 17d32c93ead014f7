"""Magnetic field: the Earth's field as a tilted dipole that turns with the Earth."""

import math
from dataclasses import dataclass

from optsat.attitude.backend import Value, dot, norm
from optsat.models.earth import EQUATORIAL_RADIUS, sidereal_angle
from optsat.models.epoch import Epoch
from optsat.models.parameters import check_scalar
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


@dataclass(frozen=True)
class TiltedDipole:
    """Dipole opposite to the direction of the north geomagnetic pole (80.4 N, 72.7 W).

    equatorial_field : magnitude at the Earth's equatorial radius on the magnetic equator [T]; pole_latitude,
    pole_longitude (east) [rad]. The true field differs by up to a quarter in size and some 10 deg in direction.

    Raises
    ------
    InputError : a parameter is not finite or outside its range.
    """

    epoch: Epoch
    pole_latitude: float = math.radians(80.4)
    pole_longitude: float = math.radians(-72.7)
    equatorial_field: float = 3.12e-5

    def __post_init__(self) -> None:
        check_scalar("pole_latitude", self.pole_latitude, "rad", low=-math.pi / 2, high=math.pi / 2)
        check_scalar("pole_longitude", self.pole_longitude, "rad")
        check_scalar("equatorial_field", self.equatorial_field, "T", low=0.0, low_open=True)

    def field(self) -> GeneratedFunction:
        """Return field_N [T] as a function of t [s] and r_N [m]: B0 (R_e / r)^3 (3 (m.r) r - m), r a unit vector."""
        import casadi as ca

        t, r_N = ca.SX.sym("t"), ca.SX.sym("r_N", 3)
        strength = self.equatorial_field * (EQUATORIAL_RADIUS / norm(r_N)) ** 3
        return _of_place("magnetic_field", t, r_N, Port("field_N", (3,), "T"), strength * self._shape(t, r_N))

    def direction(self) -> GeneratedFunction:
        """Return the unit vector along the field as a function of t [s] and r_N [m]."""
        import casadi as ca

        t, r_N = ca.SX.sym("t"), ca.SX.sym("r_N", 3)
        shape = self._shape(t, r_N)
        return _of_place(
            "magnetic_direction", t, r_N, Port("direction_N", (3,), "-", unit_norm=1e-3), shape / norm(shape)
        )

    def _shape(self, t: Value, r_N: Value) -> Value:
        import casadi as ca

        longitude = self.pole_longitude + sidereal_angle(self.epoch, t)
        flat = math.cos(self.pole_latitude)
        m = -ca.vertcat(flat * ca.cos(longitude), flat * ca.sin(longitude), math.sin(self.pole_latitude))
        up = r_N / norm(r_N)
        return 3 * dot(m, up) * up - m


def _of_place(name: str, t: Value, r_N: Value, port: Port, value: Value) -> GeneratedFunction:
    return generate(name, inputs=[(Port("t", (), "s"), t), (Port("r_N", (3,), "m"), r_N)], outputs=[(port, value)])
