"""The virtual machine is the oracle: printed C and NumPy have its bits on random graphs over all codes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from kernel_harness import (
    COMPILERS,
    CONSTANTS_FLOAT,
    EXACT,
    GRAPHS,
    SPECIAL,
    SPECIAL_FLOAT,
    any_compiler,
    apply,
    codes_in,
    compiled,
    compiler_named,
    differences,
    node_by_node,
    on_machine,
    printed_numpy,
    random_graph,
    random_inputs,
)

from optsat.arrays import Array
from optsat.kernels import print_numpy as numpy_printer
from optsat.kernels import print_scalar as scalar_printer
from optsat.kernels.codes import ARITY, LIBM
from optsat.kernels.float_constants import check_float_constants
from optsat.kernels.instructions import read_instructions
from optsat.kernels.lowering import lower
from optsat.kernels.program import Program

SAMPLES, STEPS = 32, 40
# of the C library, but exact
EXACT_CODES = sorted((ARITY.keys() - LIBM.keys()) | {"FMOD", "REMAINDER"})


@dataclass(frozen=True)
class Case:
    function: ca.Function
    program: Program
    x: Array
    expected: Array


def cases(seed: int, codes: Sequence[str]) -> list[Case]:
    found = []
    for k in range(GRAPHS):
        rng = np.random.default_rng([seed, k])
        function = random_graph(rng, f"graph_{k}", codes, STEPS, jacobian=k % 5 == 0)
        x = random_inputs(rng, SAMPLES)
        found.append(Case(function, lower(function), x, on_machine(function, x)))
    return found


@pytest.fixture(scope="module")
def all_codes() -> list[Case]:
    return cases(1, sorted(ARITY))


@pytest.fixture(scope="module")
def exact_codes() -> list[Case]:
    return cases(2, EXACT_CODES)


def printed(program: Program) -> str:
    """The leaf with the functions that the virtual machine calls."""
    return scalar_printer.print_scalar(program, math="libm")


def every_code() -> ca.Function:
    """One result for each code, of two numbers."""
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    return ca.Function("every_code", [a, b], [ca.vertcat(*(apply(c, *(a, b)[: ARITY[c]]) for c in sorted(ARITY)))])


def all_pairs() -> Array:
    return np.array([(a, b) for a in SPECIAL for b in SPECIAL])


def test_the_graphs_hold_every_code_and_special_values(all_codes: list[Case]) -> None:
    assert set().union(*(codes_in(case.program) for case in all_codes)) == set(ARITY)
    x = np.concatenate([case.x for case in all_codes])
    assert 0.3 < np.isin(x, SPECIAL).mean() + np.isnan(x).mean() < 0.5
    results = np.concatenate([case.expected.ravel() for case in all_codes])
    assert np.isfinite(results).mean() > 0.5
    assert ((results == 0.0) & np.signbit(results)).sum() > 100


@pytest.mark.parametrize("optimisation", ["-O0", "-O2"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_c_has_the_bits_of_the_virtual_machine(
    compiler: str, optimisation: str, all_codes: list[Case], tmp_path: Path
) -> None:
    leaves = [(case.program, printed(case.program)) for case in all_codes]
    batches = compiled(compiler_named(compiler), leaves, tmp_path, optimisation)
    found = {
        case.program.name: count
        for case, batch in zip(all_codes, batches, strict=True)
        if (count := differences(batch(case.x), case.expected))
    }
    assert found == {}


@pytest.mark.parametrize("compiler", COMPILERS)
def test_c_has_the_bits_of_the_virtual_machine_on_all_pairs_of_special_values(compiler: str, tmp_path: Path) -> None:
    function = every_code()
    program = lower(function)
    (batch,) = compiled(compiler_named(compiler), [(program, printed(program))], tmp_path)
    x = all_pairs()
    found, expected = batch(x), on_machine(function, x)
    copysign = sorted(ARITY).index("COPYSIGN")
    unsigned = np.isnan(x[:, 1])
    expected[unsigned, copysign] = np.abs(x[unsigned, 0])
    wrong = [code for k, code in enumerate(sorted(ARITY)) if differences(found[:, k : k + 1], expected[:, k : k + 1])]
    assert wrong == []


def test_folding_keeps_the_bits(all_codes: list[Case], tmp_path: Path) -> None:
    few = [case for case in all_codes if len(read_instructions(case.function).nodes) > len(case.program.nodes)][:10]
    raw = [read_instructions(case.function) for case in few]
    leaves = [(program, printed(program)) for program in raw]
    for case, batch in zip(few, compiled(any_compiler(), leaves, tmp_path, "-O0"), strict=True):
        assert differences(batch(case.x), case.expected) == 0


def test_results_may_overwrite_the_arguments(all_codes: list[Case], tmp_path: Path) -> None:
    function = all_codes[1].function
    x = ca.SX.sym("x", 8)
    parts: Any = function.call([x[:3], ca.SX(function.sparsity_in(1), x[3:6]), x[6:]])
    square = ca.Function("square", [x], [ca.vertcat(*parts[0].nonzeros())])
    program = lower(square)
    (batch,) = compiled(any_compiler(), [(program, printed(program))], tmp_path)
    assert differences(batch(all_codes[1].x), on_machine(square, all_codes[1].x)) == 0
    leaf = printed(program)
    # every load stands before the first store, in the text too
    assert leaf.rindex("= x[") < leaf.index("y[0] =")


def test_numpy_has_the_bits_of_the_virtual_machine(exact_codes: list[Case]) -> None:
    found = {
        case.program.name: count
        for case in exact_codes
        if (count := differences(printed_numpy(case.program)(case.x), case.expected))
    }
    assert found == {}


def test_numpy_has_the_bits_of_the_virtual_machine_on_all_pairs_of_special_values() -> None:
    pairs = {code: pairs_of(code) for code in EXACT_CODES}
    assert [c for c, case in pairs.items() if differences(printed_numpy(case.program)(case.x), case.expected)] == []


@pytest.mark.parametrize("code", sorted(LIBM.keys() - {"FMOD", "REMAINDER"}))
def test_numpy_has_the_elementary_functions_to_a_few_units_in_the_last_place(code: str) -> None:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("one", [a, b], [apply(code, *(a, b)[: ARITY[code]])])
    rng = np.random.default_rng(3)
    x = np.concatenate([all_pairs(), rng.normal(size=(200, 2)) * 10.0 ** rng.uniform(-3.0, 1.0, (200, 2))])
    found, expected = printed_numpy(lower(function))(x), on_machine(function, x)
    finite = np.isfinite(expected)
    assert differences(np.where(finite, 0.0, found), np.where(finite, 0.0, expected)) == 0
    np.testing.assert_array_max_ulp(found[finite], expected[finite], maxulp=4)


# what a printer could get wrong without any model noticing, and one more mistake for each other code
MISTAKES: dict[str, list[str]] = {
    "ADD": ["{a} - {b}"],
    "SUB": ["{b} - {a}"],
    "MUL": ["{a} / {b}"],
    "DIV": ["{a} * ({one} / {b})"],
    "NEG": ["{zero} - {a}"],
    "SQ": ["os_fabs({a}) * {a}"],
    "TWICE": ["{a}"],
    "INV": ["-{one} / {a}"],
    "SQRT": ["os_sqrt({a} + {zero})"],
    "FABS": ["({a} >= -{a}) ? {a} : -{a}", "-{a}"],
    "FLOOR": ["os_ceil({a})"],
    "CEIL": ["-os_floor({a})", "os_floor({a}) + {one}"],
    "FMAX": ["({a} >= {b}) ? {a} : {b}", "(isnan({b}) || {a} > {b}) ? {a} : {b}"],
    "FMIN": ["({a} <= {b}) ? {a} : {b}", "(isnan({b}) || {a} < {b}) ? {a} : {b}"],
    "SIGN": ["({a} > 0.0) ? 1.0 : (({a} < 0.0) ? -1.0 : 0.0)", "({a} >= 0.0) ? 1.0 : -1.0"],
    "COPYSIGN": ["{a}", "({b} < 0.0) ? -os_fabs({a}) : os_fabs({a})"],
    "IF_ELSE_ZERO": ["{p} ? 0.0 : {b}", "{a} * {b}"],
    "LT": ["{a} <= {b}", "!({a} >= {b})"],
    "LE": ["{a} < {b}", "!({a} > {b})"],
    "EQ": ["{a} <= {b}", "!({a} < {b} || {a} > {b})"],
    "NE": ["{a} < {b} || {a} > {b}"],
    "NOT": ["1.0 - {a}", "!({a} > 0.0 || {a} < 0.0)"],
    "AND": ["{a} * {b}", "{p}"],
    "OR": ["{p} != {q}", "{q}"],
    **{code: ["1.0" if name == "exp" else "os_libm_exp({a})"] for code, name in LIBM.items()},
}


def mistaken(cases: list[Case], code: str) -> list[Case]:
    """Graphs that hold the code, and the code alone on all pairs of special values."""
    return [*[case for case in cases if code in codes_in(case.program)][:4], pairs_of(code)]


def pairs_of(code: str) -> Case:
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    function = ca.Function("pairs", [a, b], [apply(code, *(a, b)[: ARITY[code]])])
    x = all_pairs()
    if code == "COPYSIGN":
        x = x[~np.isnan(x[:, 1])]
    return Case(function, lower(function), x, on_machine(function, x))


def test_the_fuzz_finds_every_mistake_in_the_c_table(
    all_codes: list[Case], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Printed at the level -O0, so that hundreds of leaves compile in a second or two."""
    assert MISTAKES.keys() == ARITY.keys() == scalar_printer.OPERATIONS.keys()
    leaves: list[tuple[Program, str]] = []
    of_mistake = []
    for code, templates in MISTAKES.items():
        for template in templates:
            with monkeypatch.context() as patch:
                patch.setitem(scalar_printer.OPERATIONS, code, template)
                for case in mistaken(all_codes, code):
                    program = replace(case.program, name=f"leaf_{len(leaves)}")
                    leaves.append((program, printed(program)))
                    of_mistake.append(((code, template), case))
    caught = dict.fromkeys((mistake for mistake, _ in of_mistake), 0)
    for (mistake, case), batch in zip(of_mistake, compiled(any_compiler(), leaves, tmp_path, "-O0"), strict=True):
        caught[mistake] += differences(batch(case.x), case.expected)
    assert [mistake for mistake, count in caught.items() if count == 0] == []


