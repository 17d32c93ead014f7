"""What is tracked is what is shipped, and what is shipped works from anywhere."""

import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from importlib import util
from pathlib import Path

import pytest

LINKS = ("problems", "solvers", "studies")
COMPILED = (".so", ".pyd")


def run(*command: str, cwd: Path, expected: int = 0) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "GIT_DIR"}}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == expected, f"{' '.join(command)}:\n{done.stdout}\n{done.stderr}"
    return done


@pytest.fixture(scope="session")
def tracked(root: Path) -> dict[str, str]:
    """The tracked paths with their modes."""
    if shutil.which("git") is None or not (root / ".git").exists():
        pytest.skip("not a git checkout: which files are tracked is not known")
    lines = run("git", "ls-files", "--stage", cwd=root).stdout.splitlines()
    return {line.partition("\t")[2]: line.split()[0] for line in lines}


def build(source: Path, out: Path, kind: str) -> Path:
    run(sys.executable, "-m", "build", "--no-isolation", f"--{kind}", "--outdir", str(out), cwd=source)
    (built,) = out.iterdir()
    return built


@pytest.fixture(scope="session")
def clean_copy(root: Path, tracked: dict[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tracked files alone, so that nothing lying about can get into a wheel, nor the build into the checkout."""
    if util.find_spec("build") is None:
        if os.environ.get("CI"):
            pytest.fail("the package `build` is absent; it belongs to the extra `test`")
        pytest.skip("the package `build` is absent: pip install 'optsat[test]'")
    copy = tmp_path_factory.mktemp("copy")
    for name in tracked:
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(root / name, copy / name, follow_symlinks=False)
    return copy


@pytest.fixture(scope="session")
def wheel(clean_copy: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(clean_copy, tmp_path_factory.mktemp("wheel"), "wheel")


@pytest.fixture(scope="session")
def sdist(clean_copy: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(clean_copy, tmp_path_factory.mktemp("sdist"), "sdist")


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The unpacked wheel."""
    folder = tmp_path_factory.mktemp("installed")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def modules(path: Path) -> dict[str, bytes]:
    """The files of a wheel with their bytes, without the notes about the distribution and what was compiled."""
    with zipfile.ZipFile(path) as archive:
        return {
            name: archive.read(name)
            for name in archive.namelist()
            if ".dist-info/" not in name and not name.endswith(COMPILED)
        }


def test_the_wheel_holds_what_was_compiled_where_a_compiler_is(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        compiled = [name for name in archive.namelist() if name.endswith(COMPILED)]
    if shutil.which("cc") or shutil.which("gcc"):
        # by the limited API, for every later Python too
        assert compiled == ["optsat/kernels/_binding.abi3.so"]
        assert "-cp311-abi3-" in wheel.name
    else:
        assert compiled == []


def test_without_a_compiler_the_wheel_is_whole(
    clean_copy: Path, wheel: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "copy"
    shutil.copytree(clean_copy, copy, symlinks=True, ignore=shutil.ignore_patterns("build", "*.egg-info"))
    monkeypatch.setenv("CC", "/nonexistent")
    interpreted = build(copy, tmp_path / "out", "wheel")
    assert modules(interpreted) == modules(wheel)
    with zipfile.ZipFile(interpreted) as archive:
        assert not [name for name in archive.namelist() if name.endswith(COMPILED)]


def test_the_wheel_holds_the_tracked_files_and_nothing_else(root: Path, tracked: dict[str, str], wheel: Path) -> None:
    expected = {}
    for name, mode in tracked.items():
        folder = name.partition("/")[0]
        if mode != "120000" and folder in {"optsat", *LINKS}:
            expected[name if folder == "optsat" else f"optsat/{name}"] = (root / name).read_bytes()
    found = modules(wheel)
    assert sorted(found) == sorted(expected), "a folder of modules that is not in `packages` of pyproject.toml?"
    assert found == expected
    assert "optsat/py.typed" in found


def test_the_sdist_builds_the_same_wheel(sdist: Path, wheel: Path, tmp_path: Path) -> None:
    with tarfile.open(sdist) as archive:
        assert not [member.name for member in archive if member.issym() or member.islnk()]
        archive.extractall(tmp_path, filter="data")
    (source,) = tmp_path.iterdir()
    rebuilt = build(source, tmp_path / "out", "wheel")
    assert modules(rebuilt) == modules(wheel)
    assert rebuilt.name == wheel.name


def test_the_unpacked_wheel_works_from_an_empty_folder(installed: Path, tmp_path: Path) -> None:
    program = (
        f"import sys; sys.path.insert(0, {str(installed)!r})\n"
        "import optsat, optsat.problems, optsat.solvers, optsat.studies, optsat.cli, optsat._version\n"
        "print(optsat.__file__, optsat._version.__version__)"
    )
    done = run(sys.executable, "-P", "-c", program, cwd=tmp_path)
    file, version = done.stdout.split()
    assert Path(file).is_relative_to(installed)
    assert list(installed.glob(f"optsat-{version}.dist-info"))


@pytest.mark.parametrize("name", LINKS)
def test_the_linked_folders_are_importable_under_one_name_only(name: str, root: Path) -> None:
    done = run(sys.executable, "-c", f"import {name}", cwd=root, expected=1)
    assert f"ImportError: import optsat.{name}, not {name}" in done.stderr


@pytest.mark.parametrize("name", LINKS)
def test_the_links_are_tracked_as_links(name: str, tracked: dict[str, str], root: Path) -> None:
    assert tracked[f"optsat/{name}"] == "120000"
    assert os.readlink(root / "optsat" / name) == f"../{name}"


def test_every_package_has_a_docstring_of_its_own(root: Path) -> None:
    settings = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"]
    without = [
        package
        for package in settings["packages"]
        if not (file := root.joinpath(*package.split("."), "__init__.py")).exists() or '"""' not in file.read_text()
    ]
    assert without == []
