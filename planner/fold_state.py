"""A net in the middle of being folded: turn a crease, ask how far one could turn and what stops it.

The fold planner asks the same questions inside its kernel; here they can be asked one by one, of any state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_problem import (
    CONTACT_MARGIN_RAD,
    SIGHT_RESERVE,
    FlatTree,
    FoldProblem,
    bounding_spheres,
    panel_numbers,
)

__all__ = ["BEAMS_EACH_SIDE", "Contact", "FoldState", "Reach", "beams_of_side"]

BEAMS_EACH_SIDE = 12
"""Tilts to each side, in even steps up to the limit, under which a crease is looked at."""

LEAST_GAIN_RAD = math.radians(0.2)
"""A further stage of a turn that gains less is not made."""


def beams_of_side(max_tilt_rad: float, *, top: bool) -> NDArray[np.float64]:
    """(K,) rotary angles, rad, with the top side (or the bottom side) up, the straight one first."""
    tilts = np.zeros(1)
    if max_tilt_rad > 1e-9:
        even = max_tilt_rad * np.arange(1, BEAMS_EACH_SIDE + 1) / BEAMS_EACH_SIDE
        tilts = np.concatenate([tilts, np.stack([even, -even], axis=1).ravel()])
    return tilts if top else np.pi + tilts


@dataclass(frozen=True)
class Contact:
    """First contact of a turn: free angle in rad, solid of the moving part, solid it touches (-1: none)."""

    free_rad: float
    moving: int
    still: int


@dataclass(frozen=True)
class Reach:
    """How far a crease comes with contact and sight: angle, and turns (rotary angle, angle reached)."""

    angle_rad: float
    turns: tuple[tuple[float, float], ...]


class FoldState:
    """One net at some moment of its folding, among obstacles that stand still.

    Args:
        problem: goal, limits and rules.
        tree: the flat net.
        obstacles: (M, 12, 3) solids as in ``FoldProblem.fold``.
    """

    def __init__(
        self, problem: FoldProblem, tree: FlatTree, obstacles: NDArray[np.float64] | None = None
    ) -> None:
        self.problem, self.tree = problem, tree
        self.faces = len(tree.parent)
        solids = problem.solids(tree)
        sharp = problem.sharp
        if obstacles is not None and len(obstacles):
            solids = np.concatenate([solids, obstacles])
            sharp = np.concatenate([sharp, np.zeros(len(obstacles), dtype=np.bool_)])
        self.solids, self.sharp = solids, sharp
        self.centres, self.radii = bounding_spheres(solids)
        self.flat = np.ones(len(solids), dtype=np.bool_)
        self.present = np.ones(len(solids), dtype=np.bool_)
        self.panel = panel_numbers(tree, len(solids))
        self.preorder, self.first, self.last = tree.subtrees
        self.hinges, self.lengths = tree.hinge_lines
        self.angle = np.zeros(self.faces)

    def copy(self) -> FoldState:
        """The same state, to be folded on independently."""
        twin = object.__new__(FoldState)
        twin.__dict__.update(self.__dict__)
        twin.solids, twin.centres = self.solids.copy(), self.centres.copy()
        twin.flat, twin.angle = self.flat.copy(), self.angle.copy()
        return twin

    def members(self, face: int) -> NDArray[np.int64]:
        """Faces that turn with the crease of ``face``, itself among them."""
        turning: NDArray[np.int64] = self.preorder[self.first[face] : self.last[face]]
        return turning

    def turn(self, face: int, to_rad: float) -> None:
        """Turn the crease of ``face`` to the signed angle ``to_rad``."""
        from planner._kernels.plan_kernels import turn_solids

        members = self.members(face)
        ox, oy, ux, uy = (float(x) for x in self.hinges[face])
        turn_solids(self.solids, self.centres, members, ox, oy, ux, uy, float(to_rad - self.angle[face]))
        self.flat[members] = False
        self.angle[face] = to_rad

    def contact(self, face: int, to_rad: float) -> Contact:
        """First contact when the crease of ``face`` turns from where it stands to ``to_rad``."""
        from planner._kernels.contact_kernels import turn_contact

        change = to_rad - float(self.angle[face])
        if abs(change) < 1e-12:
            return Contact(0.0, -1, -1)
        ox, oy, ux, uy = (float(x) for x in self.hinges[face])
        sign = math.copysign(1.0, change)
        free, moving, still = turn_contact(
            face, int(self.tree.parent[face]), self.members(face), np.zeros(len(self.solids), np.bool_),
            self.solids, self.centres, self.radii, self.sharp, self.present,
            ox, oy, sign * ux, sign * uy, abs(change), np.empty((30, 3)),
        )  # fmt: skip
        return Contact(float(free), int(moving), int(still))

    def views(self, face: int, to_rad: float, beams: NDArray[np.float64]) -> NDArray[np.float64]:
        """(K, 4) how far the crease of ``face`` is seen on its way to ``to_rad``, under each rotary angle.

        Rows: unsigned angle that it may turn by from where it stands (-1 if it is hidden already); share
        hidden beyond; the solid that hides most, ``face`` itself where it leans over its crease, -1 if it is
        seen all the way; absolute angle at which the face itself comes into the beam.
        """
        from planner._kernels.view_kernels import OWN_FLAP, seen_to

        now, change = float(self.angle[face]), float(to_rad - self.angle[face])
        out = np.zeros((len(beams), 4))
        moving = np.zeros(len(self.solids), np.bool_)
        moving[self.members(face)] = True
        ox, oy, ux, uy = (float(x) for x in self.hinges[face])
        ex, ey = (float(x) for x in self.tree.axis)
        seen_to(
            int(self.panel[face]), int(self.panel[self.tree.parent[face]]), self.panel, moving, self.flat,
            self.solids, self.centres, self.radii, self.present, ox, oy, ux, uy, float(self.lengths[face]),
            math.copysign(1.0, float(self.tree.target[face])), abs(now), abs(change),
            np.ascontiguousarray(beams), ex, ey, self.problem.head(self.tree),
            float(self.problem.hidden_max * SIGHT_RESERVE), out,
        )  # fmt: skip
        out[out[:, 2] == OWN_FLAP, 2] = face
        return out

    def reach(self, face: int, beams: NDArray[np.float64]) -> Reach:
        """How far the crease of ``face`` comes towards its target, in as many stages as help.

        Every stage is turned under the beam that shows the crease farthest. The state is not changed.
        """
        problem, goal = self.problem, float(self.tree.target[face])
        start = float(self.angle[face])
        end = goal
        if problem.use_contact:
            met = self.contact(face, goal)
            if met.still >= 0:
                end = start + math.copysign(max(0.0, met.free_rad - CONTACT_MARGIN_RAD), goal)
        if not problem.use_sight or abs(end - start) < 1e-12:
            return Reach(end, ((float(beams[0]), end),) if abs(end - start) > 1e-12 else ())
        state, turns = self.copy(), []
        while True:
            now = float(state.angle[face])
            seen = state.views(face, end, beams)[:, 0]
            best = int(np.argmax(seen))
            left = abs(end - now)
            if seen[best] < min(LEAST_GAIN_RAD, left - 1e-9):
                break
            to = end if seen[best] >= left - 1e-9 else now + math.copysign(float(seen[best]), goal)
            turns.append((float(beams[best]), to))
            state.turn(face, to)
            if to == end:
                break
        return Reach(float(state.angle[face]), tuple(turns))
