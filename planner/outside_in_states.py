"""A net whose creases turn one at a time, outside-in: its states, and how far a crease turns out of one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.fold_problem import (
    BY_ORDER,
    CONTACT_MARGIN_RAD,
    SAFE_LOAD,
    SIGHT_RESERVE,
    FlatTree,
    FoldProblem,
    FoldResult,
    bounding_spheres,
    panel_numbers,
    shape_rms,
)

__all__ = ["OutsideInStates", "Reach", "Turn", "fold_result"]


@dataclass(frozen=True)
class Turn:
    """The crease of ``face`` goes to the signed angle ``to_rad`` under rotary option ``option``."""

    face: int
    to_rad: float
    option: int


@dataclass(frozen=True)
class Reach:
    """How far a crease turns out of a state.

    Attributes:
        turn_rad: further turn, without sign.
        option: rotary option that allows it.
        cause: why it stops: 0 it does not, 1 contact, 2 sight.
        blocker: the solid that stops it, -1 if none.
    """

    turn_rad: float
    option: int
    cause: int
    blocker: int


class OutsideInStates:
    """States of one flat net under the rules and limits of a ``FoldProblem``.

    A crease is *ready* once everything that hangs on it stands at its goal; then the way from it to the base
    is flat, since no crease on it was ready before. A state is one angle for each crease.

    Args:
        problem: goal, limits and rules.
        tree: the flat net.
        obstacles: (M, 12, 3) solids that stand still in the sheet plane.

    Attributes:
        creases: faces whose crease is to be folded, ascending.
        below: for each face, the next creases outwards of it, through flat joints.
        checks: how often ``reach`` was asked.
    """

    def __init__(
        self, problem: FoldProblem, tree: FlatTree, obstacles: NDArray[np.float64] | None = None
    ) -> None:
        self.problem, self.tree = problem, tree
        count = len(tree.parent)
        solids, sharp = problem.solids(tree), problem.sharp
        if obstacles is not None and len(obstacles):
            solids = np.concatenate([solids, obstacles])
            sharp = np.concatenate([sharp, np.zeros(len(obstacles), dtype=np.bool_)])
        total = len(solids)
        self.preorder, self.first, self.last = tree.subtrees
        self.hinges, self.lengths = tree.hinge_lines
        self.panel = panel_numbers(tree, total)
        self._flat_solids, self._sharp = solids, sharp
        self._flat_centres, self._radii = bounding_spheres(solids)
        self._solids, self._centres = solids.copy(), self._flat_centres.copy()
        self._flat, self._present = np.ones(total, np.bool_), np.ones(total, np.bool_)
        self._moving = np.zeros(total, np.bool_)
        self._work, self._turned, self._intervals = np.zeros((30, 3)), np.zeros((3, 3)), np.zeros((total, 2))
        half = len(problem.rotary) // 2
        self._options = {1: np.arange(half), -1: np.arange(half, 2 * half)}
        self._head = problem.head(tree)
        self.checks = 0
        self.creases = np.flatnonzero(tree.target != 0.0)
        self.below: list[list[int]] = [[] for _ in range(count)]
        for face in self.creases.tolist():
            up = int(tree.parent[face])
            while up >= 0 and tree.target[up] == 0.0:
                up = int(tree.parent[up])
            if up >= 0:
                self.below[up].append(face)

    def depth(self) -> NDArray[np.int64]:
        """(F,) number of creases to be folded between each face and the base, its own included."""
        out = np.zeros(len(self.tree.parent), dtype=np.int64)
        for face in self.tree.order[1:].tolist():
            out[face] = out[self.tree.parent[face]] + (self.tree.target[face] != 0.0)
        return out

    def pose(self, angles: NDArray[np.float64]) -> None:
        """Go to the state with ``angles`` (F,) at the creases, signed."""
        from planner._kernels.state_kernels import pose_state

        pose_state(
            angles, self.preorder, self.first, self.last, self.hinges,
            self._flat_solids, self._flat_centres, self._solids, self._centres, self._flat,
        )  # fmt: skip

    def reach(self, face: int, now_rad: float, wanted_rad: float, option: int) -> Reach:
        """How far the crease of ``face`` turns out of the posed state.

        Args:
            face: its crease is ready.
            now_rad: |angle| in the posed state.
            wanted_rad: largest further turn that is of use.
            option: rotary option in force; it is tried first if it lights the right side.
        """
        from planner._kernels.state_kernels import turn_reach

        problem, tree = self.problem, self.tree
        sign = 1 if tree.target[face] > 0.0 else -1
        options = self._options[sign]
        if option in options:
            options = np.concatenate([[option], options[options != option]])
        self.checks += 1
        turn, chosen, cause, blocker = turn_reach(
            np.int64(face), tree.parent[face], self.preorder[self.first[face] : self.last[face]],
            self._moving, self.panel, self._flat, self._solids, self._centres, self._radii, self._sharp,
            self._present, self.hinges[face], float(self.lengths[face]), float(sign), float(now_rad),
            float(wanted_rad), options, problem.rotary, float(tree.axis[0]), float(tree.axis[1]),
            self._head, problem.hidden_max * SIGHT_RESERVE, CONTACT_MARGIN_RAD,
            problem.use_contact, problem.use_sight, self._work, self._intervals, self._turned,
        )  # fmt: skip
        return Reach(float(turn), int(chosen), int(cause), int(blocker))

    def corners(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """(F, 3, 3) corners of the faces in the state with ``angles`` (F,)."""
        self.pose(angles)
        return self._solids[: len(self.tree.parent), 9:12].copy()


def fold_result(states: OutsideInStates, turns: Sequence[Turn], stops: dict[int, Reach]) -> FoldResult:
    """The figures of a sequence of turns, in the form that the fold planner gives.

    Args:
        states: the net.
        turns: in order.
        stops: what stops a crease that is ready and short of its goal. All others that are short wait for
            something that hangs on them: cause ``BY_ORDER``.
    """
    problem, tree = states.problem, states.tree
    count = len(tree.parent)
    reached = np.zeros(count)
    rows: list[tuple[float, float, float]] = []
    option = 0
    for turn in turns:
        if turn.option != option:
            option = turn.option
            rows.append((0.0, float(option), float(problem.rotary[option])))
        rows.append((1.0, float(turn.face), turn.to_rad))
        reached[turn.face] = turn.to_rad
    cause = np.where((tree.target != 0.0) & (reached != tree.target), BY_ORDER, 0)
    blocker = np.full(count, -1, dtype=np.int64)
    for face, stop in stops.items():
        if reached[face] != tree.target[face]:
            cause[face], blocker[face] = stop.cause, stop.blocker
    wanted = np.abs(tree.target).sum()
    loads = problem.loads(tree)
    return FoldResult(
        steps=np.array(rows).reshape(-1, 3),
        reached=reached,
        cause=cause,
        blocker=blocker,
        toucher=np.full(count, -1, dtype=np.int64),
        stopped_at=np.abs(reached),
        completion=float(np.minimum(np.abs(reached), np.abs(tree.target)).sum() / wanted) if wanted else 1.0,
        shape_rms=shape_rms(states.corners(reached), problem.corners_3d),
        rotations=sum(row[0] == 0.0 for row in rows),
        overload=float(np.maximum(loads - SAFE_LOAD, 0.0).sum()),
    )
