"""A study that judges a printed figure says whose, so that `optsat reproduce` runs it."""

import ast
from pathlib import Path

import pytest

from optsat.campaign.catalogue import list_studies, load_study

FOLDER = Path(__file__).parents[2] / "studies"


def prints_a_paper(source: str) -> bool:
    """Whether a study's source judges a figure of a paper: `judge_paper`, or a claim whose paper is not None."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id == "judge_paper":
                return True
            if node.func.id == "Claim":
                given = [k.value for k in node.keywords if k.arg == "paper"] + node.args[2:3]
                if not all(isinstance(value, ast.Constant) and value.value is None for value in given):
                    return True
    return False


@pytest.mark.parametrize("name", list_studies())
def test_who_judges_a_paper_names_it(name: str) -> None:
    study = load_study(name)
    source = (FOLDER / f"{name.replace('-', '_')}.py").read_text(encoding="utf-8")
    if name.endswith("-timing"):
        assert study.paper == "", "times depend on the load of the machine; `optsat reproduce` must not judge them"
    else:
        assert prints_a_paper(source) == bool(study.paper)


@pytest.mark.parametrize(
    ("source", "judges"),
    [
        ("judge_paper('a', 'b', paper=1.0, measured=1.0, tolerance=0.1)", True),
        ("Claim('a', 'b', 1.0, 2.0, verdict)", True),
        ("Claim(id='a', says='b', paper=x, measured=2.0, verdict=v)", True),
        ("Claim('a', 'b', None, 2.0, verdict)", False),
        ("judge_bar('a', 'b', measured=1.0, holds=True)", False),
    ],
)
def test_it_finds_what_judges(source: str, judges: bool) -> None:
    assert prints_a_paper(source) is judges
