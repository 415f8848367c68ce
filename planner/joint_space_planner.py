"""The traditional motion planner: a tree of random motions in the discrete joint space of outside-in states.

Every crease stands at one of a few equal levels between flat and its goal. A tree of states grows from the
flat sheet towards random states and, now and then, towards the goal, one crease at a time; each motion is
checked with all rules, exactly as the fold planner checks it. A crease is moved only once all that hangs on
it stands at its goal: the planner looks for a way to the goal and knows no way to give a crease up. What it
reports is the best state that it reached.

Source: the reading in which rapidly-exploring random trees (LaValle 1998; the greedy extension is that of
RRT-Connect, Kuffner and LaValle 2000) run in a discrete domain of fold angles, as Xi and Lien did for
polyhedra (IROS 2015).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import MachineLimits
from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.goal_mesh import GoalMesh
from planner.outside_in_states import OutsideInStates, Reach, Turn, fold_result

__all__ = ["DEFAULT_BUDGET_S", "LEVELS", "WORK_PER_SECOND", "MotionPlannerProblem"]

LEVELS = 4
"""Steps from flat to the goal angle of a crease."""

GOAL_SHARE = 0.2
"""Share of the samples that are the goal itself; the first one always is."""

STALE_SAMPLES = 60
"""The search ends after so many samples in a row that added no state."""

DEFAULT_BUDGET_S = 10.0
WORK_PER_SECOND = 200_000.0
"""Faces times checked motions that count as one second."""

MOST_COMPARED = 256
"""States among which the nearest to a sample is looked for: the best one and random others."""


@dataclass(eq=False)
class _Node:
    """A state of the tree: levels (C,) of the creases, the turn that led here, and what is stopped."""

    levels: NDArray[np.int64]
    parent: int
    turn: Turn | None
    stops: dict[int, Reach] = field(default_factory=dict)


class MotionPlannerProblem(FoldProblem):
    """Folds with the traditional motion planner.

    Args:
        goal, insets, limits, hidden_max, without: as in ``FoldProblem``.
        seed: of every random choice.
        budget_s: nominal seconds, counted as work so that the result does not depend on the machine.
    """

    def __init__(
        self,
        goal: GoalMesh,
        insets: NDArray[np.float64],
        limits: MachineLimits,
        *,
        hidden_max: float = 0.05,
        without: Collection[str] = (),
        seed: int = 0,
        budget_s: float | None = None,
    ) -> None:
        super().__init__(goal, insets, limits, hidden_max=hidden_max, without=without)
        self.seed = seed
        self.budget_s = DEFAULT_BUDGET_S if budget_s is None else budget_s
        self.checks = 0
        self.out_of_budget = False

    def fold(
        self,
        tree: FlatTree,
        *,
        obstacles: NDArray[np.float64] | None = None,
        rank: NDArray[np.int64] | None = None,  # noqa: ARG002  the order is what is looked for
        after: NDArray[np.int64] | None = None,  # noqa: ARG002
        back: NDArray[np.float64] | None = None,  # noqa: ARG002
        give_up: float = np.inf,  # noqa: ARG002  the budget ends the search
        fine_sight: bool = False,  # noqa: ARG002  as coarse as a search
    ) -> FoldResult:
        """Look for a way to the goal; arguments as in ``FoldProblem.fold``."""
        states = OutsideInStates(self, tree, obstacles)
        search = _Search(states, np.random.default_rng([self.seed, len(tree.parent)]))
        most = max(1, int(self.budget_s * WORK_PER_SECOND / len(tree.parent)))
        search.run(most)
        self.checks += states.checks
        self.out_of_budget |= states.checks >= most
        return search.result()


class _Search:
    """One tree of states; ``creases`` counts the creases of the net, not its faces."""

    def __init__(self, states: OutsideInStates, rng: np.random.Generator) -> None:
        self.states, self.rng = states, rng
        self.creases = states.creases.tolist()
        number = {face: k for k, face in enumerate(self.creases)}
        self.below = [[number[g] for g in states.below[face]] for face in self.creases]
        self.above = np.full(len(self.creases), -1)
        for k, under in enumerate(self.below):
            self.above[under] = k
        self.target = states.tree.target[states.creases]
        self.weight = np.abs(self.target)
        start = np.zeros(len(self.creases), dtype=np.int64)
        self.nodes = [_Node(start, -1, None)]
        self.known = {start.tobytes(): 0}
        self.matrix = np.zeros((64, len(self.creases)), dtype=np.int8)
        self.best, self.best_gain = 0, 0.0

    def run(self, most_checks: int) -> None:
        """Grow the tree until the goal is reached, the budget is spent, or nothing new turns up."""
        stale, first = 0, True
        goal = np.full(len(self.creases), LEVELS)
        while stale < STALE_SAMPLES and self.states.checks < most_checks and goal.tobytes() not in self.known:
            to_goal = first or self.rng.random() < GOAL_SHARE
            first = False
            before = len(self.nodes)
            self._grow(goal if to_goal else self._sample(), most_checks)
            stale = 0 if len(self.nodes) > before else stale + 1

    def result(self) -> FoldResult:
        """The best state that was reached, the first of equals."""
        turns = []
        number = self.best
        while (turn := self.nodes[number].turn) is not None:
            turns.append(turn)
            number = self.nodes[number].parent
        node = self.nodes[self.best]
        option = turns[0].option if turns else 0
        self.states.pose(self._angles(node))
        stops = {}
        for k in self._ready(node, np.full(len(self.creases), LEVELS), tried=True):
            face = self.creases[k]
            now = abs(self._angle(k, int(node.levels[k])))
            stops[face] = node.stops.get(k) or self.states.reach(face, now, self.weight[k] - now, option)
        return fold_result(self.states, turns[::-1], stops)

    def _sample(self) -> NDArray[np.int64]:
        """A random state: some length of a random outside-in order, folded."""
        length = int(self.rng.integers(1, len(self.creases) + 1))
        waiting = np.array([len(under) for under in self.below])
        ready = [k for k in range(len(self.creases)) if waiting[k] == 0]
        out = np.zeros(len(self.creases), dtype=np.int64)
        for draw in self.rng.random(length).tolist():
            place = int(draw * len(ready))
            k = ready[place]
            ready[place] = ready[-1]
            ready.pop()
            out[k] = LEVELS
            up = int(self.above[k])
            if up >= 0:
                waiting[up] -= 1
                if waiting[up] == 0:
                    ready.append(up)
        out[k] = int(self.rng.integers(1, LEVELS + 1))
        return out

    def _ready(self, node: _Node, sample: NDArray[np.int64], *, tried: bool = False) -> list[int]:
        """Creases that may move towards ``sample``; those known to be stopped only with ``tried``."""
        levels = node.levels
        return [
            k
            for k in np.flatnonzero(levels < sample).tolist()
            if (tried or k not in node.stops) and all(levels[g] == LEVELS for g in self.below[k])
        ]

    def _grow(self, sample: NDArray[np.int64], most_checks: int) -> None:
        """Go from the nearest state towards ``sample`` until no crease can be moved nearer to it."""
        chosen = np.arange(len(self.nodes))
        if len(chosen) > MOST_COMPARED:
            others = self.rng.integers(len(chosen), size=MOST_COMPARED - 1)
            chosen = np.unique(np.append(others, self.best))
        apart = np.abs(self.matrix[chosen] - sample.astype(np.int8)) @ self.weight
        number = int(chosen[np.argmin(apart)])
        while self.states.checks < most_checks:
            node = self.nodes[number]
            ready = self._ready(node, sample)
            if not ready:
                return
            k = ready[int(self.rng.integers(len(ready)))]
            number = self._move(number, k, int(sample[k]))

    def _move(self, number: int, k: int, level: int) -> int:
        """Turn crease k up to ``level`` or as far as it goes; returns the state where that ends."""
        node = self.nodes[number]
        face, from_level = self.creases[k], int(node.levels[k])
        option = node.turn.option if node.turn is not None else 0
        now = abs(self._angle(k, from_level))
        wanted = abs(self._angle(k, level)) - now
        self.states.pose(self._angles(node))
        reach = self.states.reach(face, now, wanted, option)
        if reach.turn_rad < wanted:
            level = from_level + int(reach.turn_rad * LEVELS / self.weight[k] + 1e-9)
        if level == from_level:
            node.stops[k] = reach
            return number
        levels = node.levels.copy()
        levels[k] = level
        key = levels.tobytes()
        if key not in self.known:
            self.known[key] = len(self.nodes)
            self.nodes.append(_Node(levels, number, Turn(face, self._angle(k, level), reach.option)))
            if len(self.nodes) > len(self.matrix):
                self.matrix = np.concatenate([self.matrix, np.zeros_like(self.matrix)])
            self.matrix[len(self.nodes) - 1] = levels
            gain = float(levels @ self.weight)
            if gain > self.best_gain + 1e-9:
                self.best, self.best_gain = len(self.nodes) - 1, gain
        return self.known[key]

    def _angle(self, k: int, level: int) -> float:
        """Signed angle of crease k at a level."""
        return float(self.target[k]) if level == LEVELS else float(self.target[k]) * level / LEVELS

    def _angles(self, node: _Node) -> NDArray[np.float64]:
        """(F,) angles of a state."""
        out = np.zeros(len(self.states.tree.parent))
        out[self.states.creases] = np.where(
            node.levels == LEVELS, self.target, self.target * node.levels / LEVELS
        )
        return out
