"""Study: the frozen declaration of one table, figure or comparison."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optsat.campaign.claim import Claim
from optsat.campaign.designs import Case, Columns, Design
from optsat.campaign.draws import Draws
from optsat.errors import InputError

__all__ = ["Case", "Columns", "Row", "Scalar", "Study"]

Scalar = float | int | str | bool
# scalars only, which the runner checks; typed loosely so that `np.mean([row[name] for row in rows])` needs no cast
Row = Mapping[str, Any]


@dataclass(frozen=True)
class Study:
    """One file of `optsat.studies` defines `study = Study(...)` under the file's own name.

    name : words joined by hyphens; the file is the same with underscores
    title : one line for people
    cases : a design, or number of cases -> parameters of each case, fixed by its place alone
    run : (case, its own generator) -> scalars, the same names for every case
    run_batch : (parameters by name, draws of their cells) -> columns, where many cases are computed at once, as by a
        compiled kernel; the first case of every chunk is also run by `run` and must agree to the last bit
    metrics : rows of the cases that succeeded, in case order, each with its number under "case" -> figures
    claims : metrics -> judged claims
    default_cases : number of cases when none is asked for
    figure : (rows, path to write) -> None, where the study draws one
    version : raised whenever the same seed gives other rows
    paper : whose printed figures it judges; `optsat reproduce` runs these. Empty for bars of our own, and where times
        are judged, which depend on the load of the machine
    """

    name: str
    title: str
    cases: Callable[[int], Sequence[Case]] | Design
    run: Callable[[Case, np.random.Generator], Row]
    metrics: Callable[[Sequence[Row]], Mapping[str, float]]
    claims: Callable[[Mapping[str, float]], Sequence[Claim]]
    default_cases: int
    figure: Callable[[Sequence[Row], Path], None] | None = None
    version: int = 1
    paper: str = ""
    run_batch: Callable[[Columns, Draws], Columns] | None = None

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9]*(-[a-z0-9]+)*", self.name):
            raise InputError(f"`name` of a study must be lower-case words joined by hyphens, got {self.name!r}.")
        if self.default_cases < 1:
            raise InputError(f"`default_cases` of {self.name} must be at least 1, got {self.default_cases}.")
