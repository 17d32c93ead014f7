"""Attitude bank symbols: the ports of an attitude bank, and where each error state stands."""

from optsat.attitude.backend import Value
from optsat.estimators.attitude_bank import AttitudeBank
from optsat.estimators.bank_samples import BankSamples, Device
from optsat.models.parts import GYRO, PRESSURE, Part
from optsat.port import Port
from optsat.symbolic.attitude_functions import QUATERNION


class AttitudeBankSymbols:
    """Ports and symbols of reference, carried values and inputs, and where the error states stand.

    of : symbols by port; axes : thruster axes that have a torque deviation
    bias_at, torque_at : first state of the gyro's bias, and of the torque deviations; size : number of states
    """

    bias_at = 6

    def __init__(self, bank: AttitudeBank) -> None:
        import casadi as ca

        axes = bank.thruster_axes
        self.has_bias = bank.gyro_bias_noise is not None
        bias = (Port("gyro_bias_B", (3,), "rad/s"),) if self.has_bias else ()
        torque = (Port("torque_deviation_B", (len(axes),), "N m"),) if axes else ()
        self.reference_ports = (QUATERNION, Port("omega_BN_B", (3,), "rad/s"), *bias, *torque)
        self.samples = BankSamples(_devices(bank))
        command = Port("command_B", (3,), "N m")
        self.carried_ports = (*self.samples.carried_ports, Port("last_command_B", (3,), "N m"))
        step = Port("dt", (), "s", lower=0.0, upper=1e3 * bank.sample_time, safe=bank.sample_time)
        self.input_ports = (command, step, *self.samples.input_ports)
        ports = (*self.reference_ports, *self.carried_ports, *self.input_ports)
        self.of = {port.name: ca.SX.sym(port.name, port.rows, port.columns) for port in ports}
        self.axes = axes
        self.torque_at = 9 if self.has_bias else 6
        self.size = self.torque_at + len(axes)
        letters = ("x", "y", "z")
        self.names = (
            *(f"rotation_{each} [rad]" for each in letters),
            *(f"rate_{each} [rad/s]" for each in letters),
            *(f"gyro_bias_{each} [rad/s]" for each in letters if self.has_bias),
            *(f"torque_deviation_{letters[axis]} [N m]" for axis in axes),
        )

    @property
    def arguments(self) -> list[tuple[Port, Value]]:
        """Ports and symbols of reference, carried values and inputs, which the bank's functions take."""
        ports = (*self.reference_ports, *self.carried_ports, *self.input_ports)
        return [(port, self.of[port.name]) for port in ports]

    def torque(self) -> Value:
        """Return the torque deviation on all three axes."""
        import casadi as ca

        parts = [ca.SX(0)] * 3
        for k, axis in enumerate(self.axes):
            parts[axis] = self.of["torque_deviation_B"][k]
        return ca.vertcat(*parts)


def _devices(bank: AttitudeBank) -> tuple[Device, ...]:
    pressure = tuple(part for part in bank.channels if part in PRESSURE)
    return (
        Device(Port("star_BN", (4,), "-", safe=(0.0, 0.0, 0.0, 1.0)), 4, (Part.STAR,)),
        Device(Port("gyro_B", (3,), "rad/s"), 1, GYRO),
        *([Device(Port("skewed_gyro", (1,), "rad/s"), 1, (Part.SKEWED_GYRO,))] if bank.skewed_axis else []),
        *([Device(Port("pressure_B", (len(pressure),), "N m"), 1, pressure)] if pressure else []),
    )
