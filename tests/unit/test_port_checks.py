"""Checks of ports: what fits together, what is refused, and safe values that pass."""

from typing import Any

import pytest

from optsat.errors import InputError
from optsat.port import Port
from optsat.port_checks import is_accepted


@pytest.mark.parametrize(
    ("checks", "shape", "says"),
    [
        ({"unit_norm": 0.0}, (4,), "in \\(0, 1\\)"),
        ({"unit_norm": 1e-3}, (), "of a vector or of rows"),
        ({"unit_norm": 1e-3, "direction": 1e-3}, (3,), "one of the two"),
        ({"lower": 1.0, "upper": 1.0}, (), "must be below"),
        ({"upper": float("inf")}, (), "finite"),
        ({"positive_definite": True}, (2, 3), "square"),
        ({"verdict": True}, (2,), "one number"),
        ({"counted": True}, (), "no rows"),
        ({"padding": 0.0}, (3,), "counted=True"),
        ({"safe": (0.0, 1.0)}, (3,), "3 numbers or one, got 2"),
        ({"unit_norm": 1e-3, "safe": 0.0}, (4,), "does not pass"),
        ({"lower": 1.0, "safe": 0.0}, (), "does not pass"),
        ({"positive_definite": True, "safe": 1.0, "upper": 0.5}, (2, 2), "does not pass"),
    ],
)
def test_checks_that_do_not_fit_are_refused(checks: dict[str, Any], shape: tuple[int, ...], says: str) -> None:
    with pytest.raises(InputError, match=f"Port `p` .*{says}"):
        Port("p", shape, "-", **checks)


@pytest.mark.parametrize(
    ("port", "expected"),
    [
        (Port("q_BN", (4,), "-", unit_norm=1e-3), (0.0, 0.0, 0.0, 1.0)),
        (Port("b_B", (2, 3), "-", direction=1e-3), (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)),
        (Port("P", (2, 2), "rad^2", positive_definite=True), (1.0, 0.0, 0.0, 1.0)),
        (Port("dt", (), "s", lower=0.1, upper=2.0), (0.1,)),
        (Port("torque_B", (3,), "N m"), (0.0, 0.0, 0.0)),
        (Port("torque_B", (3,), "N m", safe=(1.0, 2.0, 3.0)), (1.0, 2.0, 3.0)),
        (Port("angle", (2,), "rad", upper=4.0, safe=3.0), (3.0, 3.0)),
    ],
)
def test_safe_values_pass_the_checks_of_their_port(port: Port, expected: tuple[float, ...]) -> None:
    assert port.safe_values == expected
    assert is_accepted(port, port.safe_values)


@pytest.mark.parametrize(
    ("port", "values"),
    [
        (Port("a", (2,), "-"), (0.0, float("nan"))),
        (Port("a", (2,), "-", lower=0.0), (0.0, -1.0)),
        (Port("a", (2,), "-", upper=1.0), (0.0, 1.5)),
        (Port("a", (1, 2), "-", unit_norm=1e-3), (1.0, 0.1)),
        (Port("a", (2, 2), "-", direction=1e-3), (1.0, 0.0, 0.0, 0.0)),
        (Port("a", (2, 2), "-", positive_definite=True), (1.0, 0.1, 0.2, 1.0)),
        (Port("a", (2, 2), "-", positive_definite=True), (1.0, 2.0, 2.0, 1.0)),
        (Port("a", (2, 2), "-", positive_definite=True), (0.0, 0.0, 0.0, 1.0)),
    ],
)
def test_values_that_break_a_check_are_told(port: Port, values: tuple[float, ...]) -> None:
    assert not is_accepted(port, values)
