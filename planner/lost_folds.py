"""What leaving faces out costs in folding: a face that is not there counts as not folded."""

from __future__ import annotations

import numpy as np

from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh
from planner.net import Net

__all__ = ["foldable_share", "left_out_words", "lost_fold_rad"]

FACES_NAMED = 12
"""Faces left out that a notice names."""


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


def left_out_words(goal: GoalMesh) -> str:
    """What is missing from ``goal``, in one line; empty if nothing is."""
    missing = goal.left_out
    if not len(missing):
        return ""
    a, b, c = (goal.original.vertices[goal.original.faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    named = ", ".join(map(str, missing[:FACES_NAMED].tolist())) + (" …" if len(missing) > FACES_NAMED else "")
    which = f"face {named}" if len(missing) == 1 else f"faces {named}"
    lost, total = float(area[missing].sum()), float(area.sum())
    return (
        f"left out on request, because no net with all faces was found: {which} of goal.ply "
        f"({len(missing)} of {len(area)}, {lost:.3g} mm², {100 * lost / total:.2g} % of the surface); "
        "they count as not folded, and the shape error is that of the other faces"
    )
