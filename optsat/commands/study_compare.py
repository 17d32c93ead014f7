"""`optsat study compare`: two runs of one study side by side, with what chance explains and what it does not."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from optsat.commands.output import AsJson, aligned, print_json
from optsat.errors import InputError

if TYPE_CHECKING:
    from optsat.campaign.compare import Comparison
    from optsat.campaign.effect import Effect
    from optsat.campaign.finished_run import FinishedRun


_NAMES = {"metric": "metric {1}", "rate": "rate of {1}"}


def compare_command(
    a: Annotated[Path, typer.Argument(metavar="A", help="Folder of a complete run.", show_default=False)],
    b: Annotated[Path, typer.Argument(metavar="B", help="Folder of another of the same study.", show_default=False)],
    check: Annotated[bool, typer.Option("--check", help="Exit code 1 where a difference is not chance.")] = False,
    as_json: AsJson = False,
) -> None:
    """Compare two runs: the same bits or not, then differences B - A with 95 % intervals and adjusted p values."""
    from optsat.campaign.catalogue import load_study
    from optsat.campaign.compare import compare_runs
    from optsat.campaign.finished_run import read_run

    runs = read_run(a), read_run(b)
    try:
        study = load_study(runs[0].identity.study)
    except InputError:
        study = None
    found = compare_runs(*runs, study)
    if as_json:
        print_json(_document(runs, found))
    else:
        typer.echo("\n".join(_words(runs, found)))
    if check and any(effect.significant for effect in found.effects):
        raise typer.Exit(1)


def _document(runs: "tuple[FinishedRun, FinishedRun]", found: "Comparison") -> dict[str, Any]:
    return {
        "a": str(runs[0].path),
        "b": str(runs[1].path),
        "study": runs[0].identity.study,
        "same_bits": dict(found.same_bits),
        "same_content": found.same_content,
        "mixed_machines": list(found.mixed),
        "same_arithmetic": found.same_arithmetic,
        "identity": {name: list(values) for name, values in found.changed.items()},
        "paired": not found.pairing,
        "identical_columns": list(found.identical),
        "columns_of_one_run": list(found.missing),
        "largest_array_difference": {name: _finite(value) for name, value in found.arrays.items()},
        "effects": [_effect(effect) for effect in found.effects],
    }


def _effect(effect: "Effect") -> dict[str, Any]:
    interval = effect.interval
    return {
        "what": effect.what,
        "of": effect.of,
        "a": _finite(effect.a),
        "b": _finite(effect.b),
        "cases": [effect.cases_a, effect.cases_b],
        "difference": None if interval is None else _finite(interval.difference),
        "interval": None if interval is None else [_finite(interval.low), _finite(interval.high)],
        "p": None if interval is None else interval.p,
        "adjusted_p": effect.adjusted_p,
        "significant": effect.significant,
        "by": effect.by,
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _words(runs: "tuple[FinishedRun, FinishedRun]", found: "Comparison") -> "list[str]":
    lines = [
        aligned(
            [
                (
                    name,
                    str(run.path),
                    f"{i.study} version {i.version}, {i.cases} cases, seed {i.seed}, optsat {i.optsat}",
                )
                for name, run in zip("AB", runs, strict=True)
                for i in (run.identity,)
            ]
        )
    ]
    lines += [
        f"Mixed machines computed {name}: its last bits are not those of any one machine." for name in found.mixed
    ]
    if all(found.same_bits.values()):
        return [*lines, f"The same bits: {', '.join(found.same_bits)}. There is nothing to compare."]
    if found.same_content:
        lines.append("The same values to the bit in every case; only the files were written by other versions.")
    elif not found.same_arithmetic and not found.mixed:
        lines.append("A and B were computed with other last bits (processor, libraries or threads): compare figures.")
    different = [name for name, same in found.same_bits.items() if not same]
    lines.append(f"Not the same bits: {', '.join(different)} differ{'s' if len(different) == 1 else ''}.")
    lines += [f"  {name}: {one} -> {other}" for name, (one, other) in found.changed.items()]
    lines.append(
        f"Cases are not paired: {found.pairing}." if found.pairing else "Cases are paired: the same case in both runs."
    )
    if found.identical:
        lines.append(f"The same in every case: {', '.join(found.identical)}.")
    if found.missing:
        lines.append(f"In one run only: {', '.join(found.missing)}.")
    lines += [f"Largest difference in {name}: {_figure(value)}." for name, value in found.arrays.items()]
    return [*lines, *_effects_in_words(found)]


def _effects_in_words(found: "Comparison") -> "list[str]":
    if not found.effects:
        return []
    head = ("What differs", "A", "B", "B - A", "95 % interval", "adjusted p", "found")
    rows = [(f"  {_NAMES.get(e.what, '{} of {}').format(e.what, e.of)}", *_figures(e)) for e in found.effects]
    judged = [effect for effect in found.effects if effect.interval is not None]
    count = sum(effect.significant for effect in judged)
    of = f"{count} of {len(judged)} differences {'is' if count == 1 else 'are'} more than chance (adjusted p < 0.05)."
    return ["", aligned([head, *rows]), "", of, *_rates_of_none(found)]


def _figures(effect: "Effect") -> tuple[str, ...]:
    a, b = _figure(effect.a), _figure(effect.b)
    if effect.interval is None:
        return a, b, _figure(effect.b - effect.a), "", "", f"not judged: {effect.by}"
    interval = effect.interval
    p = effect.adjusted_p or 0.0
    says = "no difference found"
    if effect.significant:
        says = "B is larger" if interval.difference > 0 else "B is smaller"
    shown = "< 0.001" if p < 0.001 else f"{p:.3f}"
    between = f"{_figure(interval.low)} to {_figure(interval.high)}"
    return a, b, _figure(interval.difference), between, shown, f"{says} ({effect.by})"


def _rates_of_none(found: "Comparison") -> "list[str]":
    """Say what none in n means."""
    from optsat.campaign.rates import largest_rate_of_none

    lines = []
    for effect in found.effects:
        for name, rate, cases in (("A", effect.a, effect.cases_a), ("B", effect.b, effect.cases_b)):
            if effect.what == "rate" and rate == 0 and cases:
                lines.append(f"{effect.of}, {name}: none in {cases} cases, so below {largest_rate_of_none(cases):.2g}.")
    return lines


def _figure(value: float) -> str:
    return f"{value:.5g}" if math.isfinite(value) else "not finite"
