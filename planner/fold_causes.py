"""What stops each crease of a finished plan, measured where the plan leaves it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from planner.diagnosis import Diagnosis, View
from planner.fold_plan import Fold, FoldPlan
from planner.fold_problem import CONTACT_MARGIN_RAD, FlatTree, FoldProblem
from planner.fold_state import LEAST_GAIN_RAD, FoldState, beams_of_side
from planner.net import Net

__all__ = ["find_causes", "tree_path"]


def find_causes(
    plan: FoldPlan,
    problem: FoldProblem,
    tree: FlatTree,
    obstacles: NDArray[np.float64],
    triangles: NDArray[np.int64],
) -> dict[int, Diagnosis]:
    """Crease → why it stays short, for every blocked crease of ``plan``; no cures yet.

    The plan is replayed. A crease is looked at right after its last turn, or, if it never turns, at the last
    moment at which the way from it to the base is still flat.

    Args:
        plan: the finished plan.
        problem: its goal, limits and rules.
        tree: its net as arrays.
        obstacles: (M, 12, 3) what stays of the sheet, as solids.
        triangles: (M,) substrate triangle that each obstacle is.
    """
    net = plan.net
    turns = [(net.child_of[s.crease], s.to_rad) for s in plan.steps if isinstance(s, Fold)]
    held_back = {b.crease for b in plan.blocked if b.by == "room"}
    moments: dict[int, list[int]] = {}
    for blocked in plan.blocked:
        face = net.child_of[blocked.crease]
        moments.setdefault(_moment(net, face, turns), []).append(face)
    levers = problem.levers(tree)
    state = FoldState(problem, tree, obstacles)
    found: dict[int, Diagnosis] = {}
    for number in range(len(turns) + 1):
        for face in moments.get(number, ()):
            missing = abs(float(tree.target[face])) - abs(float(plan.final_angles[net.crease_of[face]]))
            crease, loss_mm = int(net.crease_of[face]), max(0.0, missing) * float(levers[face])
            if crease in held_back:
                found[crease] = Diagnosis("room", float(plan.final_angles[crease]), loss_mm=loss_mm)
            else:
                found[crease] = _cause(net, state, face, triangles, loss_mm)
        if number < len(turns):
            state.turn(*turns[number])
    return found


def tree_path(net: Net, one: int, other: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Faces on the way through the net from one face to another, and the creases between them."""
    ups: dict[int, int] = {}
    face = one
    while face >= 0:
        ups[face] = len(ups)
        face = int(net.parent[face])
    down = [other]
    while down[-1] not in ups:
        down.append(int(net.parent[down[-1]]))
    up = list(ups)[: ups[down[-1]] + 1]
    faces = (*up, *reversed(down[:-1]))
    creases = tuple(int(net.crease_of[a if int(net.parent[a]) == b else b]) for a, b in pairwise(faces))
    return faces, creases


def _moment(net: Net, face: int, turns: list[tuple[int, float]]) -> int:
    """How many turns have been made when the crease of ``face`` is looked at."""
    own = [number for number, (turned, _) in enumerate(turns) if turned == face]
    if own:
        return own[-1] + 1
    carriers, up = set(), int(net.parent[face])
    while up >= 0:
        carriers.add(up)
        up = int(net.parent[up])
    return next((number for number, (turned, _) in enumerate(turns) if turned in carriers), len(turns))


def _cause(net: Net, state: FoldState, face: int, triangles: NDArray[np.int64], loss_mm: float) -> Diagnosis:
    """Why the crease of ``face`` goes no further in ``state``."""
    problem, goal = state.problem, float(state.tree.target[face])
    beams = beams_of_side(problem.limits.max_tilt_rad, top=goal > 0.0)
    views = _views(state, face, beams)
    reach = state.reach(face, beams).angle_rad
    if abs(goal - reach) < 1e-9:
        return Diagnosis("order", reach, views=views, loss_mm=loss_mm)
    ahead = state.copy()
    ahead.turn(face, reach)
    if problem.use_contact:
        met = ahead.contact(face, goal)
        if met.still >= 0 and met.free_rad <= CONTACT_MARGIN_RAD + LEAST_GAIN_RAD:
            at = reach + math.copysign(met.free_rad, goal)
            if met.still >= state.faces:
                triangle = int(triangles[met.still - state.faces])
                return Diagnosis("substrate", at, triangle, met.moving, views=views, loss_mm=loss_mm)
            faces, creases = tree_path(net, met.moving, met.still)
            return Diagnosis("contact", at, met.still, met.moving, False, views, faces, creases, loss_mm)
    past_flap = ahead.views(face, goal, beams)[:, 3] > abs(reach) + LEAST_GAIN_RAD
    own = View(float(beams[0]), reach, 1.0, face)
    parent = int(net.parent[face])
    if not past_flap.any():
        faces, creases = tree_path(net, parent, face)
        return Diagnosis("own flap", reach, face, -1, True, views or (own,), faces, creases, loss_mm)
    table = ahead.views(face, goal, beams[past_flap])
    best = int(np.lexsort((np.arange(len(table)), table[:, 1], -table[:, 0]))[0])
    blocker = int(table[best, 2])
    carried = blocker in ahead.members(face).tolist()
    faces, creases = tree_path(net, parent if carried else face, blocker)
    view = View(float(beams[past_flap][best]), reach, float(table[best, 1]), blocker)
    both = (*(v for v in views[:1] if v.rotary_rad != view.rotary_rad), view)
    return Diagnosis("sight", reach, blocker, -1, carried, both, faces, creases, loss_mm)


def _views(state: FoldState, face: int, beams: NDArray[np.float64]) -> tuple[View, ...]:
    """How the crease is seen from where it stands: under the straight beam, and under the best tilt."""
    if not state.problem.use_sight:
        return ()
    goal, now = float(state.tree.target[face]), float(state.angle[face])
    table = state.views(face, goal, beams)
    best = int(np.lexsort((np.arange(len(table)), -np.round(table[:, 0], 9)))[0])
    return tuple(
        View(
            float(beams[k]), now + math.copysign(max(0.0, float(table[k, 0])), goal), float(table[k, 1]),
            int(table[k, 2]),
        )
        for k in dict.fromkeys((0, best))
    )  # fmt: skip
