"""Trials of the BROAD benchmark: gravity and magnetic field from a 9-axis IMU, with the optical attitude as truth.

N is the benchmark's east-north-up frame, B the IMU. The file's quaternion is scalar first and takes B components to N;
with the scalar last the same four numbers are q_BN of this library, because A(q_BN) takes N to B.

- `gravity`: the accelerometer averaged over a centred window (so a second of the future is used) that the gyro carries
  along; reference up, (0, 0, 1).
- `field`: the magnetometer, sample by sample; reference (0, cos dip, -sin dip), the dip taken between accelerometer and
  magnetometer over the first 20 s, in which the IMU must rest. North is magnetic north by definition. The optical frame
  agrees with it to about 1 deg at rest and 3.5 deg in the mean over the motion of trial 01 (0.3 and 1.1 deg as angle
  between the steep field directions); no heading is fitted, so this stays in the error that the bounds have to cover.
- the gyro, less its mean over the rest.

Neither directions nor bounds use the optical reference.

Source: D. Laidig, M. Caruso, A. Cereatti, T. Seel, BROAD - a benchmark for robust inertial orientation estimation,
Data 6 (2021) 72.
"""

import os
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from optsat.arrays import Array, normalise_rows
from optsat.errors import InputError, RecordError, explain_unknown_fields, explain_unknown_options
from optsat.records.record import Record, VectorChannel

_REST_S = 20.0
_REST_RATE = 0.1  # rad/s; noise and bias stay ten times below
_UP_N = np.array([0.0, 0.0, 1.0])
_KEYS = {"imu_gyr": 3, "imu_acc": 3, "imu_mag": 3, "opt_quat": 4}


@explain_unknown_fields
@dataclass(frozen=True)
class BroadBounds:
    """How far the two directions may be off, from the IMU alone; the defaults are for undisturbed rotation trials.

    Gravity. Averaged over a window of W seconds in axes that do not turn, an acceleration leaves only its change of
    velocity, at most (v_first + v_last) / W with v = speed + lever_arm |omega|. With g the length at rest:
        sin(angle) = [ | |mean| - g | + accelerometer_error + (v_first + v_last) / W ] / g,
    plus the gyro error over the window, plus the floor.

    Field. A disturbance d turns the field m by at most asin(|d| / |m|), and at least | |m| / m_rest - 1 | of it shows:
        sin(angle) = field_disturbance + | |m| / m_rest - 1 |, plus the floor.

    The constants are round numbers, chosen after a look at the errors of trial 01 and kept the same for every sample.
    There, in motion: gravity 100 % of the true errors within the bound (median 4.5 deg), field 99.7 % (7.6 deg), none
    refused. The field bound is thus no guarantee: 125 of 56,778 samples miss it, by up to 2.7 deg.

    window_s : length of the window [s]
    lever_arm_m : largest distance of the IMU from a point at rest; a hand turning about the wrist or elbow [m]
    speed_m_s : speed of that point; 0 where the trial only rotates, about 1 for the translation trials [m/s]
    accelerometer_error : bias and scale [m/s^2]
    gyro_error_rad_s, gyro_scale_error : bias left after the rest and noise [rad/s]; share of the rate [-]
    field_disturbance : iron on the sensor and in the room, as a share of the field at rest [-]
    floor_rad : alignment of the optical frame and of the sensor axes [rad]
    largest_rad : a sample with a larger bound is refused [rad]
    """

    window_s: float = 2.0
    lever_arm_m: float = 0.2
    speed_m_s: float = 0.0
    accelerometer_error: float = 0.1
    gyro_error_rad_s: float = 0.01
    gyro_scale_error: float = 0.01
    field_disturbance: float = 0.06
    floor_rad: float = float(np.deg2rad(0.5))
    largest_rad: float = float(np.deg2rad(15.0))

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0):
                raise InputError(f"`{name}` must be finite and >= 0, got {value}.")
        if self.window_s == 0 or self.largest_rad >= np.pi:
            raise InputError("`window_s` must be positive and `largest_rad` below pi.")


@explain_unknown_options
def load_broad(path: str | os.PathLike[str], bounds: BroadBounds | None = None, stride: int = 1) -> Record:
    """Read a trial as a record with the channels `gravity` and `field`, the gyro, and the optical attitude.

    bounds : None = the defaults, which are accepted for undisturbed rotation trials only
    stride : keep every stride-th sample; the windows still use all of them

    Raises
    ------
    RecordError : no such file, not a trial.
    InputError : `stride` below 1; a trial for which `bounds` must be chosen.
    """
    if stride < 1:
        raise InputError(f"`stride` must be at least 1, got {stride}.")
    file = os.fspath(path)
    trial = _load(file)
    if bounds is None:
        name = os.path.basename(file)
        if "undisturbed" not in name or "rotation" not in name:
            raise InputError(
                f"{name} is not an undisturbed rotation trial: pass `bounds=BroadBounds(...)` chosen for it."
            )
        bounds = BroadBounds()
    dt = 1.0 / trial["sampling_rate"].item()
    gyro, acceleration, field = trial["imu_gyr"], trial["imu_acc"], trial["imu_mag"]
    rest = slice(0, round(_REST_S / dt))
    if len(gyro) * dt <= _REST_S or np.ptp(gyro[rest], axis=0).max() > _REST_RATE:
        raise RecordError(f"the IMU must rest for the first {_REST_S:g} s; the references come from there.", file=file)
    gyro = gyro - gyro[rest].mean(axis=0)
    up_B, field_B = acceleration[rest].mean(axis=0), field[rest].mean(axis=0)
    sin_dip = -(up_B @ field_B) / (np.linalg.norm(up_B) * np.linalg.norm(field_B))
    dip = float(np.arcsin(np.clip(sin_dip, -1.0, 1.0)))
    directions = {
        "gravity": (*_gravity(gyro, acceleration, float(np.linalg.norm(up_B)), dt, bounds), _UP_N),
        "field": (*_field(field, float(np.linalg.norm(field_B)), bounds), np.array([0.0, np.cos(dip), -np.sin(dip)])),
    }
    keep = slice(None, None, stride)
    rate_bound = bounds.gyro_error_rad_s + bounds.gyro_scale_error * np.linalg.norm(gyro, axis=1)
    return Record(
        t=np.asarray(np.arange(len(gyro))[keep] * dt),
        channels=tuple(
            VectorChannel(
                name=name,
                frame="B",
                b_B=normalise_rows(name, vectors[keep]),
                r_N=np.tile(r_N, (len(vectors[keep]), 1)),
                angle_bound_rad=bound[keep],
                valid=bound[keep] <= bounds.largest_rad,
            )
            for name, (vectors, bound, r_N) in directions.items()
        ),
        omega_BN_B=gyro[keep],
        gyro_bound_rad_s=rate_bound[keep],
        q_BN_true=from_broad(trial["opt_quat"][keep]),
        source=f"{os.path.basename(file)}, BROAD, CC BY 4.0",
    )


