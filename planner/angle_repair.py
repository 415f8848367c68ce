"""Angles of a net that was found: some creases are folded a little less where that lets others go further."""

from __future__ import annotations

import math
import time

import numpy as np
from numpy.typing import NDArray

from planner.candidate import Candidate, judge
from planner.fold_problem import FoldProblem
from planner.search_moves import movers

__all__ = ["let_go", "repaired"]

STEPS_RAD = (math.radians(2.0), math.radians(6.0), math.radians(15.0))
"""By how much a crease is held back at once."""

HALVES = 4
"""How often the angle by which a crease is held back is halved at most, between nothing and what it is."""

MOST_NETS, WORK = 150, 20_000
"""Nets folded at most, for either half of the repair; and in all their faces."""


def repaired(candidate: Candidate, problem: FoldProblem, until: float = math.inf) -> Candidate:
    """The same net with better angles: creases are held back where it pays, and no further than it pays.

    For every crease that stays short, in the order of what that costs, each crease that carries one of the
    two faces that meet is folded a little less. What makes the cost smaller stays. Nothing is random.

    Args:
        candidate: the net as judged.
        problem: goal and limits.
        until: ``time.monotonic()`` at which it ends.

    Returns:
        The better candidate; ``candidate`` itself if nothing was better.
    """
    best, left = candidate, _most_nets(problem)
    tried: set[tuple[int, float]] = set()
    improving = True
    while improving:
        improving = False
        for edge, step in _ways(best, problem):
            back = np.zeros(len(best.layout.tree)) if best.back is None else best.back.copy()
            back[edge] += step
            if left <= 0 or time.monotonic() > until:
                return let_go(best, problem, until)
            if (edge, round(back[edge], 6)) in tried:
                continue
            tried.add((edge, round(back[edge], 6)))
            left -= 1
            trial = _with(best, problem, back, best.cost)
            if trial.cost < best.cost:
                best, improving = trial, True
                break
    return let_go(best, problem, until)


def let_go(candidate: Candidate, problem: FoldProblem, until: float = math.inf) -> Candidate:
    """The same net with every crease held back only as far as it pays.

    One after the other, those held back most first, is tried without, and then with less by halves, until
    nothing more is won. It ends at ``until``, see ``time.monotonic``.
    """
    best, left = candidate, _most_nets(problem)
    if candidate.back is None:
        return candidate
    improving = True
    while improving:  # what one stood in the way of may be let go once that is
        improving = False
        assert best.back is not None  # noqa: S101 - it starts with one
        held = np.flatnonzero((best.back > 0.0) & candidate.layout.tree)
        for edge in held[np.argsort(-best.back[held], kind="stable")].tolist():
            low, high, less = 0.0, float(best.back[edge]), 0.0
            for _ in range(HALVES):
                if left <= 0 or time.monotonic() > until:
                    return best
                back = best.back.copy()
                back[edge] = less
                left -= 1
                trial = _with(best, problem, back, math.inf)
                if trial.cost < best.cost:
                    best, high, improving = trial, less, True
                    assert best.back is not None  # noqa: S101 - it was judged with one
                else:
                    low = less
                if high == 0.0:
                    break
                less = 0.5 * (low + high)
    return best


def _ways(candidate: Candidate, problem: FoldProblem) -> list[tuple[int, float]]:
    """Creases (interior edges of the goal) that may be held back, and by how much; the most useful first."""
    tree, result, layout = candidate.tree, candidate.result, candidate.layout
    missing = np.abs(tree.target) - np.minimum(np.abs(result.reached), np.abs(tree.target))
    loss = missing * (1.0 + problem.levers(tree))
    out: list[tuple[int, float]] = []
    for face in np.argsort(-loss, kind="stable").tolist():
        if result.cause[face] not in (1, 2) or missing[face] <= 1e-9:
            continue
        ends = [int(result.blocker[face]), int(result.toucher[face])]
        carriers = [f for end in ends if 0 <= end < len(tree.parent) for f in movers(layout, face, end)[0]]
        edges = dict.fromkeys(int(layout.crease[f]) for f in carriers)
        out += [(edge, step) for step in STEPS_RAD for edge in edges if not layout.graph.flat[edge]]
    return out


def _with(candidate: Candidate, problem: FoldProblem, back: NDArray[np.float64], give_up: float) -> Candidate:
    """The candidate with other creases held back; if it costs more than ``give_up``, its cost is a bound."""
    return judge(candidate.layout, problem, candidate.axis_rad, give_up, candidate.after, candidate.own, back)


def _most_nets(problem: FoldProblem) -> int:
    return min(MOST_NETS, WORK // len(problem.goal.faces))
