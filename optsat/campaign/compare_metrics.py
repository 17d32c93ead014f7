"""Compare metrics: how far a figure of a whole run would move with other cases, by drawing its cases again."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.effect import Effect
from optsat.campaign.finished_run import FinishedRun
from optsat.campaign.intervals import Interval, normal_interval, resampled_places
from optsat.campaign.study import Row, Study

_RESAMPLES = 400
_MOST_CASES = 2000
_EXTREME_SHARE = 0.3


def metric_effects(study: Study | None, a: FinishedRun, b: FinishedRun, paired: bool, key: int) -> list[Effect]:
    """Return an effect for each metric that both runs have and that differs.

    The interval is that of the normal distribution with the spread over 400 draws of the cases, pairs kept where
    paired. There is none for a metric that is an extreme of the cases, which drawing again cannot judge, and none
    where `study` is absent or no longer gives the metrics of both runs.
    """
    shared = [name for name in a.metrics if name in b.metrics and not _same(a.metrics[name], b.metrics[name])]
    if not shared:
        return []
    rows = _rows(a), _rows(b)
    if paired:
        both = {row["case"] for row in rows[0]} & {row["case"] for row in rows[1]}
        kept = [[row for row in each if row["case"] in both] for each in rows]
    else:
        kept = [list(each) for each in rows]
    why = _why_not(study, (a, b), rows, kept)
    drawn = ({}, {}) if why or study is None else _drawn(study, kept, paired, key)
    return [_effect(name, a, b, drawn, why, (len(rows[0]), len(rows[1]))) for name in shared]


def _effect(
    name: str,
    a: FinishedRun,
    b: FinishedRun,
    drawn: Sequence[Mapping[str, np.ndarray]],
    why: str,
    cases: tuple[int, int],
) -> Effect:
    first, second = a.metrics[name], b.metrics[name]
    interval: Interval | None = None
    by = why
    if not why:
        values = [each.get(name, np.array([math.nan])) for each in drawn]
        spread = values[1] - values[0]
        if not (np.all(np.isfinite(spread)) and math.isfinite(second - first)):
            by = "not finite for some draws of the cases"
        elif any(_is_extreme(value, figure) for value, figure in zip(values, (first, second), strict=True)):
            by = "an extreme of the cases"
        else:
            interval, by = normal_interval(second - first, float(np.std(spread, ddof=1))), "bootstrap, normal"
    return Effect("metric", name, first, second, *cases, interval, by)


def _is_extreme(values: np.ndarray, figure: float) -> bool:
    """Return whether draws give the figure itself too often for a smooth function of the cases, as a maximum does."""
    return bool(np.mean(values == figure) > _EXTREME_SHARE)


def _why_not(
    study: Study | None, runs: Sequence[FinishedRun], rows: Sequence[Sequence[Row]], kept: Sequence[Sequence[Row]]
) -> str:
    if study is None:
        return "the study is not here"
    if not all(kept):
        return "too few cases"
    if max(map(len, rows)) > _MOST_CASES:
        return f"more than {_MOST_CASES} cases"
    for run, own in zip(runs, rows, strict=True):
        again = study.metrics(own)
        if any(name not in again or not _same(again[name], value) for name, value in run.metrics.items()):
            return "the study of today gives other metrics"
    return ""


def _drawn(
    study: Study, rows: Sequence[Sequence[Row]], paired: bool, key: int
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the metrics of each draw of the cases, of both runs."""
    cells = np.arange(_RESAMPLES)
    places = [resampled_places(key, cells, len(own), 0 if paired else k) for k, own in enumerate(rows)]
    found: tuple[dict[str, list[float]], dict[str, list[float]]] = ({}, {})
    for own, chosen, figures in zip(rows, places, found, strict=True):
        for draw in chosen:
            for name, value in study.metrics([own[k] for k in draw]).items():
                figures.setdefault(name, []).append(float(value))
    # a metric that some draws do not have, as that of a group that was not drawn, has no spread
    first, second = ({n: np.array(v) for n, v in each.items() if len(v) == _RESAMPLES} for each in found)
    return first, second


def _rows(run: FinishedRun) -> list[Row]:
    columns = {**run.columns, **run.arrays()}
    lists = [column.tolist() if column.ndim == 1 else list(column) for column in columns.values()]
    return [dict(zip(columns, values, strict=True)) for values in zip(*lists, strict=True)]


def _same(one: float, other: float) -> bool:
    return one == other or (math.isnan(one) and math.isnan(other)) or math.isclose(one, other, rel_tol=1e-12)
