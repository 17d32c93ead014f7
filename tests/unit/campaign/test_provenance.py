"""Provenance: versions of what is installed, and the commit of a checkout with what was changed in it."""

import subprocess
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from optsat.campaign.provenance import commit, provenance


def test_what_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    said = provenance(["optsat", "study"])
    assert said["numpy"] == np.__version__
    assert said["command"] == ["optsat", "study"]

    def absent(name: str) -> str:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", absent)
    assert provenance([])["h5py"] is None


def test_the_commit_of_a_checkout(tmp_path: Path) -> None:
    def git(*arguments: str) -> str:
        who = ("-c", "user.name=a", "-c", "user.email=a@b.c")
        done = subprocess.run(
            ["git", "-C", str(tmp_path), *who, *arguments], capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    assert commit(tmp_path) is None
    try:
        git("init", "-q")
    except FileNotFoundError:
        pytest.skip("git is not installed")
    (tmp_path / "file").write_text("one")
    git("add", "file")
    commit.cache_clear()
    assert commit(tmp_path) is None, "no commit yet"
    git("commit", "-q", "-m", "one")
    commit.cache_clear()
    assert commit(tmp_path) == git("rev-parse", "HEAD")
    (tmp_path / "file").write_text("two")
    commit.cache_clear()
    assert commit(tmp_path) == git("rev-parse", "HEAD") + "+changes"
