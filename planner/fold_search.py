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
from numpy.typing import NDArray

from planner.flat_layout import FlatLayout
from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.frame_strip import frame_strip
from planner.hold_gap import hold_gap
from planner.processors import processors, side_by_side
from planner.search_moves import OwnLimit, Trial, random_trial

__all__ = [
    "SEED_STEP", "Candidate", "SearchSettings", "axis_angles", "cost", "done", "flat_tree",
    "held_back", "improve",    "judge", "search",
]  # fmt: skip

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

OWN_ERROR = 0.25
"""What ``OwnSight`` may be wrong by besides, in cost times faces: a closing slit is seen at few angles."""

GAP_COST, CELL_COST, MOST_CELLS = 0.01, 0.004, 12
"""Cost of a net whose base nothing could hold but what the folds sweep: at all, and for each cell of that."""

STARTS_SHARE = 0.15
"""Where there is a deadline: share of the time for the starting nets at most."""

ROUND_NETS, MOST_ROUNDS = 2500, 6
"""Nets that a chain is to fold before it starts afresh, and how often it anneals at most."""

OWN_SLACK = 0.5
"""A net is not folded if by ``OwnSight`` it cannot be taken up, unless it may fold better otherwise by this
share of what is missing for other reasons."""

AXIS_DIRECTIONS = 8
"""Directions of the rotary axis in the net that are tried, over half a turn."""


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
    """

    chains: int
    evaluations: int
    seed: int = 0
    fixed_base: bool = False
    fixed_net: bool = False
    deadline: float | None = None
    grace_s: float = 0.0

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


@dataclass(frozen=True, eq=False)
class Candidate:
    """A net as laid out, the rotary axis in it, and how well it folds.

    Attributes:
        layout: the overlap-free layout; never changed once judged.
        axis_rad: direction of the rotary axis, measured from the base face's side from corner 0 to corner 1.
        tree: the net as plain arrays.
        result: what the greedy planner reached.
        cost: what the search makes small; infinite if the sheet does not fit the machine.
        after: (F,) for each face another whose crease is to be folded before, -1: none; None: none at all.
        own: the part of the cost that ``OwnSight`` sees; 0 if nobody asked.
        back: (M,) angle, rad, by which the crease at each interior edge of the goal is held back; None: none.
    """

    layout: FlatLayout
    axis_rad: float
    tree: FlatTree
    result: FoldResult
    cost: float
    after: NDArray[np.int64] | None = None
    own: float = 0.0
    back: NDArray[np.float64] | None = None

    @property
    def trial(self) -> Trial:
        """What was judged."""
        return Trial(self.layout, self.axis_rad, self.after, self.own, self.back)

    @property
    def held_back(self) -> NDArray[np.float64] | None:
        """(F,) ``back`` at the crease of each face, as ``FoldProblem.fold`` wants it."""
        return None if self.back is None else held_back(self.layout, self.back)

    def own_limit(self, problem: FoldProblem, bar: float, settings: SearchSettings) -> OwnLimit | None:
        """What ``OwnSight`` must say of a net that may cost up to ``bar`` in place of this one.

        Where the net is given, its table would take longer than it saves.
        """
        sight = None if settings.fixed_net else problem.own_sight
        if sight is None:
            return None
        other = OWN_SLACK * max(0.0, self.cost - self.own)
        return OwnLimit(sight, self.own + bar - self.cost + other + OWN_ERROR / len(self.tree.parent))


def flat_tree(layout: FlatLayout, axis_rad: float) -> FlatTree:
    """The net of ``layout`` as plain arrays, the rotary axis at ``axis_rad`` from the base's side 0 to 1."""
    corners = layout.corners
    heading = layout.heading + axis_rad
    axis = np.array([math.cos(heading), math.sin(heading)])
    points = corners.reshape(-1, 2)
    along, across = points @ axis, points @ np.array([-axis[1], axis[0]])
    middle = 0.5 * (along.min() + along.max()), 0.5 * (across.min() + across.max())
    return FlatTree(
        base=layout.base,
        parent=layout.parent.copy(),
        slot=layout.slot.copy(),
        order=layout.order.copy(),
        corners=corners,
        target=layout.target,
        axis=axis,
        origin=(
            float(middle[0] * axis[0] - middle[1] * axis[1]),
            float(middle[0] * axis[1] + middle[1] * axis[0]),
        ),
    )


def judge(
    layout: FlatLayout,
    problem: FoldProblem,
    axis_rad: float,
    give_up: float = math.inf,
    after: NDArray[np.int64] | None = None,
    own: float | None = None,
    back: NDArray[np.float64] | None = None,
) -> Candidate:
    """Fold ``layout`` inside the clamped frame and weigh what comes out, see ``cost``.

    A net whose cost is about to exceed ``give_up`` is not folded to the end; what it costs then is a bound.
    ``own`` is what ``OwnSight`` says of it, if that is known already; the others are as in ``Candidate``.
    """
    tree = flat_tree(layout, axis_rad)
    frame = frame_strip(tree, problem.limits) if problem.use_substrate else None
    less = None if back is None else held_back(layout, back)
    result = problem.fold(tree, obstacles=frame, give_up=give_up, after=after, back=less)
    weight = cost(result, problem) if fits(tree, problem) else math.inf
    if weight <= give_up and math.isfinite(weight) and problem.use_held and problem.use_substrate:
        weight += hold_cost(hold_gap(tree, result, problem, layout))
    if own is None:
        own = 0.0 if problem.own_sight is None else problem.own_sight.cost(layout, axis_rad)[0]
    return Candidate(layout, axis_rad, tree, result, weight, after, own, back)


