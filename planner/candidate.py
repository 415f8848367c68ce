"""A net as it is judged: folded by the greedy planner, and weighed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.flat_layout import FlatLayout
from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.frame_strip import frame_strip
from planner.hold_gap import hold_gap
from planner.search_moves import OwnLimit, Trial

__all__ = [
    "Candidate", "axis_angles", "by_cost", "cost", "done", "fits", "flat_tree", "held_back", "hold_cost",
    "judge",
]  # fmt: skip

OWN_ERROR = 0.25
"""What ``OwnSight`` may be wrong by besides, in cost times faces: a closing slit is seen at few angles."""

GAP_COST, CELL_COST, MOST_CELLS = 0.01, 0.004, 12
"""Cost of a net whose base nothing could hold but what the folds sweep: at all, and for each cell of that."""

OWN_SLACK = 0.5
"""A net is not folded if by ``OwnSight`` it cannot be taken up, unless it may fold better otherwise by this
share of what is missing for other reasons."""

AXIS_DIRECTIONS = 8
"""Directions of the rotary axis in the net that are tried, over half a turn."""


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

    def own_limit(self, problem: FoldProblem, bar: float, *, fixed_net: bool = False) -> OwnLimit | None:
        """What ``OwnSight`` must say of a net that may cost up to ``bar`` in place of this one.

        Where the net is given, its table would take longer than it saves.
        """
        sight = None if fixed_net else problem.own_sight
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


def by_cost(candidate: Candidate) -> float:
    """What candidates are sorted by."""
    return candidate.cost


def done(candidate: Candidate) -> bool:
    """True if every crease folds all the way."""
    return bool((candidate.result.cause == 0).all()) and math.isfinite(candidate.cost)
