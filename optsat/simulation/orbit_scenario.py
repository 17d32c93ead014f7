"""Orbit scenario: what a satellite with a Sun sensor, a magnetometer and a gyro of bounded error would log."""

import datetime
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from optsat.arrays import Array
from optsat.attitude import dcm, euler321, frames, quaternion
from optsat.errors import InputError, nearest_name
from optsat.models.draws import BallLaw, ConeLaw
from optsat.models.epoch import J2000_DAY, Epoch
from optsat.models.gyro import Gyro
from optsat.models.magnetic_field import TiltedDipole
from optsat.models.orbit import CircularOrbit
from optsat.models.parameters import check_scalar
from optsat.models.rigid_body import RigidBody
from optsat.models.sensors import ConeSensor
from optsat.models.sun import Sun
from optsat.records.record import Mask, Record, VectorChannel
from optsat.simulation.sensor_fault import SensorFault
from optsat.simulation.true_motion import true_motion

Rate = Literal["lvlh", "inertial"]
GyroError = Literal["constant", "random"]

EPOCH_OF_2021_MARCH_20_NOON = Epoch(2459293.5, 0.5)
CHANNELS = ("sun", "magnetometer")
_WORDS: dict[str, tuple[str, ...]] = {
    "rate": ("lvlh", "inertial"),
    "noise": ("cap", "angle", "boundary"),
    "gyro_error": ("constant", "random"),
}
_MOST_EPOCHS = 1_000_000