@pytest.mark.parametrize("mistake", ["(a > 0.0) || (a < 0.0)", "a > 0.0", "!isnan(a) || (a < 0.0)"])
def test_the_fuzz_finds_a_wrong_truth_value(mistake: str, all_codes: list[Case], tmp_path: Path) -> None:
    texts = [printed(case.program) for case in all_codes]
    used = [(case, text) for case, text in zip(all_codes, texts, strict=True) if "os_truth(" in text]
    leaves = [(case.program, text.replace("os_truth(", "mistaken(")) for case, text in used]
    extra = f"static bool mistaken(double a) {{ return {mistake}; }}"
    batches = compiled(any_compiler(), leaves, tmp_path, "-O0", extra=extra)
    assert sum(differences(batch(case.x), case.expected) for (case, _), batch in zip(used, batches, strict=True))


NUMPY_MISTAKES: dict[str, list[str]] = {
    "ADD": ["{a} - {b}"],
    "SUB": ["{b} - {a}"],
    "MUL": ["{a} / {b}"],
    "DIV": ["{a} * (1.0 / {b})"],
    "NEG": ["0.0 - {a}"],
    "SQ": ["np.abs({a}) * {a}"],
    "TWICE": ["{a}"],
    "INV": ["-1.0 / {a}"],
    "SQRT": ["np.sqrt({a} + 0.0)"],
    "FABS": ["np.maximum({a}, -{a})"],
    "FLOOR": ["np.ceil({a})", "np.trunc({a})"],
    "CEIL": ["-np.floor({a})", "np.trunc({a})"],
    "FMAX": ["np.maximum({a}, {b})", "np.where({a} >= {b}, {a}, {b})"],
    "FMIN": ["np.minimum({a}, {b})", "np.where({a} <= {b}, {a}, {b})"],
    "SIGN": ["np.where({a} > 0.0, 1.0, np.where({a} < 0.0, -1.0, 0.0))"],
    "COPYSIGN": ["np.where({b} < 0.0, -np.abs({a}), np.abs({a}))"],
    "IF_ELSE_ZERO": ["{a} * {b}", "np.where({a} > 0.0, {b}, 0.0)"],
    "LT": ["{a} <= {b}", "~({a} >= {b})"],
    "LE": ["{a} < {b}", "~({a} > {b})"],
    "EQ": ["{a} <= {b}"],
    "NE": ["({a} < {b}) | ({a} > {b})"],
    "NOT": ["~({a} > 0.0)"],
    "AND": ["{p} | {q}"],
    "OR": ["{p} ^ {q}"],
    "FMOD": ["np.mod({a}, {b})"],
    "REMAINDER": ["np.fmod({a}, {b})", "{a} - {b} * np.round({a} / {b})"],
}