def held_back(layout: FlatLayout, back: NDArray[np.float64]) -> NDArray[np.float64]:
    """(F,) angle by which the crease of each face is held back, from (M,) those at each interior edge."""
    return np.where(layout.crease >= 0, back[layout.crease], 0.0)


def hold_cost(gap: int) -> float:
    """What it costs a net that its folds sweep all the sheet that could hold its base, see ``hold_gap``."""
    if gap == 0:
        return 0.0
    return GAP_COST + CELL_COST * min(gap, MOST_CELLS) if gap > 0 else GAP_COST + CELL_COST * MOST_CELLS


def cost(result: FoldResult, problem: FoldProblem) -> float:
    """What the search makes small: missing angle and shape error, then overloaded creases and rotations."""
    from planner._kernels.plan_kernels import ANGLE_WEIGHT, MOST_OVERLOAD, OVERLOAD_WEIGHT, SHAPE_WEIGHT

    relative = result.shape_rms / problem.goal.longest_side_mm
    missing = 1.0 - result.completion
    weight = SHAPE_WEIGHT * relative + ANGLE_WEIGHT * missing
    return weight + OVERLOAD_WEIGHT * min(result.overload, MOST_OVERLOAD) + 1e-5 * result.rotations


def fits(tree: FlatTree, problem: FoldProblem) -> bool:
    """True if the sheet for this net fits the work area with the rotary axis along ``tree.axis``."""
    points = tree.corners.reshape(-1, 2)
    along = points @ tree.axis
    across = points @ np.array([-tree.axis[1], tree.axis[0]])
    room = 2.0 * (problem.limits.frame_margin + 6.0)
    width, depth = problem.limits.work_area
    return bool(np.ptp(along) + room <= width and np.ptp(across) + room <= depth)


def axis_angles(problem: FoldProblem) -> list[float]:
    """Directions of the rotary axis that are tried, rad; with flips alone the direction hardly matters."""
    count = AXIS_DIRECTIONS if problem.limits.max_tilt_rad > 0.0 else 2
    return [math.pi * k / count for k in range(count)]


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
    annealing = time.monotonic()
    lines: list[list[Candidate]] = [[] for _ in range(settings.chains)]
    rounds = 1
    if settings.deadline is not None:
        problem.forget()
        problem.fold(
            found[0].tree
        )  # takes about as long, of a net without any turn known, as a net in a chain
        one = (time.monotonic() - annealing) * settings.chains / min(settings.chains, processors())
        rounds = int((settings.deadline - annealing) / (ROUND_NETS * max(1e-4, one)))
        rounds = max(1, min(MOST_ROUNDS, rounds))

    def report(number: int, step: int, best: Candidate) -> None:
        shares[number] = step / settings.evaluations
        share = (len(layouts) + sum(shares) * settings.evaluations) / total
        if settings.deadline is not None:
            share = (time.monotonic() - began) / max(1e-9, settings.deadline - began)
        tell(share, f"improving the net: {best.result.completion:.1%} folded")

    def anneal(number: int, start: Candidate, now: SearchSettings) -> None:
        made = improve(start, problem, now, lambda step, best: report(number, step, best), stop)
        lines[number] = sorted([*made, *lines[number]], key=_by_cost)[:KEPT]

    def chain(number: int) -> None:
        if settings.deadline is None:
            now = replace(settings, seed=settings.seed + SEED_STEP * number)
            anneal(number, found[number % len(found)], now)
            return
        for turn in range(rounds):
            if stop.is_set() or settings.late or any(line and done(line[0]) for line in lines):
                return
            which = number + turn * settings.chains
            until = annealing + (turn + 1) / rounds * (settings.deadline - annealing)
            anneal(number, found[which % len(found)], replace(
                settings, seed=settings.seed + SEED_STEP * which, evaluations=sys.maxsize, deadline=until,
            ))  # fmt: skip

    with ThreadPoolExecutor(settings.chains) as pool:  # the fold planner runs without the interpreter lock
        try:
            list(pool.map(chain, range(settings.chains)))
        finally:
            stop.set()
    return sorted([*(candidate for line in lines for candidate in line), *found], key=_by_cost)


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
        start = min(both, key=_by_cost)
        if own_sight is None or done(start):
            return [start]
        rng = np.random.default_rng((settings.seed, number))
        made = own_sight.anneal(layout, start.axis_rad, moves, rng, fixed_base=settings.fixed_base)
        return [start, judge(made.layout, problem, made.axis_rad, own=made.cost)]

    found: list[Candidate] = []
    for number, made in enumerate(side_by_side(start_from, range(len(layouts)))):
        found = sorted([*found, *made], key=_by_cost)
        on_net(number, f"net {number + 1} of {len(layouts)}: {found[0].result.completion:.1%} folded")
        enough = settings.deadline is not None and settings.share(0.0, began) > STARTS_SHARE
        if enough or (len(found) >= KEPT and done(found[KEPT - 1])):
            break
    return found


def _by_cost(candidate: Candidate) -> float:
    return candidate.cost


def done(candidate: Candidate) -> bool:
    """True if every crease folds all the way."""
    return bool((candidate.result.cause == 0).all()) and math.isfinite(candidate.cost)


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
        temperature = WARM * (COLD / WARM) ** settings.share(step / max(1, settings.evaluations - 1), began)
        # the cost that would still be accepted, drawn beforehand so that hopeless nets can be given up
        bar = current.cost - temperature * math.log(1.0 - rng.random())
        move = random_trial(
            current.trial, current.tree, current.result, rng, axes, fixed_base=settings.fixed_base,
            fixed_net=settings.fixed_net, own=current.own_limit(problem, bar, settings),
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
