"""The BROAD loader: a synthetic trial checked in closed form, and the measured trial against its optical reference."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import loadmat, savemat
from scipy.spatial.transform import Rotation

from optsat.arrays import Array
from optsat.errors import InputError, RecordError
from optsat.records.broad import BroadBounds, load_broad
from optsat.records.record import Record

RATE_HZ = 50.0
NAME = "90_undisturbed_slow_rotation_Z.mat"
TRIAL = "broad/01_undisturbed_slow_rotation_A.mat"


def synthetic(**changes: Any) -> dict[str, Any]:
    """A trial of 30 s: 22 s at rest in a tilted attitude, then a turn about a skew axis with the IMU 0.1 m off it."""
    t = np.arange(0, 30, 1 / RATE_HZ)
    angle = np.where(t < 22, 0.0, 0.5 * (1 - np.cos(2 * (t - 22))))
    rate = np.where(t < 22, 0.0, np.sin(2 * (t - 22)))
    acceleration_angle = np.where(t < 22, 0.0, 2 * np.cos(2 * (t - 22)))
    axis, arm = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.1, 0.0])
    into_N = Rotation.from_rotvec([0.4, -0.7, 1.1]) * Rotation.from_rotvec(angle[:, None] * axis)
    centripetal = np.cross(axis, np.cross(axis, arm))
    linear = acceleration_angle[:, None] * np.cross(axis, arm) + (rate**2)[:, None] * centripetal
    field_N = 45.0 * np.array([0.0, 0.35, -np.sqrt(1 - 0.35**2)])
    x, y, z, w = into_N.as_quat().T
    trial: dict[str, Any] = {
        "imu_gyr": rate[:, None] * axis + [0.01, -0.02, 0.005],
        "imu_acc": into_N.inv().apply([0, 0, 9.81]) + linear,
        "imu_mag": into_N.inv().apply(field_N),
        "opt_quat": np.stack([w, x, y, z], axis=1),
        "sampling_rate": RATE_HZ,
    }
    return trial | changes


def save(folder: Path, trial: dict[str, Any], name: str = NAME) -> Path:
    savemat(folder / name, trial)
    return folder / name


def true_error(record: Record, name: str) -> tuple[Array, Array]:
    """Return the angle between b_B and A(q_BN) r_N [rad] where both are known, and its bound."""
    channel = record.channel(name)
    use = record.has_truth & channel.valid
    assert record.q_BN_true is not None
    expected = Rotation.from_quat(record.q_BN_true[use]).inv().apply(channel.r_N[use])
    b_B = channel.b_B[use]
    error = np.arctan2(np.linalg.norm(np.cross(b_B, expected), axis=1), np.sum(b_B * expected, axis=1))
    return np.asarray(error), channel.angle_bound_rad[use]


def test_synthetic_trial(tmp_path: Path) -> None:
    record = load_broad(save(tmp_path, synthetic()))
    for name, largest in (("gravity", 0.02), ("field", 1e-9)):
        error, bound = true_error(record, name)
        assert len(error) == len(record)
        assert np.all(error <= bound)
        assert error.max() < largest
    assert record.omega_BN_B is not None
    assert np.abs(record.omega_BN_B[: int(20 * RATE_HZ)]).max() < 1e-12  # the bias of the rest is gone
    np.testing.assert_allclose(record.channel("field").r_N[0], [0, 0.35, -np.sqrt(1 - 0.35**2)], atol=1e-9)


def test_window_beats_the_single_sample(tmp_path: Path) -> None:
    path = save(tmp_path, synthetic())
    windowed, _ = true_error(load_broad(path), "gravity")
    single, _ = true_error(load_broad(path, BroadBounds(window_s=0.001, largest_rad=3.0)), "gravity")
    assert len(windowed) == len(single)
    inside = slice(int(23 * RATE_HZ), int(29 * RATE_HZ))  # moving, with a whole window
    assert windowed[inside].mean() < 0.5 * single[inside].mean()


def test_stride_thins_without_touching_the_windows(tmp_path: Path) -> None:
    path = save(tmp_path, synthetic())
    full, thin = load_broad(path), load_broad(path, stride=7)
    np.testing.assert_array_equal(thin.t, full.t[::7])
    np.testing.assert_array_equal(thin.channel("gravity").b_B, full.channel("gravity").b_B[::7])


def test_missing_optical_samples_are_nan(tmp_path: Path) -> None:
    trial = synthetic()
    trial["opt_quat"][5, 2] = np.nan
    record = load_broad(save(tmp_path, trial))
    assert np.flatnonzero(~record.has_truth).tolist() == [5]


def test_large_bounds_are_refused(tmp_path: Path) -> None:
    trial = synthetic()
    trial["imu_mag"][1200:1300] *= 1.5
    record = load_broad(save(tmp_path, trial))
    assert np.flatnonzero(~record.channel("field").valid).tolist() == list(range(1200, 1300))
    assert record.channel("gravity").valid.all()


def test_bounds_never_look_at_the_optical_reference(tmp_path: Path) -> None:
    trial = synthetic()
    turned = load_broad(save(tmp_path, trial | {"opt_quat": np.roll(trial["opt_quat"], 1, axis=1)}))
    straight = load_broad(save(tmp_path, trial))
    for name in ("gravity", "field"):
        for part in ("b_B", "r_N", "angle_bound_rad"):
            np.testing.assert_array_equal(getattr(turned.channel(name), part), getattr(straight.channel(name), part))


def test_refusals(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"none\.mat.*github\.com/dlaidig/broad"):
        load_broad(tmp_path / "none.mat")
    (tmp_path / "text.mat").write_text("no trial at all, only some text that is long enough")
    with pytest.raises(RecordError, match="not a MATLAB 5 file"):
        load_broad(tmp_path / "text.mat")
    whole = save(tmp_path, synthetic()).read_bytes()
    for size in range(0, len(whole), 997):
        (tmp_path / "cut.mat").write_bytes(whole[:size])
        with pytest.raises(RecordError):
            load_broad(tmp_path / "cut.mat", BroadBounds())
    for changes, column in (
        ({"imu_acc": np.zeros((5, 3))}, "imu_acc"),
        ({"imu_gyr": "fast"}, "imu_gyr"),
        ({"imu_mag": np.full((1500, 3), np.nan)}, "imu_mag"),
        ({"sampling_rate": -1.0}, "sampling_rate"),
    ):
        with pytest.raises(RecordError, match=f"column {column}"):
            load_broad(save(tmp_path, synthetic(**changes)))
    moving, short = synthetic(), synthetic()
    moving["imu_gyr"][500:510] += 0.2
    short |= {key: short[key][:900] for key in ("imu_gyr", "imu_acc", "imu_mag", "opt_quat")}
    for trial in (moving, short):
        with pytest.raises(RecordError, match="must rest for the first 20 s"):
            load_broad(save(tmp_path, trial))
    path = save(tmp_path, synthetic(), "23_disturbed_stationary_magnet_A.mat")
    with pytest.raises(InputError, match="not an undisturbed rotation trial"):
        load_broad(path)
    assert len(load_broad(path, BroadBounds(speed_m_s=1.0))) == 1500
    with pytest.raises(InputError, match="stride"):
        load_broad(path, stride=0)
    with pytest.raises(InputError, match="lever_arm_m"):
        BroadBounds(lever_arm_m=-1)
    with pytest.raises(InputError, match="window_s"):
        BroadBounds(window_s=0)


def test_measured_trial(shared_data: Callable[[str], Path]) -> None:
    path = shared_data(TRIAL)
    record = load_broad(path)
    moving = loadmat(path)["movement"].ravel().astype(bool)[record.has_truth]
    for name, contained, median_deg in (("gravity", 0.9999, 5.0), ("field", 0.995, 8.0)):
        error, bound = true_error(record, name)
        assert record.channel(name).valid.mean() > 0.999
        assert np.mean(error[moving] <= bound[moving]) >= contained
        assert np.rad2deg(np.median(bound[moving])) < median_deg


def test_measured_quaternion_takes_north_to_body(shared_data: Callable[[str], Path]) -> None:
    """At rest the accelerometer itself says which way is up; the transposed convention would miss it by far."""
    raw = loadmat(shared_data(TRIAL))
    rest = slice(0, int(20 * 285.7))
    record = load_broad(shared_data(TRIAL))
    assert record.q_BN_true is not None
    x, y, z, w = record.q_BN_true[rest].mean(axis=0)
    up_B = np.array([2 * (x * z - y * w), 2 * (y * z + x * w), w * w - x * x - y * y + z * z])  # A(q_BN) (0, 0, 1)
    measured = raw["imu_acc"][rest].mean(axis=0)
    assert up_B @ measured / np.linalg.norm(measured) > np.cos(np.deg2rad(0.5))
    up_of_transpose = Rotation.from_quat(record.q_BN_true[::1000][record.has_truth[::1000]]).apply([0, 0, 1])
    gravity = record.channel("gravity").b_B[::1000][record.has_truth[::1000]]
    assert np.sum(up_of_transpose * gravity, axis=1).min() < 0.5
