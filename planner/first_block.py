"""The plainest planner that keeps every rule: creases by depth, deepest first, until the first is stopped."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.outside_in_states import OutsideInStates, Turn, fold_result

__all__ = ["FirstBlockProblem"]


class FirstBlockProblem(FoldProblem):
    """Folds outside-in in one fixed order and stops where a crease is stopped for the first time.

    The crease that is stopped turns as far as it goes. Nothing is postponed, nothing is given up.
    """

    def fold(
        self,
        tree: FlatTree,
        *,
        obstacles: NDArray[np.float64] | None = None,
        rank: NDArray[np.int64] | None = None,  # noqa: ARG002  the order is fixed
        after: NDArray[np.int64] | None = None,  # noqa: ARG002
        back: NDArray[np.float64] | None = None,  # noqa: ARG002
        give_up: float = np.inf,  # noqa: ARG002  one pass only
        fine_sight: bool = False,  # noqa: ARG002  as coarse as a search
    ) -> FoldResult:
        """Fold ``tree`` to the first block; arguments as in ``FoldProblem.fold``."""
        states = OutsideInStates(self, tree, obstacles)
        depth = states.depth()
        order = sorted(states.creases.tolist(), key=lambda f: (-depth[f], tree.target[f] < 0.0, f))
        angles = np.zeros(len(tree.parent))
        turns: list[Turn] = []
        stops = {}
        option = 0
        for face in order:
            states.pose(angles)
            target = float(tree.target[face])
            reach = states.reach(face, 0.0, abs(target), option)
            stopped = reach.turn_rad < abs(target)
            to = float(np.copysign(reach.turn_rad, target)) if stopped else target
            if to != 0.0:
                option = reach.option
                turns.append(Turn(face, to, option))
                angles[face] = to
            if stopped:
                stops[face] = reach
                break
        return fold_result(states, turns, stops)
