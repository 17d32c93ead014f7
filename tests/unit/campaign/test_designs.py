"""Designs: parameters from the cell alone, the laws that they promise, and an even spread where it is promised."""

import itertools
from typing import Any

import numpy as np
import pytest
import toy_study
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from optsat.campaign.designs import Design, Grid, Layout, RandomDesign, SobolDesign
from optsat.campaign.distributions import Distribution, LogUniform, Normal, Uniform
from optsat.errors import InputError

FACTORS: dict[str, Distribution] = {
    "rate": Uniform(-1.0, 3.0),
    "bound": LogUniform(1e-3, 10.0),
    "bias": Normal(2.0, 0.5),
}
DESIGNS = [Grid({"m": (2, 3), "law": ("cap", "angle", "edge")}), RandomDesign(FACTORS), SobolDesign(FACTORS)]


@given(st.sampled_from(DESIGNS), st.integers(0, 2**63 - 1), st.integers(0, 300), st.integers(1, 40))
def test_a_case_depends_on_its_cell_alone(design: Design, key: int, first: int, count: int) -> None:
    whole = design.columns(key, np.arange(first + count))
    part = design.columns(key, np.arange(first, first + count))
    for name, column in whole.items():
        np.testing.assert_array_equal(part[name], column[first:])
    assert all(len(column) == 0 for column in design.columns(key, np.arange(0)).values())


def test_a_grid_is_every_combination_again_and_again() -> None:
    grid = Grid({"m": (2, 3), "law": ("cap", "angle", "edge")})
    cases = Layout(14, 0, grid).cases(range(14))
    both = list(itertools.product((2, 3), ("cap", "angle", "edge")))
    assert [(case["m"], case["law"]) for case in cases] == (both * 3)[:14]
    assert [case["replicate"] for case in cases] == [0] * 6 + [1] * 6 + [2] * 2
    assert [type(value) for value in cases[0].values()] == [int, str, int]


@pytest.mark.parametrize("kind", [RandomDesign, SobolDesign])
def test_factors_follow_their_laws_and_other_keys_give_other_points(kind: Any) -> None:
    columns = kind(FACTORS).columns(11, np.arange(4096))
    laws = {"rate": stats.uniform(-1, 4), "bound": stats.loguniform(1e-3, 10), "bias": stats.norm(2, 0.5)}
    for name, law in laws.items():
        assert stats.kstest(columns[name], law.cdf).pvalue > 1e-3
        assert not np.any(columns[name] == kind(FACTORS).columns(12, np.arange(4096))[name])
    assert abs(np.corrcoef(columns["rate"], columns["bias"])[0, 1]) < 4 / np.sqrt(4096)


@pytest.mark.parametrize("first", [0, 256, 768])
def test_sobol_points_fill_every_strip_and_every_square(first: int) -> None:
    """256 points from a multiple of 256 on: one in each of 256 strips, one in each of 16 x 16 squares."""
    unit: dict[str, Distribution] = {"x": Uniform(0.0, 1.0), "y": Uniform(0.0, 1.0)}
    columns = SobolDesign(unit).columns(5, np.arange(first, first + 256))
    for column in columns.values():
        assert len(set((column * 256).astype(int))) == 256
    squares = {(int(16 * x), int(16 * y)) for x, y in zip(columns["x"], columns["y"], strict=True)}
    assert len(squares) == 256


def test_sobol_points_integrate_better_than_random_ones() -> None:
    def error(design: Design, key: int) -> float:
        columns = design.columns(key, np.arange(1024))
        return float(np.mean(columns["x"] * columns["y"]) - 0.25)

    unit: dict[str, Distribution] = {"x": Uniform(0.0, 1.0), "y": Uniform(0.0, 1.0)}
    plain, even = ([error(kind(unit), key) for key in range(20)] for kind in (RandomDesign, SobolDesign))
    assert np.std(even) < 0.05 * np.std(plain)
    assert abs(np.mean(even)) < 4 * np.std(even) / np.sqrt(20), "the shift leaves no bias"


def test_lists_of_cases_as_columns() -> None:
    layout = Layout.of("toy-study", toy_study.study.cases, 5, 0)
    np.testing.assert_array_equal(layout.columns(range(2, 4))["offset"], [2.0, 3.0])
    assert layout.columns(range(0)) == {}


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Grid({}), "needs factors with values"),
        (lambda: Grid({"a": (1,), "b": ()}), "b has none"),
        (lambda: Grid({"replicate": (1,)}), "another name"),
        (lambda: RandomDesign({}), "random design needs at least one factor"),
        (lambda: SobolDesign({}), "Sobol design needs at least one factor"),
        (lambda: Uniform(1.0, 1.0), "`low` of Uniform must be below"),
        (lambda: Uniform(0.0, np.inf), "both finite"),
        (lambda: LogUniform(0.0, 1.0), "above zero"),
        (lambda: Normal(0.0, 0.0), "`deviation` above zero"),
        (lambda: SobolDesign(FACTORS).columns(0, np.array([2**30])), "cases at most"),
    ],
)
def test_what_lays_nothing_out(make: Any, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()