@dataclass(frozen=True)
class OrbitScenario:
    """A rigid satellite on a circular orbit under the gravity gradient; the defaults are the paper's orbit run.

    altitude [m]; inclination, raan, argument_of_latitude at t = 0 [rad]; epoch : the instant t = 0
    inertia_B : (3, 3) [kg m^2]; yaw_pitch_roll : 3-2-1 angles of B relative to the orbital frame at t = 0 [rad]
    rate : "lvlh", at rest relative to the orbital frame at t = 0; "inertial", at rest relative to N
    duration, dt [s] : samples at t = 0, dt, ..., up to the duration
    sun_bound_rad, magnetometer_bound_rad : bounds of the two direction sensors [rad]
    noise : law of their errors inside the bounds, as in `optsat.models.draws.cone_angles`; the references are exact
    eclipse : whether the Sun sensor goes blind in the Earth's shadow (the paper ignores it)
    gyro_bound_rad_s : bound of the length of the rate error [rad/s]; None = no gyro
    gyro_error : "constant", one bias as long as the bound allows; "random", fresh at each sample, uniform in the ball
    faults : of the channels "sun" and "magnetometer"

    Raises
    ------
    InputError : a parameter is out of range, or a word or channel unknown.
    Source: robust Wahba specification, section 5.2.
    """

    altitude: float = 800e3
    inclination: float = math.radians(75.0)
    raan: float = 0.0
    argument_of_latitude: float = 0.0
    epoch: Epoch = EPOCH_OF_2021_MARCH_20_NOON
    inertia_B: Sequence[Sequence[float]] = ((80.0, 0.0, 0.0), (0.0, 80.0, 0.0), (0.0, 0.0, 4.0))
    yaw_pitch_roll: tuple[float, float, float] = (math.radians(5.0), 0.0, 0.0)
    rate: Rate = "lvlh"
    duration: float = 1200.0
    dt: float = 1.0
    sun_bound_rad: float = math.radians(0.005)
    magnetometer_bound_rad: float = math.radians(0.5)
    noise: ConeLaw = "cap"
    eclipse: bool = False
    gyro_bound_rad_s: float | None = None
    gyro_error: GyroError = "constant"
    faults: tuple[SensorFault, ...] = ()

    def __post_init__(self) -> None:
        self.orbit()
        RigidBody(self.inertia_B)
        for name, bound in zip(CHANNELS, self._bounds(), strict=True):
            check_scalar(f"{name}_bound_rad", bound, "rad", low=0.0, high=math.pi, high_open=True)
        if self.gyro_bound_rad_s is not None:
            check_scalar("gyro_bound_rad_s", self.gyro_bound_rad_s, "rad/s", low=0.0)
        for angle, value in zip(("yaw", "pitch", "roll"), self.yaw_pitch_roll, strict=True):
            check_scalar(f"yaw_pitch_roll ({angle})", value, "rad")
        check_scalar("dt", self.dt, "s", low=0.0, low_open=True)
        check_scalar("duration", self.duration, "s", low=0.0, high=self.dt * _MOST_EPOCHS)
        for name, words in _WORDS.items():
            if (word := getattr(self, name)) not in words:
                raise InputError(f"`{name}` is {word!r}.{nearest_name(str(word), list(words))}")
        for fault in self.faults:
            if fault.channel not in CHANNELS:
                raise InputError(
                    f"`faults` names the channel {fault.channel!r}.{nearest_name(fault.channel, list(CHANNELS))}"
                )

    def orbit(self) -> CircularOrbit:
        """Return the orbit."""
        return CircularOrbit(self.altitude, self.inclination, self.raan, self.argument_of_latitude)

    def times(self) -> Array:
        """Return the times (T,) of the samples [s]."""
        return self.dt * np.arange(math.floor(self.duration / self.dt * (1 + 1e-12)) + 1, dtype=np.float64)

    def truth(self) -> tuple[Array, Array]:
        """Return q_BN (T, 4) and omega_BN_B (T, 3) [rad/s]."""
        r_N, v_N = self.orbit().motion()(0.0)
        q_BO = euler321.to_quaternion(np.array(self.yaw_pitch_roll))
        q_BN = quaternion.compose(q_BO, dcm.to_quaternion(frames.orbital_dcm(r_N, v_N)))
        at_rest_in_orbit = quaternion.transform(q_BO, frames.orbital_rate(r_N, v_N))
        omega_BN_B = at_rest_in_orbit if self.rate == "lvlh" else np.zeros(3)
        return true_motion(RigidBody(self.inertia_B), self.orbit(), q_BN, omega_BN_B, self.dt, len(self.times()))

    def in_shadow(self) -> Mask:
        """Return which samples (T,) lie in the Earth's shadow, whether the Sun sensor minds or not."""
        t = self.times()
        r_N, _ = self.orbit().motion().batch(t)
        return np.asarray(Sun(self.epoch).eclipse().batch(t, r_N) > 0.5)

    def simulate(self, rng: np.random.Generator) -> Record:
        """Return a record with the true attitude, the channels "sun" and "magnetometer", and the gyro if there is one.

        The draws do not depend on gyro, eclipse and faults: the same generator gives the same sensor errors.

        Raises
        ------
        InputError : `rng` is no generator.
        """
        t = self.times()
        q_BN, omega_BN_B = self.truth()
        r_N, _ = self.orbit().motion().batch(t)
        references = (Sun(self.epoch).direction().batch(t), TiltedDipole(self.epoch).direction().batch(t, r_N))
        lit = ~self.in_shadow() if self.eclipse else np.ones(len(t), dtype=bool)
        valid = {"sun": lit, "magnetometer": np.ones(len(t), dtype=bool)}
        channels = {}
        for name, reference_N, bound in zip(CHANNELS, references, self._bounds(), strict=True):
            sensor = ConeSensor(bound)
            b_B = sensor.measurement().batch(q_BN, reference_N, sensor.draw(rng, len(t), self.noise))
            channels[name] = VectorChannel(name, "B", b_B, reference_N, np.full(len(t), bound), valid[name])
        measured, gyro_bound = None, None
        if self.gyro_bound_rad_s is not None:
            constant = self.gyro_error == "constant"
            law: BallLaw = "boundary" if constant else "uniform"
            measured = omega_BN_B + Gyro(self.gyro_bound_rad_s).draw(rng, len(t), law, constant)
            gyro_bound = np.full(len(t), self.gyro_bound_rad_s)
        for fault in self.faults:
            channels[fault.channel] = fault.spoil(t, channels[fault.channel], rng)
        return Record(
            t=t,
            channels=tuple(channels.values()),
            omega_BN_B=measured,
            gyro_bound_rad_s=gyro_bound,
            q_BN_true=q_BN,
            epoch=_utc_text(self.epoch),
            source="simulated orbit scenario",
        )

    def _bounds(self) -> tuple[float, float]:
        return self.sun_bound_rad, self.magnetometer_bound_rad


def _utc_text(epoch: Epoch) -> str:
    noon = datetime.datetime(2000, 1, 1, 12)
    since = datetime.timedelta(days=epoch.day - J2000_DAY) + datetime.timedelta(days=epoch.fraction)
    return (noon + since).isoformat() + "Z"