def test_the_fuzz_finds_every_mistake_in_the_numpy_table(
    exact_codes: list[Case], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert NUMPY_MISTAKES.keys() == set(EXACT_CODES)
    missed = []
    for code, templates in NUMPY_MISTAKES.items():
        for template in templates:
            with monkeypatch.context() as patch:
                patch.setitem(numpy_printer.OPERATIONS, code, template)
                batches = [(case, printed_numpy(case.program)) for case in mistaken(exact_codes, code)]
            if not any(differences(batch(case.x), case.expected) for case, batch in batches):
                missed.append((code, template))
    assert missed == []


@pytest.mark.parametrize("compiler", COMPILERS)
def test_float_has_the_bits_of_float_arithmetic(compiler: str, tmp_path: Path) -> None:
    leaves, samples = [], []
    for k in range(GRAPHS):
        rng = np.random.default_rng([4, k])
        program = lower(random_graph(rng, f"graph_{k}", sorted(EXACT), STEPS, k % 5 == 0, CONSTANTS_FLOAT))
        leaf = printed(program)
        check_float_constants(program.name, leaf)
        leaves.append((program, leaf))
        samples.append(random_inputs(rng, SAMPLES, SPECIAL_FLOAT).astype(np.float32))
    batches = compiled(compiler_named(compiler), leaves, tmp_path, real=np.float32)
    found = {
        program.name: count
        for (program, _), x, batch in zip(leaves, samples, batches, strict=True)
        if (count := differences(batch(x), node_by_node(program, np.float32)(x)))
    }
    assert found == {}


def test_node_by_node_has_the_bits_of_the_virtual_machine(exact_codes: list[Case]) -> None:
    checked = [case for case in exact_codes if codes_in(case.program) <= EXACT.keys()]
    assert len(checked) > 10
    assert not any(differences(node_by_node(case.program, np.float64)(case.x), case.expected) for case in checked)
