"""What scatter of sheet, crease and pass does to a plan: seeded draws, replayed on all cores.

Each draw folds the plan with other angles than planned. It passes if nothing collides on the way and the
shape ends hardly worse than planned. Draws are made in chunks with a random stream each, so the result is the
same bits on any number of cores.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import FoldPlan
from planner.processors import processors
from twin.scatter_contact import ContactReplay, Replayed
from twin.scatter_draws import CHUNK, FoldTurn, ScatterFigures, TouchUp, draw_turns
from twin.scatter_shares import CreaseShare, VarianceShares, variance_shares
from twin.shape_error import folded_draws, shape_errors

__all__ = ["HitPair", "ScatterResult", "Spread", "run_scatter", "wilson_interval"]

PERCENTILES = (5.0, 50.0, 95.0)
"""Percentiles that a spread reports."""

CONFIDENCE_Z = 1.959963984540054
"""Standard normal quantile of a two-sided confidence of 95 %."""

MOST_PAIRS = MOST_CREASES = 10
"""So many pairs and creases are named."""


@dataclass(frozen=True)
class HitPair:
    """A pair that was the first to collide.

    Attributes:
        step: of the plan.
        moving: face that turns.
        still: face, or triangle of the substrate, that it meets.
        in_substrate: ``still`` is a triangle of the substrate.
        share: of the draws.
    """

    step: int
    moving: int
    still: int
    in_substrate: bool
    share: float


@dataclass(frozen=True)
class Spread:
    """What the draws did in one way of working; percentiles are those of 5, 50 and 95 %.

    Attributes:
        probability: share of draws that pass.
        interval: its confidence interval of 95 % (Wilson).
        in_tolerance: share of draws whose shape error is above the planned one by no more than the tolerance.
        contact_free: share of draws in which nothing collides.
        sheet_hits: share of draws whose first collision is with the substrate.
        seam_touches: pairs per draw that met early on their common seam, no collisions; up to the first one.
        shape_rms_mm: of the vertices against the goal, best rigid fit.
        shape_rms_rel: the same over the diagonal of the goal's bounding box.
        angle_error_rad: largest error of a crease against the plan, per draw.
        passes: mean number of passes.
        pairs: pairs that most often were the first to collide.
    """

    probability: float
    interval: tuple[float, float]
    in_tolerance: float
    contact_free: float
    sheet_hits: float
    seam_touches: float
    shape_rms_mm: tuple[float, float, float]
    shape_rms_rel: tuple[float, float, float]
    angle_error_rad: tuple[float, float, float]
    passes: float
    pairs: tuple[HitPair, ...]


@dataclass(frozen=True)
class ScatterResult:
    """Result of the draws.

    Attributes:
        draws: number of draws.
        seed: their seed.
        tolerance_rel: shape error above the planned one, over the goal's diagonal, up to which a draw passes.
        planned_rms_mm: shape error of the plan itself, with all creases where it wants them.
        open_loop: nothing measured.
        touched_up: every turn measured and ended at the nearest pass; None if it was not asked for.
        sheet_share: share of the factor common to all creases in the expected squared shape error, open loop.
        creases: creases that matter most in the rest of it, worst first.
        expected_rms_mm: that error to first order.
    """

    draws: int
    seed: int
    tolerance_rel: float
    planned_rms_mm: float
    open_loop: Spread
    touched_up: Spread | None
    sheet_share: float
    creases: tuple[CreaseShare, ...]
    expected_rms_mm: float

    @property
    def weakest_creases(self) -> tuple[int, ...]:
        """Creases whose own scatter moves the shape most, worst first."""
        return tuple(c.crease for c in self.creases)


def wilson_interval(good: int, count: int) -> tuple[float, float]:
    """Confidence interval of 95 % of a probability of which ``good`` of ``count`` trials were seen.

    Source: Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
    """
    z2 = CONFIDENCE_Z**2 / count
    share = good / count
    middle = (share + 0.5 * z2) / (1.0 + z2)
    half = math.sqrt(z2 * share * (1.0 - share) + 0.25 * z2 * z2) / (1.0 + z2)
    return (0.0 if good == 0 else middle - half, 1.0 if good == count else middle + half)


def run_scatter(
    plan: FoldPlan,
    turns: Sequence[FoldTurn],
    figures: ScatterFigures | None = None,
    touch: TouchUp | None = None,
    *,
    draws: int = 200,
    seed: int = 0,
    tolerance_rel: float = 0.02,
    touch_up: bool = True,
    sheet: bool = True,
    workers: int | None = None,
    on_progress: Callable[[float], None] | None = None,
) -> ScatterResult:
    """Draw bending angles, fold the plan with them, and say how often it comes out well.

    Args:
        plan: the plan.
        turns: its fold steps and their passes, from ``fold_turns``.
        figures: how much angles scatter.
        touch: how creases are measured.
        draws: number of draws, at least 1.
        seed: of the draws, at least 0.
        tolerance_rel: excess of the shape error over the planned one, by the goal's diagonal, that is good.
        touch_up: also fold every draw with measuring.
        sheet: the substrate can be hit; False shows what wider clips could gain at most.
        workers: threads; as many as there are cores if None. The result does not depend on it.
        on_progress: told the share that is done.

    Raises:
        ValueError: if a number makes no sense.
    """
    if draws < 1:
        raise ValueError(f"draws is {draws}: expected at least 1")
    if seed < 0:
        raise ValueError(f"seed is {seed}: expected 0 or more")
    if not (math.isfinite(tolerance_rel) and tolerance_rel > 0.0):
        raise ValueError(f"tolerance_rel is {tolerance_rel:g}: expected more than 0")
    given, measured = figures or ScatterFigures(), touch or TouchUp()
    job = _Job(plan, tuple(turns), given, measured, seed, touch_up=touch_up, sheet=sheet)
    chunks = [
        (n, min(CHUNK, draws - n * CHUNK)) for n in range((draws + CHUNK - 1) // CHUNK)
    ]  # fmt: skip
    parts = _on_all_cores(job, chunks, workers or processors(), on_progress)
    shares = variance_shares(plan.net, turns, given) if turns else VarianceShares(0.0, (), 0.0)
    planned = float(shape_errors(plan.net, folded_draws(plan.net, job.wanted[None]))[0][0])
    ways = [_spread(plan, [p[way] for p in parts], planned, tolerance_rel) for way in range(1 + touch_up)]
    return ScatterResult(
        draws=draws, seed=seed, tolerance_rel=tolerance_rel, planned_rms_mm=planned,
        open_loop=ways[0], touched_up=ways[1] if touch_up else None,
        sheet_share=shares.sheet, creases=shares.creases[:MOST_CREASES], expected_rms_mm=shares.rms_mm,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Way:
    """One chunk of draws folded in one way."""

    rms_mm: NDArray[np.float64]
    error_rad: NDArray[np.float64]
    passes: NDArray[np.float64]
    replays: tuple[Replayed, ...]


class _Job:
    """Makes chunks of draws; nothing in it changes, so threads may share it."""

    def __init__(
        self, plan: FoldPlan, turns: tuple[FoldTurn, ...], figures: ScatterFigures, touch: TouchUp,
        seed: int, *, touch_up: bool, sheet: bool,
    ) -> None:  # fmt: skip
        self.plan, self.turns, self.figures, self.touch, self.seed = plan, turns, figures, touch, seed
        self.touch_up = touch_up
        self.replay = ContactReplay(plan, turns, sheet=sheet)
        self.wanted = np.zeros(len(plan.net.edges))
        for turn in turns:
            self.wanted[turn.crease] = turn.to_rad

    def chunk(self, number: int, count: int) -> tuple[_Way, ...]:
        """The first ``count`` draws of a chunk, open loop and (if wanted) touched up."""
        drawn = draw_turns(self.turns, self.figures, self.touch, self.seed, number)
        ways = [self._way(drawn.open_rad, np.full(CHUNK, float(drawn.open_passes)), count)]
        if self.touch_up:
            ways.append(self._way(drawn.touched_rad, drawn.touched_passes.astype(np.float64), count))
        return tuple(ways)

    def _way(self, after: NDArray[np.float64], passes: NDArray[np.float64], count: int) -> _Way:
        net = self.plan.net
        angles = np.zeros((CHUNK, len(net.edges)))
        for n, turn in enumerate(self.turns):
            angles[:, turn.crease] = after[:, n]
        rms = shape_errors(net, folded_draws(net, angles))[0]
        error = np.abs(angles - self.wanted).max(axis=1)
        replays = tuple(self.replay.first(after[n]) for n in range(count))
        return _Way(rms[:count], error[:count], passes[:count], replays)


def _on_all_cores(
    job: _Job, chunks: Sequence[tuple[int, int]], workers: int, tell: Callable[[float], None] | None
) -> list[tuple[_Way, ...]]:
    """Results of the chunks in their order. The contact kernel lets other threads run meanwhile."""
    from concurrent.futures import ThreadPoolExecutor

    out: list[tuple[_Way, ...]] = []
    # The first chunk alone: it compiles what is not compiled yet.
    out.append(job.chunk(*chunks[0]))
    if tell is not None:
        tell(1.0 / len(chunks))
    with ThreadPoolExecutor(max(1, workers)) as pool:
        try:
            for part in pool.map(lambda c: job.chunk(*c), chunks[1:]):
                out.append(part)
                if tell is not None:
                    tell(len(out) / len(chunks))
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return out


def _spread(plan: FoldPlan, parts: Sequence[_Way], planned_mm: float, tolerance_rel: float) -> Spread:
    diagonal = float(np.linalg.norm(np.ptp(plan.net.goal.vertices, axis=0)))
    rms = np.concatenate([p.rms_mm for p in parts])
    error = np.concatenate([p.error_rad for p in parts])
    passes = np.concatenate([p.passes for p in parts])
    replays = [r for p in parts for r in p.replays]
    count = len(rms)
    near = rms <= planned_mm + tolerance_rel * diagonal
    free = np.array([r.collision is None for r in replays])
    good = int((near & free).sum())
    pairs = Counter(
        (r.collision.step, r.collision.moving, r.collision.still, r.collision.in_substrate)
        for r in replays
        if r.collision is not None
    )
    often = sorted(pairs.items(), key=lambda item: (-item[1], item[0]))[:MOST_PAIRS]
    return Spread(
        probability=good / count,
        interval=wilson_interval(good, count),
        in_tolerance=float(near.mean()),
        contact_free=float(free.mean()),
        sheet_hits=sum(times for pair, times in pairs.items() if pair[3]) / count,
        seam_touches=sum(r.seam_touches for r in replays) / count,
        shape_rms_mm=_percentiles(rms),
        shape_rms_rel=_percentiles(rms / diagonal),
        angle_error_rad=_percentiles(error),
        passes=float(passes.mean()),
        pairs=tuple(HitPair(*pair, share=times / count) for pair, times in often),
    )


def _percentiles(values: NDArray[np.float64]) -> tuple[float, float, float]:
    low, middle, high = np.percentile(values, PERCENTILES).tolist()
    return low, middle, high
