"""Sun: its direction from the Earth to about 0.01 deg, and the Earth's shadow as a cylinder."""

import math
from dataclasses import dataclass

from optsat.attitude.backend import Value, dot
from optsat.models.earth import EQUATORIAL_RADIUS
from optsat.models.epoch import DAYS_PER_CENTURY, SECONDS_PER_DAY, Epoch
from optsat.port import Port
from optsat.symbolic.generated_function import GeneratedFunction, generate


@dataclass(frozen=True)
class Sun:
    """Low-precision Sun; valid from 1950 to 2050, mean equator and equinox of date taken as N.

    Source: Vallado, Fundamentals of Astrodynamics and Applications, algorithm 29.
    """

    epoch: Epoch

    def direction(self) -> GeneratedFunction:
        """Return sun_N, the unit vector from the Earth to the Sun, as a function of t [s]."""
        import casadi as ca

        t = ca.SX.sym("t")
        return generate(
            "sun_direction",
            inputs=[(Port("t", (), "s"), t)],
            outputs=[(Port("sun_N", (3,), "-", unit_norm=1e-3), self._direction(t))],
        )

    def eclipse(self) -> GeneratedFunction:
        """Return 1.0 inside the Earth's cylindrical shadow, else 0.0, as a function of t [s] and r_N [m]."""
        import casadi as ca

        t, r_N = ca.SX.sym("t"), ca.SX.sym("r_N", 3)
        sun_N = self._direction(t)
        along = dot(r_N, sun_N)
        across = r_N - along * sun_N
        dark = ca.logic_and(along < 0, dot(across, across) < EQUATORIAL_RADIUS**2)
        return generate(
            "eclipse",
            inputs=[(Port("t", (), "s"), t), (Port("r_N", (3,), "m"), r_N)],
            outputs=[(Port("in_shadow", (), "-", lower=0.0, upper=1.0), dark)],
        )

    def _direction(self, t: Value) -> Value:
        import casadi as ca

        centuries = (self.epoch.days_since_j2000 + t / SECONDS_PER_DAY) / DAYS_PER_CENTURY
        degree = math.pi / 180
        anomaly = (357.5277233 + 35999.05034 * centuries) * degree
        mean_longitude_deg = 280.46 + 36000.771 * centuries
        longitude_deg = mean_longitude_deg + 1.914666471 * ca.sin(anomaly) + 0.019994643 * ca.sin(2 * anomaly)
        longitude = longitude_deg * degree
        obliquity = (23.439291 - 0.0130042 * centuries) * degree
        return ca.vertcat(
            ca.cos(longitude), ca.cos(obliquity) * ca.sin(longitude), ca.sin(obliquity) * ca.sin(longitude)
        )
