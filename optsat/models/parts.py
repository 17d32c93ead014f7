"""Parts: what can fail on the spacecraft whose faults are diagnosed, by the names used in logs, files and results."""

from enum import Enum


class Part(Enum):
    """One sensor channel or one axis of thrusters that fails by itself."""

    GYRO_X = "gyro.x"
    GYRO_Y = "gyro.y"
    GYRO_Z = "gyro.z"
    SKEWED_GYRO = "skewed_gyro"
    STAR = "star"
    ACCELEROMETER_X = "accelerometer.x"
    ACCELEROMETER_Y = "accelerometer.y"
    ACCELEROMETER_Z = "accelerometer.z"
    GPS = "gps"
    PRESSURE_X = "pressure.x"
    PRESSURE_Y = "pressure.y"
    PRESSURE_Z = "pressure.z"
    THRUSTER_X = "thruster.x"
    THRUSTER_Y = "thruster.y"
    THRUSTER_Z = "thruster.z"

    @property
    def device(self) -> str:
        """What the part belongs to: gyro, skewed_gyro, star, accelerometer, gps, pressure or thruster."""
        return self.value.partition(".")[0]

    @property
    def axis(self) -> int | None:
        """0, 1, 2 for the axis x, y, z of B, or None for a part that fails as a whole."""
        letter = self.value.partition(".")[2]
        return "xyz".index(letter) if letter else None

    @property
    def is_thruster(self) -> bool:
        """Whether it is an axis of thrusters."""
        return self.device == "thruster"


GYRO = (Part.GYRO_X, Part.GYRO_Y, Part.GYRO_Z)
ACCELEROMETER = (Part.ACCELEROMETER_X, Part.ACCELEROMETER_Y, Part.ACCELEROMETER_Z)
PRESSURE = (Part.PRESSURE_X, Part.PRESSURE_Y, Part.PRESSURE_Z)
THRUSTERS = (Part.THRUSTER_X, Part.THRUSTER_Y, Part.THRUSTER_Z)
