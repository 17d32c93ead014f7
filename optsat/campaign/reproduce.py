"""Reproduce: studies one after the other, each in a folder of its own, whatever becomes of the others."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from optsat.campaign.catalogue import load_study
from optsat.campaign.claim import Verdict
from optsat.campaign.finished_run import FinishedRun, read_run
from optsat.campaign.run_folder import COMPLETE
from optsat.campaign.runner import Progress, run_study
from optsat.errors import InputError

Bar = Callable[[str], AbstractContextManager[Progress]]


@dataclass(frozen=True)
class Reproduction:
    """What became of one study: its run, or why there is none; paper : whose figures it judges, if any."""

    study: str
    title: str
    paper: str
    run: FinishedRun | None
    error: str = ""

    @property
    def passed(self) -> bool:
        """Whether every claim has a verdict and no bar of our own fails."""
        claims = self.run.claims if self.run is not None else ()
        return bool(claims) and all(claim.verdict is not Verdict.FAILS for claim in claims)


def reproduce(
    names: Sequence[str], everything: bool, out: Path, most_cases: int | None, workers: int, resume: bool, bar: Bar
) -> Iterator[Reproduction]:
    """Yield what became of each study that judges figures of a paper, as it is finished; of all where `everything`.

    A study that cannot be loaded, or fails, is yielded with the reason. One that is complete in its folder is read.

    most_cases : of each study, its own number where absent; resume : go on with unfinished runs
    bar : a study's name to what draws its progress

    Raises
    ------
    InputError : an unfinished run in `out`, and `resume` not given.
    """
    unfinished = [n for n in names if (out / n / "run.json").exists() and not (out / n / COMPLETE).exists()]
    if unfinished and not resume:
        raise InputError(f"{out} holds unfinished runs: {', '.join(unfinished)}. Add --resume to go on with them.")
    for name in names:
        try:
            study = load_study(name)
        except Exception as error:
            yield Reproduction(name, name, "", None, f"{type(error).__name__}: {error}")
            continue
        if not (study.paper or everything):
            continue
        cases = study.default_cases if most_cases is None else min(most_cases, study.default_cases)
        try:
            with bar(name) as progress:
                run_study(study, cases, 0, workers, progress, out / name, resume)
            yield Reproduction(name, study.title, study.paper, read_run(out / name))
        except Exception as error:
            yield Reproduction(name, study.title, study.paper, None, f"{type(error).__name__}: {error}")
