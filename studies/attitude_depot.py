"""Attitude problem depot: every plain solver and the certificate on 55 solvable problems and 16 inputs to be refused.

The depot is read from `depot/` in the folder that OPTSAT_DATA names (default ../shared/data). Grading as on the
depot's page:
right within the stated tolerance; digits lost up to 1e-6 rad; WRONG above that without an exception; refused.
"""

import functools
import json
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.status import AttitudeStatus
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.determine import WahbaMethod, certify_attitude, wahba
from optsat.errors import InputError, NotProvenError, OptsatError, UnsupportedFormError

METHODS: tuple[WahbaMethod, ...] = get_args(WahbaMethod)
PEERS = ("scipy",)
PROBLEMS = 71


@functools.cache
def _problems() -> tuple[dict[str, Any], ...]:
    folder = Path(os.environ.get("OPTSAT_DATA", "../shared/data")) / "depot"
    found: list[dict[str, Any]] = []
    for name in ("classical.json", "hard.json", "refused.json"):
        try:
            content = json.loads((folder / name).read_text(encoding="utf-8"))
        except OSError as error:
            raise OptsatError(f"The attitude problem depot is not at {folder}: {error}. Set OPTSAT_DATA.") from None
        found += content["problems"]
    return tuple(found)


def cases(count: int) -> list[Case]:
    """Return the first `count` problems by place."""
    if count > PROBLEMS:
        raise InputError(f"`cases` must be at most {PROBLEMS}, the number of problems, got {count}.")
    return [{"problem": k} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the grade of each method and of the certificate for one problem."""
    problem = _problems()[case["problem"]]
    refused = problem["expect"]["status"] == "REFUSED"
    row: dict[str, str | int] = {"name": problem["name"], "to_refuse": int(refused)}
    for method in METHODS:
        row[method] = _grade(problem, functools.partial(_ours, method))
    row["scipy"] = "not asked" if problem.get("lengths") == "raw" else _grade(problem, _scipy)
    if len(problem["b_B"]) == 1 and row["scipy"] == "WRONG":
        # one vector: SciPy documents that it returns the smallest rotation
        row["scipy"] = "documented"
    row["certificate_given"] = _grade_certificate(problem, given=True)
    row["certificate_best"] = _grade_certificate(problem, given=False)
    return row


_Answer = tuple[Array, AttitudeStatus]


def _ours(method: WahbaMethod, b_B: Any, r_N: Any, weights: Any) -> _Answer:
    answer = wahba(b_B, r_N, weights, method=method, norm_policy="silent").answer
    return answer.q_BN, answer.status


def _scipy(b_B: Any, r_N: Any, weights: Any) -> _Answer:
    import warnings

    from scipy.spatial.transform import Rotation

    b, r = np.asarray(b_B, dtype=float), np.asarray(r_N, dtype=float)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("error", UserWarning)
        lengths = np.linalg.norm(b, axis=-1, keepdims=True), np.linalg.norm(r, axis=-1, keepdims=True)
        rotation = Rotation.align_vectors(b / lengths[0], r / lengths[1], np.asarray(weights, dtype=float))[0]
    return rotation.inv().as_quat(canonical=True), AttitudeStatus.OK


def _numbers(problem: Mapping[str, Any], name: str) -> Any:
    try:
        return np.array(problem[name], dtype=np.float64)
    except ValueError:
        return problem[name]


def _grade(problem: Mapping[str, Any], solver: Callable[[Any, Any, Any], _Answer]) -> str:
    expect = problem["expect"]
    try:
        q_BN, status = solver(*(_numbers(problem, name) for name in ("b_B", "r_N", "weights")))
    except InputError as error:
        named = all(f"`{word}`" in str(error) for word in str(expect.get("argument_named", "")).split(", ") if word)
        return "refused" if named else "refused, argument not named"
    except (NotProvenError, UnsupportedFormError, ValueError, UserWarning, np.linalg.LinAlgError):
        return "refused"
    if expect["status"] == "REFUSED":
        return "bound only" if expect["argument_named"] == "angle_bound_rad" else "WRONG"
    if not np.all(np.isfinite(q_BN)):
        return "refused"
    if expect["status"] == "UNBOUNDED":
        projector = np.array(expect["optimal_set_projector"], dtype=np.float64)
        optimal = abs(1 - float(q_BN @ projector @ q_BN)) < 1e-12
        return "right" if optimal and status is AttitudeStatus.UNBOUNDED else "WRONG"
    angle = float(quaternion.error_angle(q_BN, np.array(expect["q_BN"], dtype=np.float64)))
    tolerance = expect["tolerance_rad"]
    return "right" if angle <= tolerance else "digits" if angle <= max(1e-6, 10 * tolerance) else "WRONG"


def _grade_certificate(problem: Mapping[str, Any], *, given: bool) -> str:
    expect = problem["expect"]
    b_B, r_N, bound, weights = (_numbers(problem, name) for name in ("b_B", "r_N", "angle_bound_rad", "weights"))
    try:
        attitude = certify_attitude(b_B, r_N, bound, weights=weights if given else None, norm_policy="silent")
    except InputError as error:
        words = str(expect.get("argument_named", "nothing")).split(", ")
        return "refused" if all(f"`{word}`" in str(error) for word in words) else "refused, argument not named"
    if expect["status"] == "REFUSED":
        return "weights only" if expect["argument_named"] == "weights" and not given else "WRONG"
    stated = expect["certificate"] if given else expect.get("certificate_best_weights")
    accepted = problem.get("accept_certificate_status", [stated["status"]] if stated else None)
    if not attitude.certificate.verify():
        return "WRONG"
    if given and problem.get("accept_certificate_status") == ["INCONSISTENT"]:
        accepted = ["INCONSISTENT", stated["status"]]
    if accepted is not None and attitude.status.name not in accepted:
        return "WRONG"
    if attitude.status is not AttitudeStatus.OK or stated is None or stated["status"] != "OK":
        return "right"
    exact = float(stated["radius_rad"])
    if attitude.bound_rad < exact * (1 - 1e-9):
        return "WRONG"
    return "right" if attitude.bound_rad <= 1.01 * exact + 1e-6 else "loose"


_COLUMNS = (*METHODS, *PEERS, "certificate_given", "certificate_best")


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return how often each column got which grade, solvable problems and inputs to refuse apart."""
    figures: dict[str, float] = {}
    for column in _COLUMNS:
        solvable = [row[column] for row in rows if not row["to_refuse"]]
        bad = [row[column] for row in rows if row["to_refuse"]]
        for grade in ("right", "digits", "loose", "refused", "documented", "not asked", "WRONG"):
            count = solvable.count(grade)
            if count or grade in ("right", "WRONG"):
                figures[f"{column}_{grade.replace(' ', '_')}"] = float(count)
        figures[f"{column}_bad_input_refused"] = float(bad.count("refused"))
        figures[f"{column}_bad_input_answered"] = float(bad.count("WRONG"))
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bar: nothing silently wrong, in any solver of ours or in the certificate."""
    ours = [column for column in _COLUMNS if column not in PEERS]
    wrong = sum(figures[f"{column}_WRONG"] + figures[f"{column}_bad_input_answered"] for column in ours)
    loose = sum(figures.get(f"{column}_loose", 0.0) + figures.get(f"{column}_digits", 0.0) for column in ours)
    return [
        judge_bar("silent-wrong-answers", "answers that are wrong without a word", measured=wrong, holds=wrong == 0),
        judge_bar("digits", "answers or radii that are right with digits lost", measured=loose, holds=loose == 0),
        judge_bar(
            "davenport-complete",
            "solvable problems that the default solver gets right, of 55",
            measured=figures["davenport_right"],
            holds=figures["davenport_right"] == 55,
        ),
    ]


study = Study(
    name="attitude-depot",
    title="Attitude problem depot: right, refused or wrong, every solver and the certificate",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=PROBLEMS,
)
