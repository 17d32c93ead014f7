"""Worst-case Wahba over component boxes: is the programme exact, what does it gain, and what does it cost in accuracy.

Two to five random directions, boxes up to 2, 10 or 20 % of the unit length to either side, measured directions uniform
in their boxes about the truth. Body boxes by themselves, then body and reference boxes. The attitude error is judged
against the plain q-method of the middles: the worst case is what the method lowers, the error is not.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from optsat.arrays import Array
from optsat.attitude import quaternion
from optsat.attitude.davenport import rotation_matrix
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.determine import wahba, worst_case_wahba
from optsat.models.draws import directions, rotations
from optsat.plots.svg_file import write_svg
from optsat.problems.component_box import ComponentBox
from optsat.solution import Proof

SIZES = (0.02, 0.1, 0.2)


def cases(count: int) -> list[Case]:
    """Return draws of 2 to 5 vectors, the sizes of the boxes in turn."""
    return [{"vectors": 2 + k % 4, "size": SIZES[k % 3]} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return what is proven, gained and lost on one draw, for body boxes and for both."""
    m, size = case["vectors"], case["size"]
    truth = rotations(rng, 1)[0]
    r_N = directions(rng, m)
    b_half, r_half = size * rng.uniform(0, 1, (2, m, 3))
    b_mid = _unit(r_N @ rotation_matrix(truth).T + b_half * rng.uniform(-1, 1, (m, 3)))
    r_mid = _unit(r_N + r_half * rng.uniform(-1, 1, (m, 3)))
    body = ComponentBox.from_half_width(b_mid, b_half)
    return {
        "size": size,
        **_judged("body", body, r_N, b_mid, r_N, truth),
        **_judged("both", body, ComponentBox.from_half_width(r_mid, r_half), b_mid, r_mid, truth),
    }


def _judged(name: str, b_B: ComponentBox, r_N: ComponentBox | Array, b_mid: Array, r_mid: Array, truth: Array) -> Row:
    solution = worst_case_wahba(b_B, r_N)
    answer, plain = solution.answer, wahba(b_mid, r_mid).answer
    corners = answer.certificate.corners
    sampled = min(corners.worst_case_loss(q_BN) for q_BN in _around(answer.q_BN))
    return {
        f"{name}_rank_ratio": answer.rank_ratio,
        f"{name}_gap": solution.residuals["gap"],
        f"{name}_loss": answer.worst_case_loss,
        f"{name}_over_q_method": answer.worst_case_loss / corners.worst_case_loss(plain.q_BN),
        f"{name}_excess_over_q_method": answer.worst_case_loss - corners.worst_case_loss(plain.q_BN),
        f"{name}_proven": int(solution.proof is Proof.GLOBAL),
        f"{name}_verified": int(bool(answer.certificate.verify())),
        f"{name}_undercut": int(sampled < answer.lower_bound),
        f"{name}_error_deg": float(np.degrees(quaternion.error_angle(answer.q_BN, truth))),
        f"{name}_q_error_deg": float(np.degrees(quaternion.error_angle(plain.q_BN, truth))),
    }


def _around(q_BN: Array) -> Array:
    """Return attitudes on a fixed grid about q_BN, near and far: what might undercut a bound that is not one."""
    axes = np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) != (0, 0, 0)])
    turns = np.concatenate([size * axes for size in (1e-5, 1e-3, 1e-2, 0.1, 1.0)])
    return np.asarray(quaternion.compose(quaternion.exponential(turns), q_BN))


def _unit(v: Array) -> Array:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return, for body boxes and for both, how often the programme was exact, and gains and losses."""
    figures: dict[str, float] = {}
    for name in ("body", "both"):
        exact = [row[f"{name}_rank_ratio"] < 1e-6 and row[f"{name}_gap"] <= 1e-6 for row in rows]
        figures[f"{name}_exact_share"] = float(np.mean(exact))
        figures[f"{name}_proven_share"] = float(np.mean([row[f"{name}_proven"] for row in rows]))
        relative = [row[f"{name}_gap"] / row[f"{name}_loss"] for row in rows]
        figures[f"{name}_median_relative_gap"] = float(np.median(relative))
        figures[f"{name}_largest_relative_gap"] = float(np.max(relative))
        figures[f"{name}_largest_excess"] = max(row[f"{name}_excess_over_q_method"] for row in rows)
        figures[f"{name}_mean_over_q_method"] = float(np.mean([row[f"{name}_over_q_method"] for row in rows]))
        figures[f"{name}_best_over_q_method"] = min(row[f"{name}_over_q_method"] for row in rows)
        figures[f"{name}_mean_error_deg"] = float(np.mean([row[f"{name}_error_deg"] for row in rows]))
        figures[f"{name}_q_mean_error_deg"] = float(np.mean([row[f"{name}_q_error_deg"] for row in rows]))
        figures[f"{name}_not_verified"] = float(sum(1 - row[f"{name}_verified"] for row in rows))
        figures[f"{name}_undercut"] = float(sum(row[f"{name}_undercut"] for row in rows))
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bars."""
    judged = []
    for name, says in (("body", "body boxes"), ("both", "body and reference boxes")):
        share, excess = figures[f"{name}_exact_share"], figures[f"{name}_largest_excess"]
        wrong = figures[f"{name}_undercut"] + figures[f"{name}_not_verified"]
        judged += [
            judge_bar(
                f"{name}-exact",
                f"{says}: share of draws with rank ratio < 1e-6 and certified gap <= 1e-6, at least 0.95",
                measured=share,
                holds=share >= 0.95,
            ),
            judge_bar(
                f"{name}-never-worse",
                f"{says}: worst-case loss above the q-method's, largest, at most 1e-9",
                measured=excess,
                holds=excess <= 1e-9,
            ),
            judge_bar(
                f"{name}-bound",
                f"{says}: certificates not verified, or lower bounds undercut by an attitude",
                measured=wrong,
                holds=wrong == 0,
            ),
        ]
    return judged


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw worst-case loss and attitude error over the q-method's, draw by draw."""
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(8.5, 4.2), layout="constrained")
    axes = canvas.subplots(1, 2, sharey=True)
    for panel, name, says in zip(axes, ("body", "both"), ("body boxes", "body and reference boxes"), strict=True):
        for size, colour in zip(SIZES, ("#009E73", "#0072B2", "#D55E00"), strict=True):
            own = [row for row in rows if row["size"] == size]
            ratio = [row[f"{name}_error_deg"] / row[f"{name}_q_error_deg"] for row in own]
            gain = [row[f"{name}_over_q_method"] for row in own]
            panel.semilogy(gain, ratio, ".", color=colour, label=f"boxes up to {100 * size:.0f} %")
        panel.axhline(1, color="#444444", linewidth=0.8)
        panel.set_title(says)
        panel.set_xlabel("worst-case loss over the q-method's")
    axes[0].set_yticks([0.25, 0.5, 1, 2, 4], ["1/4", "1/2", "1", "2", "4"])
    axes[0].set_yticks([], minor=True)
    axes[0].set_ylabel("attitude error over the q-method's")
    axes[0].legend(frameon=False, loc="lower left")
    write_svg(canvas, path)


study = Study(
    name="worst-case-wahba-boxes",
    title="Worst-case Wahba over component boxes: exactness, gain in the worst case, and the attitude error beside it",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=200,
    figure=figure,
)
