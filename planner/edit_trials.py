"""Trying a changed goal: is it still a goal, and how nearly does it have a net."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.base_faces import rank_bases
from planner.blooming_trees import BLOOMING_TREES, TreeName
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.mesh_check import STEEPEST_FOLD_RAD
from planner.mesh_edges import face_heights
from planner.mesh_intersect import intersecting_pairs
from planner.nearly_blooming import DEFAULT_BUDGET_S, WORK_PER_SECOND, nearly_blooming

__all__ = ["EditTrials"]

BASES_TRIED = 3
"""Bases from which a changed goal is tried."""

SET_UP_WORK = 20
"""Faces tested for overlap that setting up one trial stands for, per face of the goal."""


class EditTrials:
    """Judges changed goals by the net search, and counts the work.

    Args:
        goal: the goal as it was.
        base_face: the stationary face; None: any.
        seed: of the net search.
        budget_s: nominal seconds, counted as work; None: the usual.
        kerf_mm: faces less than a tenth of it high are not accepted.
    """

    def __init__(
        self, goal: GoalMesh, base_face: int | None, seed: int, budget_s: float | None, kerf_mm: float
    ) -> None:
        self.seed = seed
        self.lowest = 0.1 * kerf_mm
        self.work_left = (DEFAULT_BUDGET_S if budget_s is None else budget_s) * WORK_PER_SECOND
        self.count = 0
        self.base_face = base_face
        self._bases: list[tuple[int, TreeName]] = []
        graph = DualGraph(goal)
        if base_face is not None:
            self._bases = [(base_face, tree) for tree in BLOOMING_TREES]
        elif not graph.is_tree:
            self._bases = [(rank.face, rank.tree) for rank in rank_bases(graph, BASES_TRIED, seed=seed)]

    @property
    def spent(self) -> bool:
        """True once the budget is used up."""
        return self.work_left <= 0.0

    def overlaps(self, goal: GoalMesh) -> tuple[int, NDArray[np.int64]]:
        """What keeps ``goal`` from having a net, as far as tried: 0 if it has one; and the faces in question.

        The figure is the least number of overlapping pairs, plus 1 where the base cannot be held.
        """
        self.count += 1
        self.work_left -= SET_UP_WORK * len(goal.faces)
        graph = DualGraph(goal)
        if graph.is_tree:
            only = np.ones(len(graph.faces), dtype=np.bool_)
            layout = FlatLayout(graph, only, self.base_face or 0, hold_base=False)
            loose = self.base_face is not None and not layout.free_edges()
            return layout.overlaps + loose, np.unique(layout.overlapping_pairs())
        least, faces = len(goal.faces) ** 2, np.arange(0)
        for base, tree in self._bases:
            attempt = nearly_blooming(
                graph, base, tree=tree, seed=self.seed, cut_panels=graph.has_rings,
                budget_s=max(self.work_left / WORK_PER_SECOND, 1.0),
            )  # fmt: skip
            self.work_left -= attempt.work
            found = len(attempt.overlapping) + (not attempt.held)
            if found < least:
                least, faces = found, np.unique(attempt.overlapping)
            if attempt.is_net:
                break
        return least, faces

    def is_sound(self, goal: GoalMesh) -> bool:
        """True if the faces can be cut, no fold is a hem, and the surface does not pass through itself."""
        if face_heights(goal.vertices, goal.faces).min() < self.lowest:
            return False
        if np.abs(DualGraph(goal).fold_angle).max(initial=0.0) > STEEPEST_FOLD_RAD:
            return False
        return not len(intersecting_pairs(goal.vertices, goal.faces))
