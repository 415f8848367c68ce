"""Random fold angles: what sheet, crease and pass do to a planned turn, and what measuring saves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Fold, FoldPlan
from rigs.process import Process
from twin.errors import ModelError

__all__ = ["CHUNK", "Drawn", "FoldTurn", "ScatterFigures", "TouchUp", "draw_turns", "fold_turns"]

CHUNK = 20
"""Draws that share one stream of random numbers: so many are made at once, whoever makes them."""

EQUAL_PASS_RAD = math.radians(1.0)
"""Passes of a plan without a process."""

_SPARE_SHARE, _SPARE_PASSES = 0.5, 10


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

    def __post_init__(self) -> None:
        for name in ("sheet", "crease", "per_pass", "additive_rad"):
            value = getattr(self, name)
            if not (math.isfinite(value) and 0.0 <= value <= 1.0):
                raise ValueError(f"scatter {name} is {value:g}: expected 0 to 1")


@dataclass(frozen=True)
class TouchUp:
    """How creases are measured while they are folded.

    Each turn is burnt up to a share of its planned passes without a look. Then its angle is measured before
    every further pass, and it ends when less than half a pass is missing.

    Attributes:
        sigma_rad: standard deviation of one measurement.
        measure_from: share of the planned passes that are burnt before the first look.
    """

    sigma_rad: float = math.radians(0.2)
    measure_from: float = 0.6

    def __post_init__(self) -> None:
        if not (math.isfinite(self.sigma_rad) and self.sigma_rad >= 0.0):
            raise ValueError(f"measurement sigma is {self.sigma_rad:g} rad: expected 0 or more")
        if not 0.0 <= self.measure_from <= 1.0:
            raise ValueError(f"measure_from is {self.measure_from:g}: expected 0 to 1")


@dataclass(frozen=True)
class FoldTurn:
    """One fold step with its passes.

    Attributes:
        step: of the plan.
        crease: net edge.
        to_rad: fold angle that the plan wants afterwards.
        increments_rad: plastic angle of each pass, as the heating model predicts it.
    """

    step: int
    crease: int
    to_rad: float
    increments_rad: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Drawn:
    """Angles of one chunk of draws.

    Attributes:
        open_rad: (CHUNK, T) angle of the crease after every turn, nothing measured.
        touched_rad: (CHUNK, T) the same with every turn measured.
        open_passes: passes of one draw without measuring.
        touched_passes: (CHUNK,) passes with it.
    """

    open_rad: NDArray[np.float64]
    touched_rad: NDArray[np.float64]
    open_passes: int
    touched_passes: NDArray[np.int64]


def fold_turns(plan: FoldPlan, process: Process | None = None) -> tuple[FoldTurn, ...]:
    """The fold steps of ``plan`` with the passes of ``process``, or with equal passes if there is none.

    Raises:
        ModelError: if the process was made for another plan.
    """
    now: dict[int, float] = {}
    out: list[FoldTurn] = []
    for number, step in enumerate(plan.steps):
        if not isinstance(step, Fold):
            continue
        change = step.to_rad - now.get(step.crease, 0.0)
        now[step.crease] = step.to_rad
        fold = None if process is None else process.fold_at.get(number)
        if fold is not None and fold.crease != step.crease:
            raise ModelError(
                f"step {number} folds crease {step.crease}, but the process crease {fold.crease}: "
                "it was made for another plan"
            )
        if fold is None:
            count = max(1, math.ceil(abs(change) / EQUAL_PASS_RAD - 1e-9))
            increments: tuple[float, ...] = (change / count,) * count
        else:
            increments = fold.increments_rad
        out.append(FoldTurn(number, step.crease, step.to_rad, increments))
    return tuple(out)


def draw_turns(
    turns: Sequence[FoldTurn], figures: ScatterFigures, touch: TouchUp, seed: int, chunk: int
) -> Drawn:
    """Angles of draws ``CHUNK * chunk`` to ``CHUNK * (chunk + 1) - 1``.

    A pass bends by its figure times lognormal factors of sheet, crease and pass, plus a small random angle.
    The same random numbers serve both ways of working; further passes bend like the last planned one.
    """
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(chunk,))))
    sheet = np.exp(figures.sheet * rng.standard_normal((CHUNK, 1)))
    own: dict[int, NDArray[np.float64]] = {}
    for crease in sorted({t.crease for t in turns}):
        own[crease] = np.exp(figures.crease * rng.standard_normal((CHUNK, 1)))
    open_rad, touched_rad = np.zeros((2, CHUNK, len(turns)))
    passes = np.zeros(CHUNK, dtype=np.int64)
    planned = 0
    open_now: dict[int, NDArray[np.float64]] = {}
    touched_now: dict[int, NDArray[np.float64]] = {}
    rows = np.arange(CHUNK)
    for n, turn in enumerate(turns):
        crease = turn.crease
        count = len(turn.increments_rad)
        if not count:
            open_rad[:, n] = open_now.get(crease, 0.0)
            touched_rad[:, n] = touched_now.get(crease, 0.0)
            continue
        planned += count
        spare = math.ceil(_SPARE_SHARE * count) + _SPARE_PASSES
        mean = np.concatenate([turn.increments_rad, np.full(spare, turn.increments_rad[-1])])
        each = np.exp(figures.per_pass * rng.standard_normal((CHUNK, len(mean))))
        bend = mean * sheet * own[crease] * each
        bend += figures.additive_rad * rng.standard_normal((CHUNK, len(mean)))
        grown = np.concatenate([np.zeros((CHUNK, 1)), np.cumsum(bend, axis=1)], axis=1)
        seen = touch.sigma_rad * rng.standard_normal((CHUNK, len(mean) + 1))
        open_now[crease] = open_rad[:, n] = open_now.get(crease, 0.0) + grown[:, count]
        angle = grown + np.reshape(touched_now.get(crease, np.zeros(CHUNK)), (CHUNK, 1))
        missing = (turn.to_rad - (angle + seen)) * np.sign(turn.increments_rad[-1])
        enough = missing <= 0.5 * np.abs(np.append(mean, mean[-1]))
        enough[:, : math.floor(touch.measure_from * count)] = False
        enough[:, -1] = True
        stop = np.argmax(enough, axis=1)
        touched_now[crease] = touched_rad[:, n] = angle[rows, stop]
        passes += stop
    return Drawn(open_rad, touched_rad, planned, passes)
