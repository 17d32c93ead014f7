"""Honesty of min-max answers: over random convex and nonconvex problems, does any engine call an answer what it is not?

Half of the problems are convex with an optimum known by construction, some with linear rows, bounds and flat optima.
The others are waves, saddles and products of two unknowns, where a claim is held against every answer and against
points spread over the bounds. Engines run alone, from one start. An answer is honest when its factor is the one that
its point has, its multipliers balance, it beats no optimum, and, where it is called global, nothing does better; one
that is called feasible and no more has to keep the constraints.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.forms import MinMaxForm
from optsat.multistart import sobol_starts
from optsat.problems.attainment import FEASIBLE, Attainment
from optsat.problems.reference_draws import convex_problem, nonconvex_problem
from optsat.solution import Proof, Solution
from optsat.solve import solve
from optsat.solvers import SOLVERS

ENGINES = ("conic_minmax", "ipopt", "sqp_daqp", "sqp_osqp", "sqp_ipqp", "slsqp")
_SAMPLES = 128
# relative to the factor (at least 1)
_TOLERANCE = 1e-6
_FEASIBLE = (Proof.FEASIBLE, Proof.STATIONARY, Proof.GLOBAL)


def cases(count: int) -> list[Case]:
    """Return convex and nonconvex problems in turn."""
    return [{"convex": k % 2 == 0} for k in range(count)]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return for each engine whether it takes the problem, whether it is honest, and what it proves."""
    drawn = convex_problem(rng) if case["convex"] else nonconvex_problem(rng)
    form = drawn.problem.form
    engines = [each for each in SOLVERS if each.name in ENGINES and each.accepts(form)]
    found = {each.name: solve(drawn.problem, each) for each in engines}
    least = drawn.optimum
    if not case["convex"]:
        points = sobol_starts(form.start, form.lower, form.upper, _SAMPLES, 0)
        values = [form.factor(form.objectives.values(x)) for x in points]
        least = min(values + [each.answer.factor for each in found.values() if each.proof in _FEASIBLE])
    row: dict[str, int | bool] = {"convex": bool(case["convex"])}
    for name in ENGINES:
        solution = found.get(name)
        proof = Proof.NOTHING if solution is None else solution.proof
        row |= {
            f"ran_{name}": solution is not None,
            f"stationary_{name}": proof in (Proof.STATIONARY, Proof.GLOBAL),
            f"global_{name}": proof is Proof.GLOBAL,
            f"dishonest_{name}": solution is not None and not honest(form, solution, least),
        }
    return row


def honest(form: MinMaxForm, solution: Solution[Attainment], optimum: float) -> bool:
    """Return whether the answer is what it is called.

    optimum : of the problem; of a nonconvex one the least factor that anybody found
    """
    answer, proof = solution.answer, solution.proof
    allowed = _TOLERANCE * max(1.0, abs(optimum))
    if proof is Proof.INFEASIBLE:
        return False
    if proof not in _FEASIBLE:
        return True
    exact = answer.factor == form.factor(form.objectives.values(answer.x))
    # a violation within the tolerance can be worth more than that in the factor, so only an optimum is held against it
    claimed = (
        solution.residuals["violation"] <= FEASIBLE if proof is Proof.FEASIBLE else answer.factor >= optimum - allowed
    )
    inside = bool(np.all(answer.x >= form.lower) and np.all(answer.x <= form.upper))
    balanced = proof is Proof.FEASIBLE or abs(weight_sum(form, answer) - 1) <= _TOLERANCE
    best = proof is not Proof.GLOBAL or answer.factor <= optimum + allowed
    return exact and claimed and inside and balanced and best


def weight_sum(form: MinMaxForm, answer: Attainment) -> float:
    """Return sum |w_i| mu_i over all rows, which is 1 at an optimum."""
    weights = np.zeros(form.objectives.size)
    weights[form.objective] = form.weight
    return float(weights @ (answer.multipliers + answer.multipliers_below))


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return shares: of honest answers among those given, of proofs among the problems taken."""
    figures: dict[str, float] = {"problems": float(len(rows))}
    for name in ENGINES:
        ran = [row for row in rows if row[f"ran_{name}"]]
        convex = [row for row in ran if row["convex"]]
        figures |= {
            f"honesty_{name}": 1.0 - _share(ran, f"dishonest_{name}"),
            f"stationary_{name}": _share(ran, f"stationary_{name}"),
            f"global_of_convex_{name}": _share(convex, f"global_{name}"),
        }
    return figures


def _share(rows: Sequence[Row], name: str) -> float:
    return float(np.mean([row[name] for row in rows])) if rows else 0.0


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the bar."""
    least = min(figures[f"honesty_{name}"] for name in ENGINES)
    return [
        judge_bar(
            "honesty",
            "share of honest answers, of the engine with the fewest: 1",
            measured=least,
            holds=least == 1.0,
        ),
    ]


study = Study(
    name="minmax-honesty",
    title="Min-max engines on random convex and nonconvex problems: no proof that is wrong",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=1000,
)
