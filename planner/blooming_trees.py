"""Blooming trees: spanning trees of the dual graph whose nets open like a flower around a base face."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.errors import NetError

__all__ = ["BLOOMING_TREES", "TreeName", "blooming_tree", "weighted_tree"]

TreeName = Literal["steepest", "dijkstra", "bfs"]

BLOOMING_TREES: tuple[TreeName, ...] = ("steepest", "dijkstra", "bfs")
"""Names of the blooming trees, in the order in which they are tried."""

TIE_DIGITS = 9
"""Lengths and slopes that agree to this many decimals are ties, so that rounding does not choose."""


def blooming_tree(graph: DualGraph, base: int, name: TreeName = "steepest") -> NDArray[np.bool_]:
    """Spanning tree of the faces that unfolds the goal away from ``base``.

    - ``steepest``: every vertex but the one farthest along -n (n the normal of the base face) cuts the edge that
      points most directly along -n, so the cuts run away from the base. What the cuts leave is spanned from the base
      with the fewest folds, longer creases first. Source: Schlickenrieder, Nets of Polyhedra (1997).
    - ``dijkstra``: shortest paths from the base over face centres and edge middles (source unfolding).
    - ``bfs``: fewest folds from the base, longer creases first.

    Flat joints come first in every tree: panels stay whole. Ties: longer edge, then lower vertex or edge number.

    Args:
        graph: the dual graph of the goal.
        base: the face around which the goal opens.
        name: which of the trees.

    Returns:
        (M,) True for the edges of the tree.

    Raises:
        NetError: if the tree is unknown, ``base`` is not a face, or the goal is not one piece.
    """
    count = len(graph.goal.faces)
    if not 0 <= base < count:
        raise NetError(f"base face {base} does not exist: the goal has faces 0 to {count - 1}")
    rank = np.where(graph.flat_forest, 0, 1)
    if name == "steepest":
        rank[steepest_cuts(graph, base) & ~graph.flat_forest] = 2
        cost = np.where(graph.flat, 0.0, 1.0)
    elif name == "bfs":
        cost = np.where(graph.flat, 0.0, 1.0)
    elif name == "dijkstra":
        cost = _face_distance(graph).round(TIE_DIGITS)
    else:
        raise NetError(f"unknown blooming tree {name!r}; choose one of {', '.join(BLOOMING_TREES)}")
    return _grow(graph, rank, cost, base, adding=True)


def weighted_tree(graph: DualGraph, weight: NDArray[np.float64], base: int = 0) -> NDArray[np.bool_]:
    """(M,) minimum spanning tree for a weight (M,) per interior edge, flat joints first.

    Raises:
        NetError: if the goal is not one piece.
    """
    return _grow(
        graph, np.where(graph.flat_forest, 0, 1), np.asarray(weight, dtype=np.float64), base, adding=False
    )


def steepest_cuts(graph: DualGraph, base: int) -> NDArray[np.bool_]:
    """(M,) edges that the steepest-edge rule cuts for ``base``."""
    goal = graph.goal
    down = -goal.face_normals[base]
    low, high = graph.vertices[:, 0], graph.vertices[:, 1]
    slope = ((goal.vertices[high] - goal.vertices[low]) @ down / graph.length).round(TIE_DIGITS)
    edge = np.arange(len(low))
    vertex = np.concatenate([low, high])
    other = np.concatenate([high, low])
    slope = np.concatenate([slope, -slope])
    length = np.tile(graph.length.round(TIE_DIGITS), 2)
    order = np.lexsort((other, -length, -slope, vertex))
    first = np.unique(vertex[order], return_index=True)[1]
    best = order[first]
    # the apex, the vertex farthest from the base, does not cut; neither do vertices of the goal's boundary, which
    # are open already
    height = (goal.vertices @ down).round(TIE_DIGITS)
    open_vertices = np.zeros(len(goal.vertices), dtype=np.bool_)
    for step in range(2):
        open_vertices[goal.faces[graph.boundary[:, 0], (graph.boundary[:, 1] + step) % 3]] = True
    apex = int(np.argmax(height))
    best = best[(vertex[best] != apex) & ~open_vertices[vertex[best]]]
    cuts = np.zeros(len(edge), dtype=np.bool_)
    cuts[np.tile(edge, 2)[best]] = True
    return cuts


def _face_distance(graph: DualGraph) -> NDArray[np.float64]:
    """(M,) distance between the centres of the two faces of every edge, by way of its middle, mm."""
    goal = graph.goal
    centres = goal.vertices[goal.faces].mean(axis=1)
    middle = goal.vertices[graph.vertices].mean(axis=1)
    distance: NDArray[np.float64] = sum(
        (np.linalg.norm(centres[graph.faces[:, i]] - middle, axis=1) for i in range(2)),
        start=np.zeros(len(middle)),
    )
    return distance


def _grow(
    graph: DualGraph, rank: NDArray[np.int64], cost: NDArray[np.float64], base: int, *, adding: bool
) -> NDArray[np.bool_]:
    from planner._kernels.nb_kernels import grow_tree
    from planner._kernels.net_kernels import TREE
    from planner.flat_layout import net_arrays

    edges = np.arange(len(cost))
    tie = np.empty(len(cost), dtype=np.int64)
    tie[np.lexsort((edges, -graph.length.round(TIE_DIGITS)))] = edges
    arrays = net_arrays(graph)
    count = grow_tree(arrays, rank.astype(np.int64), np.ascontiguousarray(cost), tie, int(base), adding)
    if count != len(graph.goal.faces) - 1:
        raise NetError(
            f"{graph.goal.name}: the faces are not one piece ({graph.pieces} pieces joined by edges); "
            "fold each piece by itself"
        )
    tree: NDArray[np.bool_] = arrays.edge[:, TREE] != 0
    return tree
