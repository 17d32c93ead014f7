"""Bank samples: what arrives at a bank of hypotheses, and how probable each sample is where its channel has failed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from optsat.attitude.backend import Value
from optsat.models.parts import Part
from optsat.port import Port

NEVER = -1e30
"""Log density of what cannot be, small in either precision."""

MISSING, VALID, INVALID = 0.0, 1.0, 2.0
"""What a channel brings at one sample."""


@dataclass(frozen=True)
class Device:
    """What sends samples: its port, the numbers that make one channel, and its channels in order."""

    port: Port
    rows: int
    parts: tuple[Part, ...]

    @property
    def last(self) -> Port:
        """What it sent last."""
        return Port(f"last_{self.port.name}", self.port.shape, self.port.unit, safe=_resting(self.port))


@dataclass(frozen=True)
class Sensor:
    """One channel: the numbers it sends, what they would be at the reference, and the noise of each.

    value, last : columns of samples; exact : deviation of a dead or frozen reading; can_be_dead : zero is a reading
    """

    value: Value
    last: Value
    expected: Value
    deviation: Sequence[float]
    exact: Sequence[float]
    can_be_dead: bool = True


def _resting(port: Port) -> tuple[float, ...] | None:
    return (0.0, 0.0, 0.0, 1.0) if port.shape == (4,) else None


@dataclass(frozen=True)
class BankSamples:
    """Samples of all devices with the flags `received` and `seen`, one for each channel: now, and ever before."""

    devices: tuple[Device, ...]

    @property
    def channels(self) -> tuple[Part, ...]:
        """Channels of all devices in the order of use."""
        return tuple(part for device in self.devices for part in device.parts)

    @property
    def input_ports(self) -> tuple[Port, ...]:
        """Samples, and which of them were received."""
        flags = Port("received", (len(self.channels),), "-", lower=0.0, upper=1.0)
        return (*(device.port for device in self.devices), flags)

    @property
    def carried_ports(self) -> tuple[Port, ...]:
        """Samples received last, and which channels have sent any."""
        flags = Port("seen", (len(self.channels),), "-", lower=0.0, upper=1.0)
        return (*(device.last for device in self.devices), flags)

    def carried_on(self, of: Mapping[str, Value], kinds: Sequence[Value]) -> list[Value]:
        """Return what is carried to the next sample: the last valid one of each channel, and which have sent any."""
        import casadi as ca

        channel, values = 0, []
        for device in self.devices:
            now, last = of[device.port.name], of[device.last.name]
            for k in range(len(device.parts)):
                part = slice(k * device.rows, (k + 1) * device.rows)
                is_valid = is_kind(kinds[channel], VALID)
                values.append(ca.if_else(is_valid, now[part], last[part]))
                channel += 1
        seen = [ca.if_else(is_kind(kind, VALID), 1, of["seen"][c]) for c, kind in enumerate(kinds)]
        return [*values, *seen]


def kind_of(received: Value, is_possible: Value = 1) -> Value:
    """Return MISSING, VALID or INVALID of a channel, from its flag and whether a healthy sensor can send this."""
    import casadi as ca

    return ca.if_else(received > 0.5, ca.if_else(is_possible, VALID, INVALID), MISSING)


def is_kind(kind: Value, which: float) -> Value:
    """Return whether a kind is this one."""
    import casadi as ca

    return ca.fabs(kind - which) < 0.5


def exact_density(sensor: Sensor, seen: Value) -> Value:
    """Return the log density of a sample as dead or frozen, the part of a failed channel's that needs no state.

    A quarter of N(y; 0, s^2), where zero is a reading, and a quarter of N(y; y_last, 2 s^2), where there was one.
    """
    import casadi as ca

    rows = len(sensor.exact)
    variances = ca.DM([each**2 for each in sensor.exact])
    volume = ca.DM(1)
    for each in sensor.exact:
        volume = volume * each**2
    quarter = float(ca.log(0.25))
    change = sensor.value - sensor.last
    frozen = quarter + log_normal(ca.sum1(change**2 / (2 * variances)), 2.0**rows * volume, rows)
    frozen = ca.if_else(seen > 0.5, frozen, NEVER)
    if not sensor.can_be_dead:
        return frozen
    dead = quarter + log_normal(ca.sum1(sensor.value**2 / variances), volume, rows)
    return log_sum(dead, frozen)


def log_normal(square: Value, variance: Value, rows: int = 1) -> Value:
    """Return the log density of a normal vector, from its squared distance and the product of its variances."""
    import casadi as ca

    return -0.5 * (square + ca.log(variance) + rows * float(ca.log(2 * ca.pi)))


def log_sum(a: Value, b: Value) -> Value:
    """Return log(exp a + exp b) without overflow."""
    import casadi as ca

    return ca.fmax(a, b) + ca.log(1 + ca.exp(-ca.fabs(a - b)))
