"""Tightness of the guaranteed bound: against the smallest ball around boundary points found by brute force.

The brute-force radius is found by shooting rays from an interior point at the boundary of the admissible set, more
of them where the set reaches farthest; it is a lower bound of the true radius, so every ratio is an upper estimate.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from optsat.arrays import Array
from optsat.attitude.davenport import rotation_matrix
from optsat.attitude.gibbs_chart import (
    GibbsChart,
    ball_levels,
    boundary_points,
    fibonacci_directions,
    interior_point,
    smallest_ball,
)
from optsat.attitude.status import AttitudeStatus
from optsat.campaign.claim import Claim, judge_bar
from optsat.campaign.study import Case, Row, Study
from optsat.determine import certify_attitude
from optsat.errors import OptsatError
from optsat.models.draws import directions, rotations, tilted
from optsat.plots.svg_file import write_svg
from optsat.problems.certified_attitude import CertifiedAttitude

VECTORS = (2, 3, 4, 5, 6)
BOUNDS_DEG = (5.0, 0.5, 0.05)


def cases(count: int) -> list[Case]:
    """Return vector counts and bounds in turn."""
    return [
        {"vectors": VECTORS[k % 5], "bound_deg": BOUNDS_DEG[(k // 5) % 3], "refine": VECTORS[k % 5] > 2}
        for k in range(count)
    ]


def run(case: Case, rng: np.random.Generator) -> Row:
    """Return the ratios of one pose; poses that leave the attitude free are drawn again."""
    m = case["vectors"]
    eps = np.full(m, np.deg2rad(case["bound_deg"]))
    for _ in range(100):
        q_BN, r_N = rotations(rng, 1)[0], directions(rng, m)
        b_B = tilted(rng, r_N @ rotation_matrix(q_BN).T, eps, "cap")
        attitude = certify_attitude(b_B, r_N, eps, norm_policy="silent")
        if attitude.status is AttitudeStatus.OK and attitude.bound_rad < np.pi / 2:
            break
    else:
        raise OptsatError("no determined pose in 100 draws")
    radius = brute_force_radius(attitude)
    refined = certify_attitude(b_B, r_N, eps, refine="cells", norm_policy="silent") if case["refine"] else attitude
    return {
        "vectors": m,
        "bound_deg": case["bound_deg"],
        "order_1": attitude.bound_rad / radius,
        "refined": refined.bound_rad / radius,
        "refined_verified": bool(refined.certificate.verify()),
    }


def brute_force_radius(attitude: CertifiedAttitude) -> float:
    """Return the radius [rad] of the smallest ball around sampled boundary points of the admissible set."""
    data = attitude.certificate.admissible
    chart = GibbsChart.about(data, attitude.q_BN, float(np.tan(attitude.bound_rad / 2)))
    inside = interior_point(chart)
    if inside is None:
        raise OptsatError("the admissible set has no interior point")
    rays = fibonacci_directions(2000)
    points = boundary_points(chart, inside, rays)
    spacing = float(np.sqrt(4 * np.pi / len(rays)))
    for _ in range(8):
        centre = smallest_ball(points, chart.scale)
        farthest = points[np.argsort(-ball_levels(points, centre, chart.scale))[:40]]
        rays = np.concatenate([_around(point - inside, spacing) for point in farthest])
        points = np.concatenate((points, boundary_points(chart, inside, rays)))
        spacing /= 2.5
    centre = smallest_ball(points, chart.scale, 5000)
    return float(2 * np.arctan(chart.scale * np.sqrt(np.max(ball_levels(points, centre, chart.scale)))))


def _around(axis: Array, spread: float) -> Array:
    axis = axis / np.linalg.norm(axis)
    cloud = axis + spread * fibonacci_directions(16)
    return np.asarray(cloud / np.linalg.norm(cloud, axis=1, keepdims=True))


def metrics(rows: Sequence[Row]) -> Mapping[str, float]:
    """Return mean and largest ratio by number of vectors."""
    figures: dict[str, float] = {}
    for m in sorted({row["vectors"] for row in rows}):
        own = [row for row in rows if row["vectors"] == m]
        for name in ("order_1", "refined"):
            figures[f"{m}_vectors_{name}_mean"] = float(np.mean([row[name] for row in own]))
            figures[f"{m}_vectors_{name}_largest"] = float(np.max([row[name] for row in own]))
    many = [row for row in rows if row["vectors"] > 2]
    figures["order_1_mean"] = float(np.mean([row["order_1"] for row in many])) if many else float("nan")
    figures["refined_mean"] = float(np.mean([row["refined"] for row in many])) if many else float("nan")
    figures["unverified"] = float(sum(not row["refined_verified"] for row in rows))
    return figures


def claims(figures: Mapping[str, float]) -> list[Claim]:
    """Return the tightness bars."""
    two = figures.get("2_vectors_order_1_largest", float("nan"))
    order = max(figures.get(f"{m}_vectors_order_1_mean", 0.0) for m in VECTORS[1:])
    refined = max(figures.get(f"{m}_vectors_refined_mean", 0.0) for m in VECTORS[1:])
    return [
        judge_bar("two-vectors", "bound / brute-force radius <= 1.005, largest", measured=two, holds=two <= 1.005),
        judge_bar("order-1", "3 to 6 vectors: largest mean <= 1.45", measured=order, holds=order <= 1.45),
        judge_bar("refined", "3 to 6 vectors, cells: largest mean <= 1.15", measured=refined, holds=refined <= 1.15),
        judge_bar(
            "verified",
            "refined certificates that the solver-free check rejects",
            measured=figures["unverified"],
            holds=figures["unverified"] == 0,
        ),
    ]


def figure(rows: Sequence[Row], path: Path) -> None:
    """Draw both ratios against the number of vectors."""
    from matplotlib.figure import Figure

    canvas = Figure(figsize=(7, 4.2), layout="constrained")
    axes = canvas.subplots()
    for name, shift, colour, label in (
        ("order_1", -0.12, "#0072B2", "two eigenvalues (order 1)"),
        ("refined", 0.12, "#009E73", "refined by cells"),
    ):
        x = [row["vectors"] + shift for row in rows]
        axes.plot(x, [row[name] for row in rows], "o", ms=4, alpha=0.6, color=colour, label=label)
    axes.axhline(1.0, color="black", linewidth=1)
    axes.set(xlabel="number of vectors", ylabel="guaranteed bound / brute-force radius [-]")
    axes.set_title("Exact for two vectors; cells close most of the gap for more")
    axes.legend(frameon=False)
    write_svg(canvas, path)


study = Study(
    name="certified-attitude-tightness",
    title="Tightness of the guaranteed attitude bound against brute force",
    cases=cases,
    run=run,
    metrics=metrics,
    claims=claims,
    default_cases=750,
    figure=figure,
)
