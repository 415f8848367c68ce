"""Contacts of one draw: the folds replayed with the drawn angles, by the planner's exact contact kernel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Bend, Clip, FoldPlan
from planner.fold_problem import FoldProblem
from planner.fold_state import FoldState
from planner.insets import edge_insets
from planner.plan_on_sheet import tree_of_net
from planner.sheet_hits import sheet_solids
from twin.scatter_draws import FoldTurn

__all__ = ["Collision", "ContactReplay", "Replayed"]


class Collision(NamedTuple):
    """The first contact of a draw that is no seam.

    Attributes:
        step: of the plan.
        moving: face that turns.
        still: face, or triangle of the substrate, that it meets.
        in_substrate: ``still`` is a triangle of the substrate.
        angle_rad: fold angle of the turning crease at contact.
    """

    step: int
    moving: int
    still: int
    in_substrate: bool
    angle_rad: float


@dataclass(frozen=True)
class Replayed:
    """What happened in one draw.

    Attributes:
        collision: the first one, None if there is none.
        seam_touches: pairs that met on their common seam before that.
    """

    collision: Collision | None
    seam_touches: int


class ContactReplay:
    """Folds a plan with other angles than planned, and says what meets first.

    The solids are those that the planner keeps apart: prisms set in by the clearance and the mitre. Two faces
    whose flat panels share a corner of the goal close on each other at the end anyhow: where they meet early
    it is a touch of a seam, which is counted and no collision. Bent substrate counts as gone.

    Args:
        plan: the plan.
        turns: its fold steps, from ``fold_turns``.
        sheet: the substrate can be hit; False shows what wider clips could gain at most.
    """

    def __init__(self, plan: FoldPlan, turns: Sequence[FoldTurn], *, sheet: bool = True) -> None:
        net, limits = plan.net, plan.limits
        insets = edge_insets(net, limits.thickness, limits.clearance)
        problem = FoldProblem(net.goal, insets, limits)
        tree = tree_of_net(net)
        self.faces = len(net.faces)
        self.start = FoldState(problem, tree, sheet_solids(plan.sheet, limits.thickness))
        self.start.present[self.faces :] = sheet
        self.turns = tuple(turns)
        self.child = [int(net.child_of[t.crease]) for t in turns]
        gone: dict[int, list[int]] = {}
        at = [t.step for t in turns]
        for number, step in enumerate(plan.steps):
            if isinstance(step, (Clip, Bend)):
                turn = int(np.searchsorted(at, number))
                gone.setdefault(turn, []).extend(self.faces + f for f in step.faces)
        self.gone = gone
        self.meets = _meeting_panels(self.start.panel[: self.faces], net.goal.faces)

    def first(self, angles_rad: NDArray[np.float64]) -> Replayed:
        """Replay one draw up to its first collision.

        Args:
            angles_rad: (T,) fold angle of the crease after every turn.
        """
        state = self.start.copy()
        state.present = state.present.copy()
        touches: set[tuple[int, int]] = set()
        for n, (turn, face) in enumerate(zip(self.turns, self.child, strict=True)):
            for solid in self.gone.get(n, ()):
                state.present[solid] = False
            to_rad = float(angles_rad[n])
            change = to_rad - float(state.angle[face])
            parts = 1 if abs(change) <= 3.0 else 2  # the kernel turns by up to half a turn
            for part in range(1, parts + 1):
                goal = to_rad if part == parts else float(state.angle[face]) + change / parts
                found = self._first_of_turn(state, face, goal, touches)
                if found is not None:
                    free, moving, still = found
                    at = float(state.angle[face]) + math.copysign(free, change)
                    solid = still - self.faces if still >= self.faces else still
                    hit = Collision(turn.step, moving, solid, still >= self.faces, at)
                    return Replayed(hit, len(touches))
                state.turn(face, goal)
        return Replayed(None, len(touches))

    def _first_of_turn(
        self, state: FoldState, face: int, to_rad: float, touches: set[tuple[int, int]]
    ) -> tuple[float, int, int] | None:
        """(angle, moving face, still solid) of the first contact of a turn that is no seam."""
        from planner._kernels.contact_kernels import turn_contact

        change = to_rad - float(state.angle[face])
        if abs(change) < 1e-12:
            return None
        ox, oy, ux, uy = (float(x) for x in state.hinges[face])
        sign = math.copysign(1.0, change)
        mask, work = np.zeros(len(state.solids), np.bool_), np.empty((30, 3))
        limit, best = abs(change), None
        # Where a seam is met, the pairs without that one pair are looked at again, in two parts.
        todo: list[tuple[NDArray[np.int64], NDArray[np.bool_]]] = [(state.members(face), state.present)]
        moving_all = state.members(face)
        while todo:
            members, present = todo.pop()
            if len(members) != len(moving_all):
                present = present.copy()
                present[moving_all] = False
            free, moving, still = turn_contact(
                face, int(state.tree.parent[face]), members, mask, state.solids, state.centres, state.radii,
                state.sharp, present, ox, oy, sign * ux, sign * uy, limit, work,
            )  # fmt: skip
            if still < 0:
                continue
            moving, still = int(moving), int(still)
            if still < self.faces and self.meets[moving, still]:
                touches.add((min(moving, still), max(moving, still)))
                others = present.copy()
                others[still] = False
                if len(members) > 1:
                    todo.append((members[members != moving], present))
                todo.append((members[members == moving], others))
                continue
            limit, best = float(free), (float(free), moving, still)
        return best


def _meeting_panels(panel: NDArray[np.int64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F, F) True where the flat panels of two faces share a corner of the goal."""
    corners = np.zeros((len(faces), int(faces.max()) + 1), dtype=np.bool_)
    np.logical_or.at(corners, (np.repeat(panel, 3), faces.ravel()), True)
    shared = (corners.astype(np.float32) @ corners.T.astype(np.float32)) > 0.0
    meets: NDArray[np.bool_] = shared[np.ix_(panel, panel)]
    return meets
