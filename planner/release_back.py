"""Creases that were held back are let go again, as far as that costs nothing elsewhere."""

from __future__ import annotations

import numpy as np

from planner.fold_problem import FoldProblem
from planner.fold_search import Candidate, judge

__all__ = ["release_back"]

HALVES = 4
"""How often the angle by which a crease is held back is halved at most, between nothing and what it is."""

MOST_NETS = 40
"""Nets folded at most."""


def release_back(candidate: Candidate, problem: FoldProblem) -> Candidate:
    """The same net with every crease held back only as far as it pays; the candidate if all pay.

    Held back are creases by random angles, which may be more than what the others need. One after the other,
    those held back most first, is tried without, and then with less by halves.

    Args:
        candidate: the net as judged.
        problem: goal and limits.
    """
    best, folded = candidate, 0
    if candidate.back is None:
        return candidate
    held = np.flatnonzero((candidate.back > 0.0) & candidate.layout.tree)
    for edge in held[np.argsort(-candidate.back[held], kind="stable")].tolist():
        low, high, less = 0.0, float(candidate.back[edge]), 0.0
        for _ in range(HALVES):
            if folded >= MOST_NETS:
                return best
            assert best.back is not None  # noqa: S101 - it starts with one
            back = best.back.copy()
            back[edge] = less
            trial = judge(best.layout, problem, best.axis_rad, best.cost, best.after, best.own, back)
            folded += 1
            if trial.cost < best.cost:
                best, high = trial, less
            else:
                low = less
            if high == 0.0:
                break
            less = 0.5 * (low + high)
    return best
