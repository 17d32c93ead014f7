"""Time of NSGA-II against the min-max of the interval-Wahba problem and against the certified attitude; ratios only.

All answer the same draw of the paper's Table 1: NSGA-II with the paper's range and a population of 100 over 150
generations, the min-max from the TRIAD attitude to its proof, the certified attitude with the angles that the boxes
allow: with its certificate, as arrays without one, and as a compiled kernel. Needs pymoo (extra `peers`).
"""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.claim import Claim, judge_bar, judge_paper
from optsat.campaign.interleaved import time_interleaved
from optsat.campaign.study import Case, Row, Study
from optsat.determine import certify_attitude, certify_attitude_batch, wahba, worst_case_wahba
from optsat.estimators.certified_pair import certified_two_vector
from optsat.kernels.open_kernel import make_kernel
from optsat.problems.interval_wahba import IntervalWahba
from optsat.problems.interval_wahba_front import IntervalWahbaFront
from optsat.solution import Proof
from optsat.solve import solve
from optsat.solvers.nsga2 import Nsga2
from optsat.studies import _interval_scenario as scenario


def cases(count: int) -> list[Case]:
    """Return the rounds, a draw each."""
    return [{} for _ in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one round."""
    b_B, r_N = scenario.perturbed(rng, scenario.PRINTED_B_B, scenario.PRINTED_R_N)
    b_B, r_N = scenario.unit(b_B), scenario.unit(r_N)
    boxes = scenario.unit_boxes(b_B, r_N)
    bound = boxes.b_B.cone_angles() + boxes.r_N.cone_angles()
    kernel = make_kernel(certified_two_vector())
    solver = Nsga2(seed=int(rng.integers(2**31)))
    front = IntervalWahbaFront(boxes.b_B, boxes.r_N, search_fraction=scenario.RANGE)
    proof = solve(IntervalWahba(boxes.b_B, boxes.r_N)).proof
    times = time_interleaved(
        {
            "nsga2": lambda: solve(front, solver),
            "min_max": lambda: solve(IntervalWahba(boxes.b_B, boxes.r_N)),
            "q_method": lambda: wahba(b_B, r_N, norm_policy="silent"),
            "certify": lambda: certify_attitude(b_B, r_N, bound),
            "certify_arrays": lambda: certify_attitude_batch(b_B[None], r_N[None], bound),
            "certify_compiled": lambda: kernel(b_B, r_N, bound),
            "worst_case": lambda: worst_case_wahba(boxes.b_B, boxes.r_N),
        },
        rounds=3,
    )
    peers = ("min_max", "certify", "certify_arrays", "certify_compiled", "worst_case")
    return {
        **{f"nsga2_over_{name}": times.ratio("nsga2", name) for name in peers},
        "min_max_over_q_method": times.ratio("min_max", "q_method"),
        "min_max_proven": int(proof is Proof.GLOBAL),
        "form": kernel.form,
    }


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return the median of each ratio over the rounds, and in how many the min-max was proven optimal."""
    return {
        **{name: float(np.median([row[name] for row in rows])) for name in rows[0] if "_over_" in name},
        "min_max_proven_share": float(np.mean([row["min_max_proven"] for row in rows])),
    }


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the paper's ratios, with what half or double the generations would change, and our bars."""
    min_max, certify = figures["nsga2_over_min_max"], figures["nsga2_over_certify_compiled"]
    return [
        judge_paper(
            "paper-nsga2",
            "NSGA-II takes 434 times as long as the min-max, whose budget is not printed (to a factor of two)",
            paper=434.0,
            measured=min_max,
            tolerance=217.0,
            better="higher",
        ),
        judge_paper(
            "paper-q-method",
            "the min-max takes 48 times as long as the q-method (to a factor of two)",
            paper=48.0,
            measured=figures["min_max_over_q_method"],
            tolerance=24.0,
            better="lower",
        ),
        judge_bar(
            "min-max", "NSGA-II (100 x 150) over our min-max, ratio >= 100", measured=min_max, holds=min_max >= 100
        ),
        judge_bar(
            "certify",
            "NSGA-II (100 x 150) over one call of the compiled certified attitude, ratio >= 2000",
            measured=certify,
            holds=certify >= 2000,
        ),
        judge_bar(
            "certify-with-certificate",
            "NSGA-II (100 x 150) over certify_attitude with its certificate object, all in Python, ratio >= 500",
            measured=figures["nsga2_over_certify"],
            holds=figures["nsga2_over_certify"] >= 500,
        ),
        judge_bar(
            "proven",
            "share of rounds in which the min-max ended with a proof",
            measured=figures["min_max_proven_share"],
            holds=figures["min_max_proven_share"] == 1,
        ),
    ]


study = Study(
    name="interval-wahba-timing",
    title="Time of NSGA-II over the min-max and the certified attitude on the interval-Wahba problem",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=5,
)
