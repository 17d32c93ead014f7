"""The listing of the studies folder is the catalogue."""

import subprocess
import sys
from pathlib import Path

import pytest

from optsat.campaign import catalogue
from optsat.errors import InputError

TOY = Path(__file__).with_name("toy_study.py")


@pytest.fixture
def studies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A package of studies: the toy, one that defines nothing, a private helper."""
    package = f"studies_of_{tmp_path.name.replace('-', '_')}"
    folder = tmp_path / package
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "toy_study.py").write_text(TOY.read_text())
    (folder / "empty_study.py").write_text('"""Defines\n\nnothing."""\n')
    (folder / "_helper.py").write_text("raise RuntimeError('a listing must not import')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(catalogue, "_PACKAGE", package)
    return package


@pytest.mark.usefixtures("studies")
def test_listing_reads_names_and_first_lines() -> None:
    assert catalogue.list_studies() == {
        "empty-study": "Defines",
        "toy-study": "A study small enough to know its answers; workers import it by this file's name.",
    }


def test_listing_imports_nothing(studies: str) -> None:
    catalogue.list_studies()
    assert not [name for name in sys.modules if name.startswith(f"{studies}.")]


@pytest.mark.parametrize("name", ["toy-study", "toy_study"])
@pytest.mark.usefixtures("studies")
def test_loading(name: str) -> None:
    assert catalogue.load_study(name).title == "A toy"


@pytest.mark.usefixtures("studies")
def test_a_misspelt_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(InputError, match=r"no study `toy-studdy`. Did you mean `toy-study`"):
        catalogue.load_study("toy-studdy")


@pytest.mark.usefixtures("studies")
def test_a_file_that_defines_no_study_is_named() -> None:
    with pytest.raises(InputError, match=r"empty_study must define `study = Study\(name='empty-study'"):
        catalogue.load_study("empty-study")


def test_every_study_of_the_folder_loads_and_says_what_it_is() -> None:
    for name, says in catalogue.list_studies().items():
        assert says, f"{name} has no docstring"
        assert catalogue.load_study(name).name == name


def test_listing_the_real_folder_loads_nothing_heavy(root: Path) -> None:
    program = (
        "import sys; from optsat.campaign.catalogue import list_studies; list_studies();"
        "print(sorted({'casadi', 'scipy', 'cvxpy', 'matplotlib', 'clarabel'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
