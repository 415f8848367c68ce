"""Search for the net that folds best: many bases and trees first, then annealing driven by what blocks.

Every candidate is judged by the greedy fold planner with all rules on. Most moves cut a crease on the tree
path between the faces that witness a failure and join the two parts elsewhere, keeping the net overlap-free.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from planner.candidate import Candidate, axis_angles, by_cost, done, judge
from planner.flat_layout import FlatLayout
from planner.fold_problem import FoldProblem
from planner.processors import processors, side_by_side
from planner.search_moves import random_trial

__all__ = ["SEED_STEP", "SearchSettings", "improve", "search"]

KEPT, LINE = 5, 2
"""Good nets that are handed on since the sheet may not suit the best one: in all, and of each chain, whose
last nets differ little on the sheet."""

SEED_STEP = 7919
"""Distance between the seeds of the chains."""

WARM, COLD = 0.01, 2e-4
"""Temperatures between which the annealing cools down, in cost."""

MOST_OWN_MOVES, OWN_WORK = 20_000, 2_000_000
"""Changes of each starting net that are judged by ``OwnSight`` alone: the work over the number of faces, but
not more than the limit."""

STARTS_SHARE = 0.15
"""Where there is a deadline: share of the time for the starting nets at most."""

ROUND_NETS, MOST_ROUNDS = 2500, 6
"""Nets that a chain is to fold before it starts afresh, and how often it anneals at most."""

HEAT_NETS, LEAST_HEATS, MOST_HEATS, HEATS_SHARE = 300, 3, 12, 0.35
"""Where there is a deadline: nets of a short annealing that tells which starts are worth a long one; how many
of those each chain makes, none if there is no time for the least; and their share of the time at most."""

HEAT_COLD, AGAIN_WARM = 1e-3, 0.005
"""Temperatures at which a short annealing ends, and at which the long one after it starts, in cost."""


@dataclass(frozen=True)
class SearchSettings:
    """How much is tried.

    Attributes:
        chains: best of the starting nets that are improved by annealing.
        evaluations: nets judged in a chain, or in each of its rounds if there is a deadline.
        seed: of every random choice.
        fixed_base: keep the base faces of the starting nets.
        fixed_net: keep the whole starting nets; only the axis and the order of folding change.
        deadline: ``time.monotonic()`` at which the search stops with what it has; until then it anneals in
            rounds, each of which cools down in its time. Such a search depends on the machine. None: one
            round, and the result depends on the input and seed only.
        grace_s: where there is a deadline, how long the repair of angles may take after it.
        warm, cold: temperatures between which the annealing cools down, in cost.
    """

    chains: int
    evaluations: int
    seed: int = 0
    fixed_base: bool = False
    fixed_net: bool = False
    deadline: float | None = None
    grace_s: float = 0.0
    warm: float = WARM
    cold: float = COLD

    @property
    def repair_until(self) -> float:
        """``time.monotonic()`` until which angles may be repaired, from now on."""
        return math.inf if self.deadline is None else time.monotonic() + self.grace_s

    @property
    def late(self) -> bool:
        """True once the time is up."""
        return self.deadline is not None and time.monotonic() > self.deadline

    def share(self, work: float, began: float) -> float:
        """How much of an annealing is over, 0 to 1, with so much of its ``work`` done since it ``began``."""
        if self.deadline is None:
            return min(1.0, work)
        spent = (time.monotonic() - began) / max(1e-9, self.deadline - began)
        return min(1.0, max(work, spent))


def search(
    layouts: list[FlatLayout],
    problem: FoldProblem,
    settings: SearchSettings,
    on_progress: Callable[[float, str], None] | None = None,
) -> list[Candidate]:
    """Nets that fold well, the best first, found from the given overlap-free starting nets.

    Args:
        layouts: starting nets, in order of promise; all are judged.
        problem: goal and limits.
        settings: how much is tried.
        on_progress: called with the share done and a line of words.

    Returns:
        The starting nets as judged and what became of the improved ones, sorted by cost; never empty.
    """
    tell = on_progress or (lambda _share, _words: None)
    began = time.monotonic()
    total = len(layouts) + settings.chains * settings.evaluations
    found = _judged(layouts, problem, settings, lambda k, words: tell(k / total, words))
    if done(found[0]) or settings.late or settings.evaluations == 0:
        return found
    stop = threading.Event()
    shares = [0.0] * settings.chains
    lines: list[list[Candidate]] = [[] for _ in range(settings.chains)]

    def report(number: int, step: int, best: Candidate) -> None:
        shares[number] = step / settings.evaluations
        share = (len(layouts) + sum(shares) * settings.evaluations) / total
        if settings.deadline is not None:
            share = (time.monotonic() - began) / max(1e-9, settings.deadline - began)
        tell(share, f"improving the net: {best.result.completion:.1%} folded")

    def anneal(number: int, start: Candidate, now: SearchSettings) -> Candidate:
        made = improve(start, problem, now, lambda step, best: report(number, step, best), stop)
        lines[number] = sorted([*made, *lines[number]], key=by_cost)[:KEPT]
        return made[0]

    def turns(starts: list[Candidate], count: int, until: float, now: SearchSettings) -> list[Candidate]:
        """The best net of each annealing, best first: ``count`` in each chain, from ``starts`` in turn."""
        first = time.monotonic()
        made = []

        def chain(number: int) -> None:
            for turn in range(count):
                if stop.is_set() or settings.late or any(line and done(line[0]) for line in lines):
                    return
                which = number + turn * settings.chains
                end = first + (turn + 1) / count * (until - first)
                made.append(anneal(number, starts[which % len(starts)], replace(
                    now, seed=now.seed + SEED_STEP * which, evaluations=sys.maxsize, deadline=end,
                )))  # fmt: skip

        list(pool.map(chain, range(settings.chains)))
        return sorted(made, key=by_cost)

    with ThreadPoolExecutor(settings.chains) as pool:  # the fold planner runs without the interpreter lock
        try:
            if settings.deadline is None:
                list(pool.map(
                    lambda k: anneal(
                        k, found[k % len(found)], replace(settings, seed=settings.seed + SEED_STEP * k)
                    ),
                    range(settings.chains),
                ))  # fmt: skip
            else:
                rate = _nets_a_second(found[0], problem, settings)
                starts, now = found, time.monotonic()
                time_left = settings.deadline - now
                heats = min(MOST_HEATS, int(HEATS_SHARE * time_left * rate / HEAT_NETS))
                long = settings
                if heats >= LEAST_HEATS:
                    until = now + heats * HEAT_NETS / rate
                    starts = turns(found, heats, until, replace(settings, cold=HEAT_COLD)) or found
                    long = replace(settings, seed=settings.seed + 1, warm=AGAIN_WARM)
                rounds = int((settings.deadline - time.monotonic()) * rate / ROUND_NETS)
                turns(starts, max(1, min(MOST_ROUNDS, rounds)), settings.deadline, long)
        finally:
            stop.set()
    return sorted([*(candidate for line in lines for candidate in line), *found], key=by_cost)


def _nets_a_second(start: Candidate, problem: FoldProblem, settings: SearchSettings) -> float:
    """How many nets a chain folds in a second: each takes about as long as a fold without known turns."""
    problem.forget()
    began = time.monotonic()
    problem.fold(start.tree)
    one = max(1e-4, time.monotonic() - began)
    return min(settings.chains, processors()) / (one * settings.chains)


def _judged(
    layouts: list[FlatLayout],
    problem: FoldProblem,
    settings: SearchSettings,
    on_net: Callable[[int, str], None],
) -> list[Candidate]:
    """The starting nets as they are, and what ``OwnSight`` makes of each, sorted by cost."""
    axes = axis_angles(problem)
    moves = min(MOST_OWN_MOVES, OWN_WORK // len(problem.goal.faces))
    began = time.monotonic()
    own_sight = problem.own_sight  # worked out before several threads ask for it

    def start_from(number: int) -> list[Candidate]:
        layout = layouts[number]
        both = (judge(layout, problem, axis) for axis in (axes[0], axes[len(axes) // 2]))
        start = min(both, key=by_cost)
        if own_sight is None or done(start):
            return [start]
        rng = np.random.default_rng((settings.seed, number))
        made = own_sight.anneal(layout, start.axis_rad, moves, rng, fixed_base=settings.fixed_base)
        return [start, judge(made.layout, problem, made.axis_rad, own=made.cost)]

    found: list[Candidate] = []
    for number, made in enumerate(side_by_side(start_from, range(len(layouts)))):
        found = sorted([*found, *made], key=by_cost)
        on_net(number, f"net {number + 1} of {len(layouts)}: {found[0].result.completion:.1%} folded")
        enough = settings.deadline is not None and settings.share(0.0, began) > STARTS_SHARE
        if enough or (len(found) >= KEPT and done(found[KEPT - 1])):
            break
    return found


def improve(
    start: Candidate,
    problem: FoldProblem,
    settings: SearchSettings,
    on_step: Callable[[int, Candidate], None] | None = None,
    stop: threading.Event | None = None,
) -> list[Candidate]:
    """Anneal one net: exchange creases on the paths between faces that block each other.

    Source: the co-design of net and plan by simulated annealing; the temperature falls
    geometrically. ``stop`` ends it from another thread.

    Returns:
        The last few improvements, the best first; the start alone if nothing was better.
    """
    rng = np.random.default_rng(settings.seed)
    axes = axis_angles(problem)
    current, best = start, start
    line = [start]
    began = time.monotonic()
    for step in range(settings.evaluations):
        if done(best) or settings.late or (stop is not None and stop.is_set()):
            break
        share = settings.share(step / max(1, settings.evaluations - 1), began)
        temperature = settings.warm * (settings.cold / settings.warm) ** share
        # the cost that would still be accepted, drawn beforehand so that hopeless nets can be given up
        bar = current.cost - temperature * math.log(1.0 - rng.random())
        move = random_trial(
            current.trial, current.tree, current.result, rng, axes, fixed_base=settings.fixed_base,
            fixed_net=settings.fixed_net, own=current.own_limit(problem, bar, fixed_net=settings.fixed_net),
        )  # fmt: skip
        if move is None:
            continue
        trial = judge(move.layout, problem, move.axis_rad, bar, move.after, move.own, move.back)
        if trial.cost <= bar and math.isfinite(trial.cost):
            current = trial
        if trial.cost < best.cost:
            best = trial
            line = [trial, *line][:LINE]
        if on_step is not None:
            on_step(step, best)
    return line
