"""Search for the net that folds best: many bases and trees first, then annealing driven by what blocks.

Every candidate is judged by the greedy fold planner with all rules on. Most moves cut a crease on the tree
path between the faces that witness a failure and join the two parts elsewhere, keeping the net overlap-free.
"""

from __future__ import annotations

import math
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
from planner.search_moves import Trial, random_trial

__all__ = [
    "Candidate", "SearchSettings", "axis_angles", "cost", "done", "flat_tree", "folding_order", "improve",
    "judge", "search",
]  # fmt: skip

KEPT, LINE = 5, 2
"""Good nets that are handed on since the sheet may not suit the best one: in all, and of each chain, whose
last nets differ little on the sheet."""

WARM, COLD = 0.01, 2e-4
"""Temperatures between which the annealing cools down, in cost."""

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
            rounds, the last of which cools down in time. Such a search depends on the machine. None: one
            round, and the result depends on the input and seed only.
    """

    chains: int
    evaluations: int
    seed: int = 0
    fixed_base: bool = False
    fixed_net: bool = False
    deadline: float | None = None

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
        bias: (F,) levels by which a face is tried earlier than its depth says; None: none.
    """

    layout: FlatLayout
    axis_rad: float
    tree: FlatTree
    result: FoldResult
    cost: float
    bias: NDArray[np.float64] | None = None


def flat_tree(layout: FlatLayout, axis_rad: float) -> FlatTree:
    """The net of ``layout`` as plain arrays, the rotary axis at ``axis_rad`` from the base's side 0 to 1."""
    corners = layout.corners.copy()
    side = corners[layout.base, 1] - corners[layout.base, 0]
    heading = math.atan2(side[1], side[0]) + axis_rad
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
    bias: NDArray[np.float64] | None = None,
) -> Candidate:
    """Fold ``layout`` inside the clamped frame and weigh what comes out, see ``cost``.

    A net whose cost is about to exceed ``give_up`` is not folded to the end; what it costs then is a bound.
    """
    tree = flat_tree(layout, axis_rad)
    rank = folding_order(tree, bias)
    frame = frame_strip(tree, problem.limits) if problem.use_substrate else None
    result = problem.fold(tree, obstacles=frame, give_up=give_up, rank=rank)
    weight = cost(result, problem) if fits(tree, problem) else math.inf
    return Candidate(layout, axis_rad, tree, result, weight, bias)


def folding_order(tree: FlatTree, bias: NDArray[np.float64] | None) -> NDArray[np.int64] | None:
    """(F,) faces in the order in which they are tried: deepest first, shifted by ``bias``; None without."""
    if bias is None:
        return None
    depth = np.zeros(len(tree.parent))
    for face in tree.order[1:].tolist():
        depth[face] = depth[tree.parent[face]] + 1.0
    return np.argsort(-(depth + bias), kind="stable")


def cost(result: FoldResult, problem: FoldProblem) -> float:
    """What the search makes small: missing angle and shape error, then overloaded creases and rotations."""
    from planner._kernels.plan_kernels import ANGLE_WEIGHT, SHAPE_WEIGHT

    relative = result.shape_rms / problem.goal.longest_side_mm
    missing = 1.0 - result.completion
    weight = SHAPE_WEIGHT * relative + ANGLE_WEIGHT * missing
    return weight + 0.05 * min(result.overload, 4.0) + 1e-5 * result.rotations


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
    total = len(layouts) + settings.chains * settings.evaluations
    axes = axis_angles(problem)
    found: list[Candidate] = []
    for number, layout in enumerate(layouts):
        if found and (settings.late or (len(found) >= KEPT and done(found[KEPT - 1]))):
            break
        both = (judge(layout, problem, axis) for axis in (axes[0], axes[len(axes) // 2]))
        found.append(min(both, key=_by_cost))
        found.sort(key=_by_cost)
        tell(number / total, f"net {number + 1} of {len(layouts)}: {found[0].result.completion:.1%} folded")
    if done(found[0]) or settings.late or settings.evaluations == 0:
        return found
    stop = threading.Event()
    shares = [0.0] * settings.chains
    began = time.monotonic()
    heads = settings.chains

    def chain(number: int) -> list[Candidate]:
        def report(step: int, best: Candidate) -> None:
            if settings.deadline is None:
                shares[number] = step / settings.evaluations
            else:
                shares[number] = (time.monotonic() - began) / max(1e-9, settings.deadline - began)
            share = (len(layouts) + sum(shares) * settings.evaluations) / total
            tell(share, f"improving the net: {best.result.completion:.1%} folded")

        line: list[Candidate] = []
        turn = 0
        while True:
            # later rounds start from the best, or from the next of the starting nets
            start = line[0] if turn % 2 else found[(number + turn * heads) % len(found)]
            seed = settings.seed + 7919 * (number + turn * heads)
            line = sorted([*improve(start, problem, replace(settings, seed=seed), report, stop), *line],
                          key=_by_cost)[:KEPT]  # fmt: skip
            turn += 1
            if settings.deadline is None or settings.late or stop.is_set() or done(line[0]):
                return line

    with ThreadPoolExecutor(settings.chains) as pool:  # the fold planner runs without the interpreter lock
        try:
            improved = list(pool.map(chain, range(heads)))
        finally:
            stop.set()
    return sorted([*(candidate for line in improved for candidate in line), *found], key=_by_cost)


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
        now = Trial(current.layout, current.axis_rad, current.bias)
        move = random_trial(
            now, current.tree, current.result, rng, axes,
            fixed_base=settings.fixed_base, fixed_net=settings.fixed_net,
        )  # fmt: skip
        if move is None:
            continue
        trial = judge(move.layout, problem, move.axis_rad, bar, move.bias)
        if trial.cost <= bar and math.isfinite(trial.cost):
            current = trial
        if trial.cost < best.cost:
            best = trial
            line = [trial, *line][:LINE]
        if on_step is not None:
            on_step(step, best)
    return line
