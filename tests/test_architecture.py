"""The arrows of the architecture, asserted from the imports: data flows one way."""

import ast
import graphlib
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MAPPED = ("problems", "solvers", "studies")
LONGEST = 400

# the public verbs pick problems and solvers for their callers
VERBS = {"attain", "attain_runs", "determine", "pareto", "robust"}
# what knows everything: the public names and verbs, the command line, the studies
TOP = {"__init__", *VERBS, "cli", "commands", "doctor", "studies"}

# slow to import, so only inside functions
HEAVY = ("casadi", "clarabel", "cvxpy", "matplotlib", "pymoo", "scipy.optimize", "typer")
EAGER_ALLOWED = {("cli", "typer"), ("commands", "typer")}


@dataclass(frozen=True)
class Import:
    """One imported name: by which module, which dotted name, on which line, and when."""

    module: str
    target: str
    line: int
    lazy: bool
    typing_only: bool

    @property
    def unit(self) -> str:
        return unit_of(self.module)

    @property
    def target_unit(self) -> str | None:
        return unit_of(self.target) if self.target.partition(".")[0] == "optsat" else None

    def __str__(self) -> str:
        return f"{self.module}, line {self.line}, imports {self.target}"


Tree = Mapping[str, str]
Rule = Callable[[Tree], list[str]]


def unit_of(name: str) -> str:
    """The sub-package or top-level module of a dotted name of optsat."""
    return name.split(".")[1] if "." in name else "__init__"


def read_tree() -> Tree:
    """The source of every module by its dotted name; the three links are read where they lead."""
    folders = {"optsat": ROOT / "optsat"} | {f"optsat.{name}": ROOT / name for name in MAPPED}
    tree = {}
    for package, folder in folders.items():
        for path in sorted(folder.rglob("*.py")):
            if not any(parent.is_symlink() for parent in path.parents if parent.is_relative_to(folder)):
                parts = [package, *path.relative_to(folder).with_suffix("").parts]
                tree[".".join(parts).removesuffix(".__init__")] = path.read_text(encoding="utf-8")
    return tree


def imports(tree: Tree) -> Iterator[Import]:
    for module, source in tree.items():
        yield from _imports_below(module, ast.parse(source), lazy=False, typing_only=False)


def _imports_below(module: str, node: ast.AST, lazy: bool, typing_only: bool) -> Iterator[Import]:
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            for alias in child.names:
                yield Import(module, alias.name, child.lineno, lazy, typing_only)
        elif isinstance(child, ast.ImportFrom):
            for alias in child.names:
                source = "." * child.level + (child.module or "")
                yield Import(module, f"{source}.{alias.name}", child.lineno, lazy, typing_only)
        else:
            yield from _imports_below(
                module,
                child,
                lazy or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda),
                typing_only or (isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING")),
            )


def never(units: set[str], forbidden: set[str]) -> Rule:
    """A rule: modules of `units` import nothing of `forbidden`."""
    return lambda tree: [str(i) for i in imports(tree) if i.unit in units and i.target_unit in forbidden]


def only(unit: str, allowed: set[str]) -> Rule:
    """A rule: of optsat, modules of `unit` import nothing but `allowed` and each other."""
    return lambda tree: [
        str(i) for i in imports(tree) if i.unit == unit and i.target_unit not in {None, unit, *allowed}
    ]


def is_sanctioned(found: Import) -> bool:
    """The one upward edge: `solve` looks up the solver table when no solver was given."""
    return found.module == "optsat.solve" and found.target_unit == "solvers" and found.lazy


def core_knows_no_problem_and_no_solver(tree: Tree) -> list[str]:
    # an estimator may pose a problem and call `solve` or a verb; it never picks a solver
    return [
        str(found)
        for found in imports(tree)
        if found.unit not in {*TOP, "problems", "solvers"}
        and found.target_unit in ({"solvers"} if found.unit == "estimators" else {"problems", "solvers"})
        and not is_sanctioned(found)
    ]


def only_the_top_knows_the_top(tree: Tree) -> list[str]:
    units = {unit_of(module) for module in tree}
    return [
        str(found)
        for found in imports(tree)
        if found.unit not in TOP
        and found.target_unit is not None
        and (found.target_unit in TOP or found.target_unit not in units)
        and not (found.unit == "estimators" and found.target_unit in VERBS)
    ]


def no_relative_imports(tree: Tree) -> list[str]:
    return [str(found) for found in imports(tree) if found.target.startswith(".")]


def heavy_imports_are_lazy(tree: Tree) -> list[str]:
    return [
        str(found)
        for found in imports(tree)
        for heavy in HEAVY
        if f"{found.target}.".startswith(f"{heavy}.")
        and not (found.lazy or found.typing_only or (found.unit, heavy) in EAGER_ALLOWED)
    ]


def no_cycles_among_packages(tree: Tree) -> list[str]:
    graph: dict[str, set[str]] = {}
    for found in imports(tree):
        target = found.target_unit
        if target not in {None, found.unit} and not found.typing_only and not is_sanctioned(found):
            graph.setdefault(found.unit, set()).add(str(target))
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        # the sorter lists a cycle from the imported to the importer
        return [" imports ".join(reversed(error.args[1]))]
    return []


def no_long_files(tree: Tree) -> list[str]:
    return [
        f"{module} has {len(lines)} lines; a file is one idea"
        for module, source in tree.items()
        if len(lines := source.splitlines()) > LONGEST
    ]


