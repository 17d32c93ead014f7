"""Our own elementary functions against mpmath: each binade, both real types, the edges where they could break."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import library_harness
import mpmath
import numpy as np
import pytest
from kernel_harness import any_compiler, apply
from library_harness import TYPES, Library, source_of

from optsat.kernels.codes import ARITY
from optsat.kernels.elementary import OWN
from optsat.kernels.unit import Real, library_text

CODES = sorted(OWN)
REALS: list[Real] = ["double", "float"]
# units in the last place; the worst of two million arguments in each of several ranges stay below
BOUND = {
    "ACOS": 0.7,
    "ASIN": 0.7,
    "ATAN": 0.72,
    "ATAN2": 0.78,
    "COS": 0.85,
    "EXP": 0.82,
    "LOG": 0.88,
    "SIN": 0.85,
    "TAN": 2.5,
}
SMALLEST = {"double": -1074, "float": -149}
LARGEST = {"double": 1024, "float": 128}

EXACT: dict[str, Callable[..., Any]] = {
    "ACOS": mpmath.acos,
    "ASIN": mpmath.asin,
    "ATAN": mpmath.atan,
    "ATAN2": mpmath.atan2,
    "COS": mpmath.cos,
    "EXP": mpmath.exp,
    "LOG": mpmath.log,
    "SIN": mpmath.sin,
    "TAN": mpmath.tan,
}
IN_NUMPY = {
    code: getattr(np, name)
    for code, name in zip(
        CODES, ("arccos", "arcsin", "arctan", "arctan2", "cos", "exp", "log", "sin", "tan"), strict=True
    )
}


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> dict[Real, Library]:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    results = [apply(code, *(a, b)[: ARITY[code]]) for code in CODES]
    source = source_of(ca.Function("elementary", [a, b], [ca.vertcat(*results)]))
    folder = tmp_path_factory.mktemp("elementary")
    return {real: Library(source, any_compiler(), folder, real=real) for real in REALS}


def computed(library: Library, code: str, x: Any) -> Any:
    return library.rows(x)[:, CODES.index(code)]


def worst(code: str, real: Real, x: Any, found: Any) -> tuple[float, Any]:
    """Largest error in units in the last place of the exact value, and where; NaN and infinity must be exact."""
    errors = []
    for arguments, got in zip(x.tolist(), found.tolist(), strict=True):
        with mpmath.workprec(1300 if code in ("SIN", "COS", "TAN") else 160):
            exact = EXACT[code](*map(mpmath.mpf, arguments[: ARITY[code]]))
            errors.append(_error(exact, got, real))
    return max(zip(errors, map(tuple, x.tolist()), strict=True))


def _error(exact: Any, got: float, real: Real) -> float:
    if isinstance(exact, mpmath.mpc):
        return 0.0 if np.isnan(got) else np.inf
    digits = 53 if real == "double" else 24
    if exact == 0 or not np.isfinite(got):
        limit = mpmath.ldexp(1 - mpmath.ldexp(1, -digits - 1), LARGEST[real])
        overflows = np.isinf(got) and abs(exact) >= limit and (got > 0) == (exact > 0)
        return 0.0 if overflows or got == exact else np.inf
    unit = mpmath.ldexp(1, max(mpmath.frexp(exact)[1] - digits, SMALLEST[real]))
    return float(abs(mpmath.mpf(got) - exact) / unit)


def binades(rng: np.random.Generator, real: Real, low: int, high: int, signed: bool = True) -> Any:
    """One number of each power of two from 2^low to 2^high, or of one in eight where there are many."""
    powers = np.arange(max(low, SMALLEST[real]), min(high, LARGEST[real]), 1 if real == "float" else 4)
    signs = rng.choice([-1.0, 1.0], len(powers)) if signed else 1.0
    return (signs * np.ldexp(rng.uniform(1.0, 2.0, len(powers)), powers)).astype(TYPES[real])


def near_quarter_turns(rng: np.random.Generator, real: Real) -> Any:
    limit = 1e5 if real == "double" else 800.0
    turns = np.concatenate([np.round(rng.uniform(1.0, limit / 1.5708, 200)), 29 * 2.0 ** np.arange(4), [161.0, 3.0]])
    return (turns * (np.pi / 2)).astype(TYPES[real])


def samples(code: str, real: Real) -> Any:
    rng = np.random.default_rng([CODES.index(code), real == "float"])
    near_one = 1.0 + rng.choice([-1.0, 1.0], 60) * 2.0 ** rng.uniform(-60.0, -0.5, 60)
    if code in ("SIN", "COS", "TAN"):
        # 2^797 * 6381956970095103 is the double nearest to a multiple of pi / 2
        hardest = [6381956970095103.0 * 2.0**797] if real == "double" else [3.0e38]
        edges = np.array([1e5, 99999.9, 100000.1, 800.0, 800.1, 799.9, *hardest])
        x = [binades(rng, real, -1074, 1024), near_quarter_turns(rng, real), rng.uniform(-50.0, 50.0, 400), edges]
    elif code == "EXP":
        x = [binades(rng, real, -1074, 9), rng.uniform(-746.0, 710.0, 400), rng.uniform(-104.0, 89.0, 300)]
    elif code == "LOG":
        x = [binades(rng, real, -1074, 1024, signed=False), near_one, rng.uniform(0.5, 2.0, 400)]
    elif code in ("ASIN", "ACOS"):
        inside = near_one[near_one <= 1.0]
        x = [binades(rng, real, -1074, 0), rng.uniform(-1.0, 1.0, 400), inside, -inside, [0.5, -0.5, 1.0, -1.0]]
    else:
        x = [binades(rng, real, -1074, 1024), rng.uniform(-5.0, 5.0, 400), [0.4375, 0.6875, 1.0]]
    first = np.concatenate([np.asarray(part, TYPES[real]) for part in x])
    if code != "ATAN2":
        return np.stack([first, np.ones_like(first)], axis=1)
    close = (first * 2.0 ** rng.uniform(-3.0, 3.0, len(first))).astype(TYPES[real])
    far = rng.permutation(first)
    pairs = [np.stack([first, np.where(np.isfinite(close), close, 1.0)], axis=1), np.stack([first, far], axis=1)]
    return np.concatenate(pairs)


@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("code", CODES)
@np.errstate(over="ignore", under="ignore")
def test_error_is_below_one_unit_in_the_last_place(code: str, real: Real, libraries: dict[Real, Library]) -> None:
    x = samples(code, real)
    error, place = worst(code, real, x, computed(libraries[real], code, x))
    assert error <= BOUND[code], place


@pytest.mark.parametrize("real", REALS)
@pytest.mark.parametrize("code", CODES)
@np.errstate(all="ignore")
def test_special_values_are_those_of_the_standard(code: str, real: Real, libraries: dict[Real, Library]) -> None:
    tiny, huge = np.finfo(TYPES[real]).smallest_subnormal, np.finfo(TYPES[real]).max
    special = [0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, -1.0, 1.5, -1.5, tiny, -tiny, huge, -huge]
    x = np.array([(a, b) for a in special for b in special], TYPES[real])
    found = computed(libraries[real], code, x).astype(float)
    expected = IN_NUMPY[code](*x.astype(float).T[: ARITY[code]]).astype(TYPES[real]).astype(float)
    special_result = ~np.isfinite(expected) | (expected == 0.0)
    np.testing.assert_array_equal(found[special_result], expected[special_result])
    np.testing.assert_array_equal(np.signbit(found)[expected == 0.0], np.signbit(expected)[expected == 0.0])
    np.testing.assert_allclose(found[~special_result], expected[~special_result], rtol=4 * np.finfo(TYPES[real]).eps)


@pytest.mark.parametrize("real", REALS)
def test_sine_and_cosine_are_odd_and_even_to_the_bit(real: Real, libraries: dict[Real, Library]) -> None:
    x = samples("SIN", real)
    there, back = (libraries[real].rows(sign * x) for sign in (1.0, -1.0))
    for code, sign in (("SIN", -1.0), ("COS", 1.0), ("TAN", -1.0)):
        column = CODES.index(code)
        np.testing.assert_array_equal(back[:, column], sign * there[:, column])


@pytest.mark.parametrize(
    ("code", "right", "wrong"),
    [
        ("SIN", "0x1.5555555555549p-3", "0x1.5555555559549p-3"),
        ("COS", "0x1.cd129024e088ap-115", "0x1.0p-115"),
        ("EXP", "0x1.ef35793c7673p-45", "0x1.ef35093c7673p-45"),
        ("LOG", "0x1.999999997fb35p-2", "0x1.999999917fb35p-2"),
        ("ATAN2", "0x1.a2b7f222f65e2p-56", "0x0p+0"),
        ("ACOS", "0x1.1a62633145c07p-53", "0x0p+0"),
    ],
)
def test_a_wrong_digit_is_found(
    code: str, right: str, wrong: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def mistaken(*arguments: Any) -> str:
        text = library_text(*arguments)
        assert right in text
        return text.replace(right, wrong)

    monkeypatch.setattr(library_harness, "library_text", mistaken)
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    source = source_of(ca.Function("mistaken", [a, b], [apply(code, *(a, b)[: ARITY[code]])]))
    x = samples(code, "double")
    error, _ = worst(code, "double", x, Library(source, any_compiler(), tmp_path, optimisation="-O1").rows(x)[:, 0])
    assert error > BOUND[code]
