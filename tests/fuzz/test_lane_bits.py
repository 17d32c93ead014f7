"""Lanes: at every width, by gcc and clang, each sample has the bits of the scalar form and of CasADi's machine."""

from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from kernel_harness import (
    COMPILERS,
    GRAPHS,
    SPECIAL,
    SPECIAL_FLOAT,
    any_compiler,
    apply,
    compiler_named,
    differences,
    on_machine,
    random_graph,
    random_inputs,
)
from library_harness import Library, source_of

from optsat.kernels import print_lanes as lanes_printer
from optsat.kernels.codes import ARITY
from optsat.kernels.unit import Real

SPECIALS: dict[Real, tuple[float, ...]] = {"double": SPECIAL, "float": SPECIAL_FLOAT}
CODES = sorted(ARITY)


def every_code() -> ca.Function:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    results = [apply(code, *(a, b)[: ARITY[code]]) for code in CODES]
    # truth values as numbers, numbers as truth values, constants
    more = [apply("AND", a, b) + 3.7, apply("NOT", apply("LT", a, b)), apply("IF_ELSE_ZERO", a, ca.SX(-2.5)), -2.5 * a]
    return ca.Function("every_code", [a, b], [ca.vertcat(*results, *more)])


def pairs(real: Real) -> Any:
    rng = np.random.default_rng(6)
    special = np.array([(a, b) for a in SPECIALS[real] for b in SPECIALS[real]])
    sizes = 10.0 ** rng.uniform(-6.0, 6.0, (60, 2))
    return np.concatenate([special, rng.uniform(-1.0, 1.0, (60, 2)), rng.normal(size=(60, 2)) * sizes])


@pytest.fixture(scope="module")
def scalar(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, Real], Any]:
    """Results of the scalar form, compiled without optimisation."""
    folder = tmp_path_factory.mktemp("scalar")
    found: dict[tuple[str, Real], Any] = {}
    for math in ("own", "libm"):
        source = source_of(every_code(), math)
        for real in SPECIALS:
            found[math, real] = Library(source, any_compiler(), folder, 1, real, "-O0").rows(pairs(real))
    return found


def test_the_scalar_form_has_the_bits_of_the_virtual_machine(scalar: dict[tuple[str, Real], Any]) -> None:
    x = pairs("double")
    found, expected = scalar["libm", "double"], on_machine(every_code(), x)
    unsigned = np.isnan(x[:, 1])
    expected[unsigned, CODES.index("COPYSIGN")] = np.abs(x[unsigned, 0])
    assert differences(found, expected) == 0


@pytest.mark.parametrize("width", [2, 4, 8])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_every_code_has_the_bits_of_the_scalar_form(
    compiler: str, width: int, scalar: dict[tuple[str, Real], Any], tmp_path: Path
) -> None:
    library = Library(source_of(every_code()), compiler_named(compiler), tmp_path, width, optimisation="-O1")
    found, expected = library.rows(pairs("double")), scalar["own", "double"]
    wrong = [k for k in range(found.shape[1]) if differences(found[:, k : k + 1], expected[:, k : k + 1])]
    assert [CODES[k] if k < len(CODES) else f"more {k - len(CODES)}" for k in wrong] == []


@pytest.mark.parametrize("width", [2, 4, 8, 16])
def test_random_graphs_have_the_bits_of_the_virtual_machine(width: int, tmp_path: Path) -> None:
    for k in range(GRAPHS // 25):
        rng = np.random.default_rng([7, width, k])
        function = random_graph(rng, f"graph_{k}", CODES, 40, jacobian=k % 5 == 4)
        x = random_inputs(rng, 4 * width + 1)
        compiler = compiler_named(COMPILERS[k % len(COMPILERS)])
        source = source_of(ca.Function(f"graph_{k}", *dense(function)), "libm")
        library = Library(source, compiler, tmp_path, width, optimisation="-O1")
        assert differences(library.rows(x), on_machine(ca.Function("dense", *dense(function)), x)) == 0


def dense(function: ca.Function) -> tuple[list[Any], list[Any]]:
    """The same with one column in and one out."""
    x = ca.SX.sym("x", 8)
    parts: Any = function.call([x[:3], ca.SX(function.sparsity_in(1), x[3:6]), x[6:]])
    return [x], [ca.vertcat(*(ca.vec(ca.densify(part)) for part in parts))]


MISTAKES = {
    "IF_ELSE_ZERO": "os_lanes_or_zero(~{p}, {b})",
    "FMAX": "os_lanes_select((os_lanes_bool_t)({a} >= {b}), {a}, {b})",
    "FMIN": "os_lanes_select((os_lanes_bool_t)({b} < {a}), {b}, {a})",
    "FABS": "os_lanes_fmax({a}, -{a})",
    "NEG": "{zero} - {a}",
    "COPYSIGN": "os_lanes_select((os_lanes_bool_t)({b} < {zero}), -os_lanes_fabs({a}), os_lanes_fabs({a}))",
    "SIGN": "os_lanes_select((os_lanes_bool_t)({a} >= {zero}), {one}, -{one})",
    "LT": "~(os_lanes_bool_t)({a} >= {b})",
    "NE": "(os_lanes_bool_t)({a} < {b}) | (os_lanes_bool_t)({a} > {b})",
    "NOT": "os_lanes_truth({one} - os_lanes_or_zero({p}, {one})) & {p}",
    "AND": "{p} | {q}",
}


def test_mistakes_in_the_lanes_are_found(
    scalar: dict[tuple[str, Real], Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for code, template in MISTAKES.items():
        monkeypatch.setitem(lanes_printer.OPERATIONS, code, template)
    found = Library(source_of(every_code()), any_compiler(), tmp_path, 2, "double", "-O0").rows(pairs("double"))
    expected = scalar["own", "double"]
    wrong = {CODES[k] for k in range(len(CODES)) if differences(found[:, k : k + 1], expected[:, k : k + 1])}
    assert wrong == MISTAKES.keys()


def test_a_broadcast_constant_keeps_the_sign_of_zero(tmp_path: Path) -> None:
    """No constant -0 leaves CasADi's expressions, but folding makes some."""
    x = ca.SX.sym("x")
    zero = apply("NEG", apply("FABS", ca.SX(0.0)))
    function = ca.Function("negative_zero", [x], [apply("COPYSIGN", x, apply("MUL", ca.SX(-1.0), zero)), zero])
    expected = on_machine(function, np.ones((5, 1)))
    found = Library(source_of(function), any_compiler(), tmp_path, 4).rows(np.ones((5, 1)))
    assert differences(found, expected) == 0


@pytest.mark.parametrize(("math", "width"), [("own", 4), ("own", 8), ("libm", 4)])
def test_float_lanes_have_the_bits_of_the_scalar_form(
    math: str, width: int, scalar: dict[tuple[str, Real], Any], tmp_path: Path
) -> None:
    library = Library(source_of(every_code(), math), any_compiler(), tmp_path, width, "float", "-O1")
    assert differences(library.rows(pairs("float")), scalar[math, "float"]) == 0