# rule, and for each a module that breaks it: a checker that finds nothing anywhere proves nothing
RULES: dict[str, tuple[Rule, Tree]] = {
    "the core knows no problem and no solver by name": (
        core_knows_no_problem_and_no_solver,
        {"optsat.solution": "def f():\n    from optsat.solvers import SOLVERS"},
    ),
    "solve() looks up the solver table inside a function": (
        core_knows_no_problem_and_no_solver,
        {"optsat.solve": "from optsat.solvers import SOLVERS"},
    ),
    "problems never import solvers": (
        never({"problems"}, {"solvers"}),
        {"optsat.problems.wahba": "from optsat import solvers"},
    ),
    "solvers never import problems, certificates or estimators": (
        never({"solvers"}, {"problems", "certificates", "estimators"}),
        {"optsat.solvers.svd": "if TYPE_CHECKING:\n    import optsat.certificates.attitude_bound"},
    ),
    "certificates import no solver and no problem": (
        never({"certificates"}, {"problems", "solvers"}),
        {"optsat.certificates.interval": "from optsat.solvers.clarabel import Clarabel"},
    ),
    "records import no problem and no solver": (
        never({"records"}, {"problems", "solvers"}),
        {"optsat.records.csv_log": "class A:\n    from optsat.problems.wahba import Wahba"},
    ),
    "models import only attitude, symbolic, port, arrays, errors and units": (
        only("models", {"attitude", "symbolic", "port", "arrays", "errors", "units"}),
        {"optsat.models.sun": "from optsat.forms import Point"},
    ),
    "simulation imports only models, symbolic, port, attitude, records, arrays, errors and units": (
        only("simulation", {"models", "symbolic", "port", "attitude", "records", "arrays", "errors", "units"}),
        {"optsat.simulation.orbit_scenario": "from optsat.determine import certify_attitude"},
    ),
    "plots import only estimators, records, arrays and errors": (
        only("plots", {"estimators", "records", "arrays", "errors"}),
        {"optsat.plots.bound_figure": "from optsat.files import write_atomically"},
    ),
    "report imports only campaign, plots, arrays and errors": (
        only("report", {"campaign", "plots", "arrays", "errors"}),
        {"optsat.report.html_report": "from optsat.records.record import Record"},
    ),
    "view imports only report, estimators, records, attitude, arrays and errors": (
        only("view", {"report", "estimators", "records", "attitude", "arrays", "errors"}),
        {"optsat.view.scene": "from optsat.determine import certify_attitude"},
    ),
    "attitude imports only arrays and errors": (
        only("attitude", {"arrays", "errors"}),
        {"optsat.attitude.dcm": "from optsat.port import Port"},
    ),
    "only the public face, the command line and studies know everything": (
        only_the_top_knows_the_top,
        {"optsat.models.orbit": "from optsat.commands.output import note"},
    ),
    "modules are imported from where they are, not from the public face": (
        only_the_top_knows_the_top,
        {"optsat.models.orbit": "import optsat"},
    ),
    "imports are absolute": (no_relative_imports, {"optsat.forms": "from . import arrays"}),
    "slow libraries are imported inside functions": (
        heavy_imports_are_lazy,
        {"optsat.models.orbit": "try:\n    from scipy import optimize\nexcept ImportError:\n    pass"},
    ),
    "no cycles among packages": (
        no_cycles_among_packages,
        {
            "optsat.arrays": "def f():\n    from optsat.units import to_si",
            "optsat.units": "import optsat.errors\nfrom optsat.arrays import Array",
        },
    ),
    f"no file has more than {LONGEST} lines": (no_long_files, {"optsat.forms": "\n" * (LONGEST + 1)}),
}


@pytest.fixture(scope="module")
def tree() -> Tree:
    return read_tree()


@pytest.mark.parametrize("name", RULES)
def test_rule(name: str, tree: Tree) -> None:
    found = RULES[name][0](tree)
    assert not found, f"{name}, but:\n" + "\n".join(found)


@pytest.mark.parametrize("name", RULES)
def test_a_planted_violation_is_found(name: str) -> None:
    rule, planted = RULES[name]
    (found,) = rule(planted)
    assert any(module.removeprefix("optsat.") in found for module in planted)


def test_what_is_allowed_is_not_reported() -> None:
    allowed = {
        "optsat.solve": "def solve():\n    from optsat.solvers import SOLVERS",
        "optsat.solvers": "",
        "optsat.certificates.interval": "from optsat.attitude.davenport import turn",
        "optsat.attitude.davenport": "import numpy",
        "optsat.solution": "if TYPE_CHECKING:\n    from optsat.certificates.interval import Interval",
        "optsat.estimators.kalman": "from optsat.problems.wahba import Wahba",
        "optsat.problems.wahba": "def f():\n    import casadi",
        "optsat.studies.table": "import optsat\nfrom optsat.solvers import SOLVERS",
        "optsat.commands.study": "import typer",
    }
    assert {name: found for name, (rule, _) in RULES.items() if (found := rule(allowed))} == {}


def test_every_folder_of_modules_was_read(tree: Tree) -> None:
    assert {"errors", "attitude", "campaign", *MAPPED} <= {unit_of(module) for module in tree}


def _loaded_after(modules: list[str]) -> set[str]:
    program = "import importlib, sys\nfor name in sys.argv[1:]: importlib.import_module(name)\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", program, *modules], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_importing_optsat_is_light() -> None:
    loaded = _loaded_after(["optsat"])
    assert not loaded & {*HEAVY, "scipy", "pydantic", "pint", "rich"}


def test_importing_every_module_loads_nothing_heavy(tree: Tree) -> None:
    modules = [module for module in tree if unit_of(module) not in {"cli", "commands"}]
    assert not _loaded_after(modules) & set(HEAVY)
