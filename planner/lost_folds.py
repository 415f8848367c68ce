"""What leaving faces out costs in folding: a face that is not there counts as not folded."""

from __future__ import annotations

import numpy as np

from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh
from planner.net import Net

__all__ = ["foldable_share", "lost_fold_rad"]


def lost_fold_rad(goal: GoalMesh) -> float:
    """Fold angle in rad of the creases that the left-out faces of ``goal`` would have hung on.

    Every missing face would have brought one crease. Which one depends on the net; the creases that fold most
    are taken (a maximum spanning forest over the missing faces, the rest of the mesh as its root), so that
    the folded share comes out too low rather than too high.
    """
    if not len(goal.left_out):
        return 0.0
    graph = DualGraph(goal.original)
    missing = np.zeros(len(goal.original.faces), dtype=np.bool_)
    missing[goal.left_out] = True
    root = np.where(missing, np.arange(len(missing)), -1).tolist()  # -1: the rest, one node

    def find(face: int) -> int:
        node = face if root[face] >= 0 else -1
        while node >= 0 and root[node] != node:
            node = root[node]
        return int(node)

    angle = np.where(graph.flat, 0.0, np.abs(graph.fold_angle))
    total = 0.0
    for edge in np.argsort(-angle, kind="stable").tolist():
        one, other = (find(face) for face in graph.faces[edge].tolist())
        if one != other:
            low, high = sorted((one, other))
            root[high] = low
            total += float(angle[edge])
    return total


def foldable_share(net: Net) -> float:
    """Share of all folding of the whole goal that the faces of ``net`` can bring; 1 if none is missing."""
    lost = lost_fold_rad(net.goal)
    if not lost:
        return 1.0
    wanted = float(np.abs(net.fold_angle[np.isin(net.assignment, ("V", "M"))]).sum())
    return wanted / (wanted + lost)
