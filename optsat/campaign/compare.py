"""Compare: two runs of one study, first as bytes, then case by case, then by the figures that can be told apart."""

import dataclasses
import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from optsat.arrays import Array
from optsat.campaign.compare_metrics import metric_effects
from optsat.campaign.effect import Effect
from optsat.campaign.finished_run import FinishedRun
from optsat.campaign.intervals import (
    RESAMPLES,
    accelerated_interval,
    holm,
    normal_interval,
    paired_t,
    percentile_interval,
    resampled_differences,
    welch_t,
)
from optsat.campaign.rates import paired_rates, unpaired_rates
from optsat.campaign.study import Study
from optsat.errors import InputError

Columns = Mapping[str, NDArray[Any]]

_FEW, _MANY = 200, 20_000
_FEW_RESAMPLES = 200
_MOST_WORDS = 8
_QUANTILES = {"median": 0.5, "95 % quantile": 0.95}


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side.

    changed : fields of the identity that differ, (A, B); same_bits : by file that both have
    same_content : every value of every case is the same, to the bit
    mixed : which of "A" and "B" were computed by machines whose arithmetic differs in the last bits
    same_arithmetic : both were computed with the same last bits
    pairing : empty where cases are paired, else why they are not
    identical : columns with the same value in every case; missing : columns that only one run has
    arrays : largest absolute difference by array column, paired runs only
    """

    changed: Mapping[str, tuple[Any, Any]]
    same_bits: Mapping[str, bool]
    same_content: bool
    mixed: tuple[str, ...]
    same_arithmetic: bool
    pairing: str
    identical: tuple[str, ...]
    missing: tuple[str, ...]
    arrays: Mapping[str, float]
    effects: tuple[Effect, ...]


def compare_runs(a: FinishedRun, b: FinishedRun, study: Study | None = None) -> Comparison:
    """Return the comparison of two complete runs.

    Cases are paired where study, seed and number of cases agree. Means: Student's t below 200 cases and above 20,000,
    between them the bias-corrected and accelerated bootstrap; quantiles: the bootstrap; rates: Newcombe.

    study : gives metrics their intervals

    Raises
    ------
    InputError : runs of different studies.
    Source: campaign specification, section 9.
    """
    if a.identity.study != b.identity.study:
        raise InputError(f"{a.path} is a run of {a.identity.study}, {b.path} of {b.identity.study}. Compare equals.")
    first, second = dataclasses.asdict(a.identity), dataclasses.asdict(b.identity)
    changed = {name: (first[name], second[name]) for name in first if first[name] != second[name]}
    unequal = [name for name in ("seed", "cases") if name in changed]
    pairing = f"{' and '.join(unequal)} differ{'s' if unequal == ['seed'] else ''}" if unequal else ""
    shared = [name for name in a.columns if name in b.columns and name != "case"]
    left, right = _aligned(a.columns, b.columns) if not pairing else (a.columns, b.columns)
    identical = tuple(
        name
        for name in shared
        if np.array_equal(left[name], right[name], equal_nan=_is_float(left[name]) and _is_float(right[name]))
    )
    key = int.from_bytes(
        hashlib.blake2b(f"{a.identity.run} {b.identity.run}".encode(), digest_size=8).digest(), "little"
    )
    effects = [*metric_effects(study, a, b, not pairing, key), *_failures(a, b, not pairing)]
    for place, name in enumerate(shared):
        if name not in identical:
            effects += _column_effects(name, left[name], right[name], not pairing, key, place + 1)
    return Comparison(
        changed,
        {name: a.digests[name] == b.digests[name] for name in a.digests if name in b.digests},
        a.content == b.content,
        tuple(name for name, run in (("A", a), ("B", b)) if len(run.numerics) > 1),
        set(a.numerics) == set(b.numerics),
        pairing,
        identical,
        tuple(sorted((a.columns.keys() ^ b.columns.keys()) - {"case"})),
        _array_differences(a, b) if not pairing else {},
        _adjusted(effects),
    )


def _aligned(first: Columns, second: Columns) -> tuple[Columns, Columns]:
    """Return both restricted to the cases that ran in both."""
    _, here, there = np.intersect1d(first["case"], second["case"], assume_unique=True, return_indices=True)
    return {n: column[here] for n, column in first.items()}, {n: column[there] for n, column in second.items()}


def _is_float(column: NDArray[Any]) -> bool:
    return column.dtype.kind == "f"


def _adjusted(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    judged = [k for k, effect in enumerate(effects) if effect.interval is not None]
    adjusted: dict[int, float] = dict(zip(judged, holm([_p(effects[k]) for k in judged]), strict=True))
    return tuple(dataclasses.replace(effect, adjusted_p=adjusted.get(k)) for k, effect in enumerate(effects))


def _p(effect: Effect) -> float:
    assert effect.interval is not None
    return effect.interval.p


def _failures(a: FinishedRun, b: FinishedRun, paired: bool) -> Iterator[Effect]:
    if a.failures or b.failures:
        failed = [np.zeros(run.identity.cases, dtype=bool) for run in (a, b)]
        for column, run in zip(failed, (a, b), strict=True):
            column[[failure.case for failure in run.failures]] = True
        yield _rate("cases that failed", failed[0], failed[1], paired)


def _column_effects(
    name: str, first: NDArray[Any], second: NDArray[Any], paired: bool, key: int, place: int
) -> Iterator[Effect]:
    kinds = {column.dtype.kind for column in (first, second)}
    if kinds <= {"b"} or (kinds <= {"b", "i"} and {*np.unique(first), *np.unique(second)} <= {0, 1}):
        yield _rate(name, first.astype(bool), second.astype(bool), paired)
    elif kinds <= {"i", "f", "b"}:
        yield from _numbers(name, first.astype(np.float64), second.astype(np.float64), paired, key, place)
    else:
        words, counts = np.unique(np.concatenate((first.astype(str), second.astype(str))), return_counts=True)
        for word in sorted(words[np.argsort(-counts, kind="stable")][:_MOST_WORDS]):
            yield _rate(f"{name} = {word}", first.astype(str) == word, second.astype(str) == word, paired)


def _rate(name: str, first: NDArray[np.bool_], second: NDArray[np.bool_], paired: bool) -> Effect:
    counts = int(first.sum()), int(second.sum())
    if not (len(first) and len(second)):
        return Effect("rate", name, float("nan"), float("nan"), len(first), len(second), None, "no case")
    if paired:
        both, neither = int(np.sum(first & second)), int(np.sum(~first & ~second))
        interval = paired_rates(both, counts[0] - both, counts[1] - both, neither)
    else:
        interval = unpaired_rates(counts[0], len(first), counts[1], len(second))
    rates = counts[0] / len(first), counts[1] / len(second)
    by = "Newcombe, McNemar" if paired else "Newcombe, Fisher"
    return Effect("rate", name, *rates, len(first), len(second), interval, by)


def _numbers(name: str, first: Array, second: Array, paired: bool, key: int, place: int) -> Iterator[Effect]:
    """Yield the effects on mean and quantiles, over what is finite."""
    if paired:
        finite = np.isfinite(first) & np.isfinite(second)
        first, second = first[finite], second[finite]
    else:
        first, second = first[np.isfinite(first)], second[np.isfinite(second)]
    least, most = min(len(first), len(second)), max(len(first), len(second))
    sizes = len(first), len(second)
    if least < 2:
        lone = [float(np.mean(x)) if len(x) else float("nan") for x in (first, second)]
        yield Effect("mean", name, lone[0], lone[1], *sizes, None, "too few cases")
        return
    resampled = resampled_differences(
        first, second, paired, _statistics, key, place, RESAMPLES if most <= _MANY else _FEW_RESAMPLES
    )
    a, b = _statistics(first[None])[0], _statistics(second[None])[0]
    if least >= _FEW and most <= _MANY:
        influence = second - first - (b[0] - a[0]) if paired else _influence(first, second)
        mean, by = accelerated_interval(float(b[0] - a[0]), resampled[:, 0], influence), "bootstrap, BCa"
    else:
        mean, by = (paired_t if paired else welch_t)(first, second), "Student's t" if paired else "Welch's t"
    yield Effect("mean", name, float(a[0]), float(b[0]), *sizes, mean, by)
    for k, what in enumerate(_QUANTILES, 1):
        difference = float(b[k] - a[k])
        if most <= _MANY:
            interval, by = percentile_interval(difference, resampled[:, k]), "bootstrap, percentiles"
        else:
            interval, by = normal_interval(difference, float(np.std(resampled[:, k], ddof=1))), "bootstrap, normal"
        yield Effect(what, name, float(a[k]), float(b[k]), *sizes, interval, by)


def _influence(first: Array, second: Array) -> Array:
    """Return the influence of each observation on the difference of the means of two samples."""
    return np.concatenate(((np.mean(first) - first) / len(first), (second - np.mean(second)) / len(second)))


def _statistics(samples: Array) -> Array:
    """Return mean and quantiles (k, 3) of samples (k, n), one a row."""
    return np.column_stack((np.mean(samples, axis=1), np.quantile(samples, list(_QUANTILES.values()), axis=1).T))


def _array_differences(a: FinishedRun, b: FinishedRun) -> dict[str, float]:
    first, second = a.arrays(), b.arrays()
    _, here, there = np.intersect1d(a.columns["case"], b.columns["case"], assume_unique=True, return_indices=True)
    found = {}
    for name, values in first.items():
        if name in second and second[name].shape[1:] == values.shape[1:]:
            x, y = values[here].astype(np.float64), second[name][there].astype(np.float64)
            same = (x == y) | (np.isnan(x) & np.isnan(y))
            found[name] = float(np.max(np.abs(x - y), where=~same, initial=0.0))
    return found
