"""What scatter of sheet, crease and pass does to the shape: seeded draws, folded all at once.

The model: each pass bends by its figure times lognormal factors of the sheet, the crease and the pass, plus a
small random angle. Open loop nothing is measured; with touch-up every crease is measured at the end of its
turn and stopped at the pass nearest to its goal, so that half a pass remains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.kinematics import rotation_about_line
from planner.net import Net

__all__ = [
    "ScatterFigures", "ScatterResult", "Spread", "draw_scatter", "folded_draws", "shape_errors",
]  # fmt: skip

PERCENTILES = (5.0, 50.0, 95.0)
"""Percentiles that a spread reports."""


@dataclass(frozen=True)
class ScatterFigures:
    """How much bending angles scatter.

    Attributes:
        sheet: relative, from sheet to sheet (one factor for all creases).
        crease: relative, from crease to crease.
        per_pass: relative, from pass to pass.
        additive_rad: random angle that each pass adds.
    """

    sheet: float = 0.10
    crease: float = 0.05
    per_pass: float = 0.08
    additive_rad: float = float(np.radians(0.05))


@dataclass(frozen=True)
class Spread:
    """Percentiles (5, 50, 95) over the draws.

    Attributes:
        probability: share of draws whose shape error stays within the tolerance.
        shape_rms_mm: of the vertices against the goal, best rigid fit.
        shape_rms_rel: the same over the diagonal of the goal's bounding box.
        angle_error_rad: largest error of a crease against the plan, per draw.
    """

    probability: float
    shape_rms_mm: tuple[float, float, float]
    shape_rms_rel: tuple[float, float, float]
    angle_error_rad: tuple[float, float, float]


@dataclass(frozen=True)
class ScatterResult:
    """Result of the draws.

    Attributes:
        draws: number of draws.
        seed: their seed.
        tolerance_rel: shape error up to which a draw counts as good.
        open_loop: nothing measured.
        touched_up: every crease measured and stopped at the nearest pass.
        weakest_creases: creases whose own scatter moves the shape most, worst first.
    """

    draws: int
    seed: int
    tolerance_rel: float
    open_loop: Spread
    touched_up: Spread
    weakest_creases: tuple[int, ...]


def draw_scatter(
    net: Net,
    passes: Mapping[int, Sequence[float]],
    figures: ScatterFigures | None = None,
    *,
    draws: int = 200,
    seed: int = 0,
    tolerance_rel: float = 0.02,
) -> ScatterResult:
    """Draw bending angles and measure the shapes that they give.

    Args:
        net: the net.
        passes: crease → plastic angle of each of its passes, rad, as the heating model predicts them.
        figures: how much angles scatter.
        draws: number of draws, at least 1.
        seed: of the draws.
        tolerance_rel: shape error, over the goal's diagonal, up to which a draw is good.

    Raises:
        ValueError: if ``draws`` is less than 1.
    """
    if draws < 1:
        raise ValueError(f"draws is {draws}: expected at least 1")
    given = figures or ScatterFigures()
    rng = np.random.default_rng(seed)
    wanted = np.zeros(len(net.edges))
    open_loop, touched = np.zeros((draws, len(net.edges))), np.zeros((draws, len(net.edges)))
    deviation = np.zeros(len(net.edges))
    sheet = np.exp(given.sheet * rng.standard_normal((draws, 1)))
    for crease in sorted(passes):
        increments = np.asarray(passes[crease], dtype=np.float64)
        if not len(increments):
            continue
        wanted[crease] = increments.sum()
        own = np.exp(given.crease * rng.standard_normal((draws, 1)))
        each = np.exp(given.per_pass * rng.standard_normal((draws, len(increments))))
        noise = given.additive_rad * rng.standard_normal((draws, len(increments)))
        open_loop[:, crease] = (increments * sheet * own * each + noise).sum(axis=1)
        half_pass = 0.5 * float(np.abs(increments[-1]))
        touched[:, crease] = wanted[crease] + rng.uniform(-half_pass, half_pass, draws) + noise[:, -1]
        deviation[crease] = given.crease * abs(wanted[crease]) + half_pass / np.sqrt(3.0)
    creases = np.array(sorted(passes), dtype=np.int64)
    single = wanted + deviation[creases][:, None] * np.eye(len(net.edges))[creases]
    alone = shape_errors(net, folded_draws(net, single))[0] if len(creases) else np.zeros(0)
    worst = creases[np.argsort(-alone, kind="stable")][:10]
    return ScatterResult(
        draws=draws, seed=seed, tolerance_rel=tolerance_rel,
        open_loop=_spread(net, open_loop, wanted, tolerance_rel),
        touched_up=_spread(net, touched, wanted, tolerance_rel),
        weakest_creases=tuple(int(c) for c in worst),
    )  # fmt: skip


def folded_draws(net: Net, angles_rad: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, F, 3, 3) corners in mm of every face for N sets of angles (N, E): all draws at once."""
    count = len(angles_rad)
    turn = np.empty((count, len(net.faces), 3, 3))
    shift = np.empty((count, len(net.faces), 3))
    turn[:, net.base_face], shift[:, net.base_face] = np.eye(3), 0.0
    quarter = np.pi / 2.0
    for face in net.order[1:].tolist():
        start, end = (np.append(p, 0.0) for p in net.hinge(face))
        cross = (
            rotation_about_line(start, end, quarter)[:3, :3]
            - rotation_about_line(start, end, -quarter)[:3, :3]
        ) / 2.0
        angle = angles_rad[:, net.crease_of[face]]
        own = np.eye(3) + np.sin(angle)[:, None, None] * cross
        own += (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
        parent = int(net.parent[face])
        turn[:, face] = turn[:, parent] @ own
        offset = start - np.einsum("nij,j->ni", own, start)
        shift[:, face] = np.einsum("nij,nj->ni", turn[:, parent], offset) + shift[:, parent]
    flat = np.zeros((len(net.faces), 3, 3))
    flat[:, :, :2] = net.vertices[net.faces]
    corners: NDArray[np.float64] = np.einsum("nfij,fkj->nfki", turn, flat, optimize=True) + shift[:, :, None]
    return corners


def shape_errors(net: Net, corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """RMS (N,) and largest (N,) distance in mm of face corners (N, F, 3, 3) from the goal, best rigid fits.

    No mirror. Source: Kabsch, Acta Cryst. A32 (1976) 922.
    """
    points = corners.reshape(len(corners), -1, 3)
    target = net.goal.vertices[net.goal.faces].reshape(-1, 3)
    p = points - points.mean(axis=1, keepdims=True)
    t = target - target.mean(axis=0)
    u, _, vt = np.linalg.svd(np.einsum("npi,pj->nij", p, t))
    sign = np.ones((len(p), 3))
    sign[:, 2] = np.sign(np.linalg.det(u) * np.linalg.det(vt))
    turn = np.einsum("nij,nj,njk->nik", u, sign, vt)
    distance = np.linalg.norm(p @ turn - t, axis=2)
    return np.sqrt((distance**2).mean(axis=1)), distance.max(axis=1)


def _spread(
    net: Net, angles: NDArray[np.float64], wanted: NDArray[np.float64], tolerance_rel: float
) -> Spread:
    diagonal = float(np.linalg.norm(np.ptp(net.goal.vertices, axis=0)))
    rms = np.concatenate([
        shape_errors(net, folded_draws(net, part))[0]
        for part in np.array_split(angles, max(1, len(angles) * len(net.faces) // 50_000))
        if len(part)
    ])  # fmt: skip
    largest = np.abs(angles - wanted).max(axis=1)
    return Spread(
        probability=float(np.mean(rms / diagonal <= tolerance_rel)),
        shape_rms_mm=_percentiles(rms),
        shape_rms_rel=_percentiles(rms / diagonal),
        angle_error_rad=_percentiles(largest),
    )


def _percentiles(values: NDArray[np.float64]) -> tuple[float, float, float]:
    low, middle, high = np.percentile(values, PERCENTILES).tolist()
    return low, middle, high
