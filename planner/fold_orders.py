"""What no order can fold: a bound on the angle that a beam sees, and small nets tried in every order."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.diagnosis import Proof
from planner.fold_plan import MachineLimits
from planner.fold_problem import FlatTree, FoldProblem
from planner.fold_state import LEAST_GAIN_RAD, FoldState, beams_of_side

__all__ = ["MOST_CREASES", "OrderSearch", "angle_proof", "steepest_fold", "try_all_orders"]

MOST_CREASES = 16
"""Nets with more creases are not tried in every order."""


def steepest_fold(limits: MachineLimits, along: float = 1.0) -> float:
    """Largest angle in rad to which any crease can be folded while the beam still reaches it.

    The moving face may lean over its crease up to the beam and a little beyond (``OVERHANG_RAD``). At the
    rotary angle r, parallel light lies at atan2(cos r, sin r cos w) over the parent's plane, seen along a
    crease that makes the angle w with the rotary axis. So with abs. r <= T it lies at most at
    90 degrees + atan(tan T abs. cos w), which is 90 degrees + T where the crease runs along the axis.
    Light from a point deviates from the head's axis by some angle d at most; it is no more than T + d off the
    normal of the sheet, and so, seen along any crease, at most 90 degrees + T + d over the parent's plane.

    Args:
        limits: tilt limit T (below 90 degrees), light and work area, which bounds d.
        along: abs. cos w; 1 bounds every direction of the axis.
    """
    from planner._kernels.beam_kernels import OVERHANG_RAD

    tilt = limits.max_tilt_rad
    if limits.beam_source is None:
        return 0.5 * math.pi + math.atan(math.tan(tilt) * abs(along)) + OVERHANG_RAD
    x, y, height = limits.beam_source
    radius = 0.5 * math.hypot(*limits.work_area)
    room = height - radius * math.sin(tilt)
    spread = math.atan2(radius + math.hypot(x, y), room) if room > 0.0 else 0.5 * math.pi
    return min(math.pi, 0.5 * math.pi + tilt + spread + OVERHANG_RAD)


def angle_proof(problem: FoldProblem, tree: FlatTree, face: int) -> Proof | None:
    """The proof that the crease of ``face`` is too steep for any beam, if it is."""
    if not problem.use_sight:
        return None
    wanted = abs(float(tree.target[face]))
    anywhere = steepest_fold(problem.limits)
    if wanted > anywhere + 1e-9:
        return Proof("angle", bound_rad=anywhere)
    start = tree.corners[face, tree.slot[face]]
    way = tree.corners[face, (tree.slot[face] + 1) % 3] - start
    here = steepest_fold(problem.limits, float(way @ tree.axis) / float(np.linalg.norm(way)))
    return Proof("axis", bound_rad=here) if wanted > here + 1e-9 else None


@dataclass(frozen=True)
class OrderSearch:
    """What came of trying the outside-in orders of a net.

    Attributes:
        states: states of the part that were looked at.
        exhausted: no order was left out.
        freed: faces whose creases fold fully in some order.
        beams: rotary angles that were tried for each turn.
    """

    states: int
    exhausted: bool
    freed: frozenset[int]
    beams: int


def try_all_orders(
    problem: FoldProblem,
    tree: FlatTree,
    obstacles: NDArray[np.float64] | None,
    wanted: Collection[int],
    max_states: int,
) -> OrderSearch:
    """Fold a small net in every outside-in order, each crease as far as it goes whenever its turn comes.

    A crease may turn once all creases that hang on it have had their turn and while the way to the base is
    flat; one that stopped short may turn again as long as that holds. Orders that lead to the same angles
    are followed once. Nothing else is varied: net, base, axis and obstacles stay, the beam stands at one of
    the angles of ``beams_of_side``, and no crease is left flat that could turn.

    Args:
        problem: goal, limits and rules.
        tree: the flat net.
        obstacles: solids that stand still, as in ``FoldProblem.fold``.
        wanted: faces of interest; the search ends early once all of them are freed.
        max_states: the search ends unfinished after so many states.
    """
    creases = [f for f in tree.order.tolist() if tree.target[f] != 0.0]
    tilt = problem.limits.max_tilt_rad
    beams = {top: beams_of_side(tilt, top=top) for top in (True, False)}
    freed: set[int] = set()
    goals = set(wanted)
    if len(creases) > MOST_CREASES or max_states < 1:
        return OrderSearch(0, False, frozenset(), len(beams[True]))
    above = {f: _carriers(tree, f) for f in creases}
    below = {f: [g for g in creases if f in above[g]] for f in creases}
    seen: set[tuple[frozenset[int], tuple[float, ...]]] = set()
    stack: list[tuple[FoldState, frozenset[int]]] = [(FoldState(problem, tree, obstacles), frozenset())]
    while stack:
        state, done = stack.pop()
        key = (done, tuple(np.round(state.angle[creases], 7).tolist()))
        if key in seen:
            continue
        if len(seen) >= max_states:
            return OrderSearch(len(seen), False, frozenset(freed), len(beams[True]))
        seen.add(key)
        for face in creases:
            goal, now = float(tree.target[face]), float(state.angle[face])
            if now == goal or any(g not in done for g in below[face]):
                continue
            if any(state.angle[g] != 0.0 for g in above[face]):
                continue
            to = state.reach(face, beams[goal > 0.0]).angle_rad
            if abs(to - now) < LEAST_GAIN_RAD and to != goal:
                if face not in done:
                    stack.append((state, done | {face}))
                continue
            after = state.copy()
            after.turn(face, to)
            if to == goal:
                freed.add(face)
            stack.append((after, done | {face}))
        if goals <= freed:
            return OrderSearch(len(seen), False, frozenset(freed), len(beams[True]))
    return OrderSearch(len(seen), True, frozenset(freed), len(beams[True]))


def _carriers(tree: FlatTree, face: int) -> list[int]:
    """Faces between ``face`` and the base whose creases turn it."""
    out, up = [], int(tree.parent[face])
    while up >= 0:
        if tree.target[up] != 0.0:
            out.append(up)
        up = int(tree.parent[up])
    return out
