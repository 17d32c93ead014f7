"""Units at the edge: right factors, and no quantity mistaken for another."""

import subprocess
import sys

import numpy as np
import pytest

from optsat.errors import InputError
from optsat.units import Kind, implausible_reason, is_implausible, kind_of, si_factor, to_si

FACTORS: list[tuple[str, Kind, float]] = [
    ("deg", "angle", np.pi / 180),
    ("°", "angle", np.pi / 180),
    ("arcsec", "angle", np.pi / 648000),
    ("rad", "angle", 1.0),
    ("deg/s", "rate", np.pi / 180),
    ("deg / s", "rate", np.pi / 180),
    ("deg/hour", "rate", np.pi / 648000),
    ("rpm", "rate", np.pi / 30),
    ("nT", "flux_density", 1e-9),
    ("uT", "flux_density", 1e-6),
    ("µT", "flux_density", 1e-6),
    ("km", "length", 1000.0),
    ("ms", "time", 1e-3),
    ("min", "time", 60.0),
    ("m/s^2", "acceleration", 1.0),
    ("g_0", "acceleration", 9.80665),
    ("-", "direction", 1.0),
]


@pytest.mark.parametrize(("unit", "kind", "factor"), FACTORS)
def test_factors(unit: str, kind: Kind, factor: float) -> None:
    assert si_factor(unit, kind) == pytest.approx(factor, rel=1e-14)
    np.testing.assert_allclose(to_si([1.0, -2.0], unit, kind), [factor, -2 * factor], rtol=1e-14)


WRONG: list[tuple[str, Kind, str]] = [
    ("m", "angle", r"`c` has the unit \[m\], which is a length; it must be an angle \[rad, deg"),
    ("Hz", "rate", "must be an angular rate"),
    ("1/s", "rate", "must be an angular rate"),
    ("deg", "direction", "which is an angle; it must be a bare direction"),
    ("-", "angle", "which is a bare direction; it must be an angle"),
    ("gauss", "flux_density", "must be a magnetic flux density"),
    ("S", "time", "must be a time"),
]


@pytest.mark.parametrize(("unit", "kind", "message"), WRONG)
def test_wrong_dimension(unit: str, kind: Kind, message: str) -> None:
    with pytest.raises(InputError, match=message):
        to_si(1.0, unit, kind, "c")


@pytest.mark.parametrize(
    "unit", ["", "degz", "(", "deg]", "m/0", "2*m", "m**9**9**9", "__import__('os')", "m" * 99, "m^", "/s"]
)
def test_unknown_unit(unit: str) -> None:
    with pytest.raises(InputError, match="unknown unit"):
        to_si(1.0, unit, "length")


def test_kind_of_takes_the_one_that_fits() -> None:
    assert kind_of("nT", ("direction", "flux_density")) == "flux_density"
    with pytest.raises(InputError, match=r"a bare direction .* or a length"):
        kind_of("s", ("direction", "length"))


def test_implausible_values() -> None:
    assert is_implausible([100.0, -101.0, np.nan, 0.0], "rate").tolist() == [False, True, False, False]
    assert is_implausible([6.2, 6.3], "angle").tolist() == [False, True]
    assert not is_implausible(1e12, "length")
    assert implausible_reason("rate") == "is beyond 100 rad/s; it looks like deg/s labelled rad/s"


def test_units_and_records_stay_light() -> None:
    code = "import sys, optsat.units, optsat.records.csv_log, optsat.records.broad; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not {"pint", "casadi", "scipy.optimize", "scipy.io", "matplotlib", "cvxpy", "typer"} & set(loaded)