def from_broad(quaternion: Array) -> Array:
    """Return q_BN (T, 4) of the benchmark's scalar-first quaternions from B to N; a row with NaN becomes all NaN."""
    q_BN = np.array(quaternion[:, [1, 2, 3, 0]])
    q_BN[np.isnan(q_BN).any(axis=1)] = np.nan
    return q_BN


def _gravity(gyro: Array, acceleration: Array, g: float, dt: float, bounds: BroadBounds) -> tuple[Array, Array]:
    """Return the window mean of the acceleration (T, 3) in B [m/s^2], and its bound (T,) [rad]."""
    from scipy.spatial.transform import Rotation

    count, half = len(gyro), max(1, round(bounds.window_s / dt / 2))
    first = np.maximum(np.arange(count) - half, 0)
    last = np.minimum(np.arange(count) + half, count - 1)
    width_s = (last - first + 1) * dt

    def over_window(values: Array) -> Array:
        total = np.cumsum(np.concatenate([np.zeros_like(values[:1]), values]), axis=0)
        return np.asarray(total[last + 1] - total[first])

    steady = Rotation.from_quat(_strapdown(gyro, dt))  # B to axes that do not turn
    mean = steady.inv().apply(over_window(steady.apply(acceleration)) / (last - first + 1)[:, None])
    rate = np.linalg.norm(gyro, axis=1)
    speed = bounds.speed_m_s + bounds.lever_arm_m * rate
    deviation = np.abs(np.linalg.norm(mean, axis=1) - g)
    sine = (deviation + bounds.accelerometer_error + (speed[first] + speed[last]) / width_s) / g
    turn = np.cumsum(rate * dt)
    longest_turn = np.maximum(turn - turn[first], turn[last] - turn)
    turned = bounds.gyro_error_rad_s * bounds.window_s / 4 + bounds.gyro_scale_error * longest_turn
    return mean, np.arcsin(np.minimum(sine, 1.0)) + turned + bounds.floor_rad


def _field(field: Array, strength: float, bounds: BroadBounds) -> tuple[Array, Array]:
    deviation = np.abs(np.linalg.norm(field, axis=1) / strength - 1.0)
    return field, np.arcsin(np.minimum(bounds.field_disturbance + deviation, 1.0)) + bounds.floor_rad


def _strapdown(gyro: Array, dt: float) -> Array:
    """Return the running product (T, 4) of the rotations gyro dt, scalar last, in log2(T) array steps."""
    from scipy.spatial.transform import Rotation

    product = Rotation.from_rotvec(gyro * dt).as_quat()
    shift = 1
    while shift < len(product):
        joined = Rotation.from_quat(product[:-shift]) * Rotation.from_quat(product[shift:])
        product = np.concatenate([product[:shift], joined.as_quat()])
        shift *= 2
    return np.asarray(product)


def _load(file: str) -> dict[str, Any]:
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    get = "the trials are at github.com/dlaidig/broad (CC BY 4.0)"
    try:
        with open(file, "rb") as stream:
            known = stream.read(128).startswith(b"MATLAB 5.0")
        trial: dict[str, Any] = loadmat(file, appendmat=False) if known else {}
    except OSError as error:
        raise RecordError(f"the trial cannot be opened: {error.strerror}; {get}.", file=file) from None
    except (ValueError, TypeError, IndexError, MatReadError, zlib.error):
        raise RecordError(f"the file is damaged or cut; {get}.", file=file) from None
    if not known:
        raise RecordError(f"this is not a MATLAB 5 file; {get}.", file=file)
    for key, width in _KEYS.items():
        values = np.asarray(trial.get(key))
        if (
            values.dtype.kind not in "fiu"
            or values.ndim != 2
            or values.shape[1] != width
            or len(values) != len(trial["imu_gyr"])
        ):
            raise RecordError(f"`{key}` must be (T, {width}); this is not a BROAD trial; {get}.", file=file, column=key)
        trial[key] = np.asarray(values, dtype=np.float64)
        bad = ~np.isfinite(trial[key]).all(axis=1)
        if key != "opt_quat" and bad.any():
            raise RecordError(f"sample {int(np.argmax(bad))} is not finite.", file=file, column=key)
    if "sampling_rate" not in trial or np.size(trial["sampling_rate"]) != 1 or not trial["sampling_rate"].item() > 0:
        raise RecordError("`sampling_rate` must be one positive number [Hz].", file=file, column="sampling_rate")
    return trial
