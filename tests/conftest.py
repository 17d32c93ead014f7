"""Options, profiles and fixtures shared by all tests."""

import importlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

settings.register_profile("optsat", deadline=None, print_blob=True)
settings.load_profile("optsat")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--run-benchmarks", action="store_true", help="also run the tests marked `benchmark`")
    parser.addoption("--update-golden", action="store_true", help="rewrite the files in tests/golden; review the diff")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("--run-benchmarks"):
        return
    skip = pytest.mark.skip(reason="a benchmark; run it with --run-benchmarks")
    for item in items:
        if item.get_closest_marker("benchmark"):
            item.add_marker(skip)


@pytest.fixture(scope="session")
def root() -> Path:
    """The folder that holds pyproject.toml."""
    return Path(__file__).resolve().parents[1]


@pytest.fixture
def golden(root: Path, request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """Return a check that a text equals tests/golden/NAME, which --update-golden rewrites instead."""

    def check(name: str, text: str) -> None:
        path = root / "tests" / "golden" / name
        if request.config.getoption("--update-golden"):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
        kept = path.read_text(encoding="utf-8") if path.exists() else ""
        assert text == kept, f"{name} differs from what is kept; if that is meant, run pytest with --update-golden"

    return check


@pytest.fixture(scope="session")
def shared_data(root: Path) -> Callable[[str], Path]:
    """Return a lookup of data kept beside the checkout, which skips the test where the data is absent."""

    def lookup(name: str) -> Path:
        path = root.parent / "shared" / "data" / name
        if not path.exists():
            pytest.skip(f"../shared/data/{name} is not beside this checkout")
        return path

    return lookup


@pytest.fixture(scope="session", autouse=True)
def _kernels_of_the_tests(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compiled kernels go to a folder of this run, so that no test finds or leaves any elsewhere."""
    if "OPTSAT_CACHE" in os.environ:
        yield
        return
    os.environ["OPTSAT_CACHE"] = str(tmp_path_factory.mktemp("kernels"))
    yield
    del os.environ["OPTSAT_CACHE"]


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """A Chromium that has never been used."""
    # beside the tests of the report, whose folder is on the path once they are collected
    started = importlib.import_module("chromium").started

    with started(tmp_path_factory.mktemp("chromium")) as chromium:
        yield chromium
