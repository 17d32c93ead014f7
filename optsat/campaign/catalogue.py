"""The catalogue of studies is the listing of their folder."""

import ast
import importlib
import importlib.util
import pkgutil
from pathlib import Path

from optsat.campaign.study import Study
from optsat.errors import InputError, nearest_name

_PACKAGE = "optsat.studies"


def list_studies() -> dict[str, str]:
    """Return the names of the studies, sorted, with the first line of each docstring; none is imported."""
    found = {}
    for folder in _folders():
        for module in pkgutil.iter_modules([folder]):
            if not module.name.startswith("_"):
                source = Path(folder, f"{module.name}.py").read_text(encoding="utf-8")
                found[module.name.replace("_", "-")] = (ast.get_docstring(ast.parse(source)) or "").partition("\n")[0]
    return dict(sorted(found.items()))


def load_study(name: str) -> Study:
    """Import and return the study `name`; hyphens and underscores are one.

    Raises
    ------
    InputError : no such study (the nearest name is offered), or its file does not define it.
    """
    wanted = name.replace("_", "-")
    known = list(list_studies())
    if wanted not in known:
        raise InputError(f"There is no study `{name}`.{nearest_name(wanted, known) if known else ''}")
    module = importlib.import_module(f"{_PACKAGE}.{wanted.replace('-', '_')}")
    study = getattr(module, "study", None)
    if not isinstance(study, Study) or study.name != wanted:
        raise InputError(f"{module.__name__} must define `study = Study(name={wanted!r}, ...)`.")
    return study


def _folders() -> list[str]:
    spec = importlib.util.find_spec(_PACKAGE)
    return list(spec.submodule_search_locations or ()) if spec is not None else []
