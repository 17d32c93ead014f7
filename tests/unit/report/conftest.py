"""One browser for all tests of this folder."""

from collections.abc import Iterator

import pytest
from chromium import Chromium, started


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chromium]:
    """A Chromium that has never been used."""
    with started(tmp_path_factory.mktemp("chromium")) as chromium:
        yield chromium
