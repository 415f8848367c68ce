"""Blooming trees: spanning trees of the dual graph whose nets open like a flower around a base face."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from planner._kernels.nb_kernels import grow_tree
from planner._kernels.net_arrays import TREE
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.layout_arrays import graph_arrays

__all__ = ["BLOOMING_TREES", "TreeGrower", "TreeName", "blooming_tree", "weighted_tree"]

TreeName = Literal["steepest", "dijkstra", "bfs"]

BLOOMING_TREES: tuple[TreeName, ...] = ("steepest", "dijkstra", "bfs")
"""Names of the blooming trees, in the order in which they are tried."""

TIE_DIGITS = 9
"""Lengths and slopes that agree to this many decimals are ties, so that rounding does not choose."""


class TreeGrower:
    """Grows spanning trees of one dual graph; what all of them share is computed once.

    Attributes:
        graph: the dual graph.
        arrays: the arrays in which trees are grown; ``arrays.edge[:, TREE]`` holds the last one.
        rank: (M,) 0 for the flat forest, which every tree keeps, 1 for the other edges.
        tie: (M,) place of every edge among equals: longer edges first, then lower numbers.
    """

    def __init__(self, graph: DualGraph) -> None:
        """Prepare the costs and the order of ties: longer edges first, then lower numbers."""
        self.graph = graph
        self.arrays = graph_arrays(graph)
        edges = np.arange(len(graph.faces))
        length = graph.length.round(TIE_DIGITS)
        self.tie = np.empty(len(edges), dtype=np.int64)
        self.tie[np.lexsort((edges, -length))] = edges
        self._fold = np.where(graph.flat, 0.0, 1.0)
        self._distance = _face_distance(graph).round(TIE_DIGITS)
        self.rank = np.where(graph.flat_forest, 0, 1).astype(np.int64)
        # ends of every edge, both ways, for the steepest-edge rule
        self._from = graph.vertices.T.ravel()
        self._edge = np.tile(edges, 2)
        goal = graph.goal
        along = goal.vertices[graph.vertices[:, 1]] - goal.vertices[graph.vertices[:, 0]]
        unit = along / graph.length[:, None]
        self._unit = np.concatenate([unit, -unit])
        self._by_vertex = np.lexsort((graph.vertices[:, ::-1].T.ravel(), -np.tile(length, 2), self._from))
        self._first = np.unique(self._from[self._by_vertex], return_index=True)[1]
        self._open = np.zeros(len(goal.vertices), dtype=np.bool_)
        for step in range(2):
            self._open[goal.faces[graph.boundary[:, 0], (graph.boundary[:, 1] + step) % 3]] = True

    def blooming(self, base: int, name: TreeName) -> NDArray[np.bool_]:
        """(M,) the blooming tree ``name`` around ``base``; see ``blooming_tree``."""
        count = len(self.graph.goal.faces)
        if not 0 <= base < count:
            raise NetError(f"base face {base} does not exist: the goal has faces 0 to {count - 1}")
        if name == "steepest":
            rank = self.rank.copy()
            rank[self.steepest_cuts(base) & (rank > 0)] = 2
            return self.grow(rank, self._fold, base, adding=True)
        if name == "bfs":
            return self.grow(self.rank, self._fold, base, adding=True)
        if name == "dijkstra":
            return self.grow(self.rank, self._distance, base, adding=True)
        raise NetError(f"unknown blooming tree {name!r}; choose one of {', '.join(BLOOMING_TREES)}")

    def weighted(self, weight: NDArray[np.float64], base: int = 0) -> NDArray[np.bool_]:
        """(M,) the minimum spanning tree for ``weight``; see ``weighted_tree``."""
        return self.grow(self.rank, np.asarray(weight, dtype=np.float64), base, adding=False)

    def steepest_cuts(self, base: int) -> NDArray[np.bool_]:
        """(M,) edges that the steepest-edge rule cuts for ``base``: along its normal, downwards."""
        return self.steepest_cuts_along(-self.graph.goal.face_normals[base])

    def steepest_cuts_along(self, direction: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(M,) edges that the steepest-edge rule cuts: each vertex the one nearest to ``direction`` (3,).

        The vertex farthest along it does not cut, nor do vertices of the goal's boundary: they are open.
        """
        goal, down = self.graph.goal, direction
        slope = (self._unit @ down).round(TIE_DIGITS)[self._by_vertex]
        steepest = np.maximum.reduceat(slope, self._first) if len(slope) else slope
        owner = np.repeat(np.arange(len(self._first)), np.diff([*self._first.tolist(), len(slope)]))
        hits = np.flatnonzero(slope == steepest[owner])
        best = self._by_vertex[hits[np.unique(owner[hits], return_index=True)[1]]]
        apex = int(np.argmax((goal.vertices @ down).round(TIE_DIGITS)))
        keep = (self._from[best] != apex) & ~self._open[self._from[best]]
        cuts = np.zeros(len(self.graph.faces), dtype=np.bool_)
        cuts[self._edge[best[keep]]] = True
        return cuts

    def grow(
        self, rank: NDArray[np.int64], cost: NDArray[np.float64], base: int, *, adding: bool
    ) -> NDArray[np.bool_]:
        """(M,) Prim's tree from ``base``: lowest rank, then cost (``adding``: of the whole way), then tie.

        Raises:
            NetError: if the goal is not one piece.
        """
        count = grow_tree(self.arrays, rank, np.ascontiguousarray(cost), self.tie, int(base), adding)
        if count != len(self.graph.goal.faces) - 1:
            raise NetError(
                f"{self.graph.goal.name}: the faces are not one piece but {self.graph.pieces}; "
                "fold each piece by itself"
            )
        tree: NDArray[np.bool_] = self.arrays.edge[:, TREE] != 0
        return tree


def blooming_tree(graph: DualGraph, base: int, name: TreeName = "steepest") -> NDArray[np.bool_]:
    """Spanning tree of the faces that unfolds the goal away from ``base``.

    - ``steepest``: every vertex but the one farthest along -n (n the normal of the base face) cuts the edge
      that points most directly along -n, so the cuts run away from the base. What the cuts leave is spanned
      from the base with the fewest folds, longer creases first. Source: Schlickenrieder, Nets of Polyhedra
      (1997).
    - ``dijkstra``: shortest paths from the base over face centres and edge middles (source unfolding).
    - ``bfs``: fewest folds from the base, longer creases first.

    Flat joints come first in every tree: panels stay whole. Ties: longer edge, then lower vertex or edge
    number.

    Args:
        graph: the dual graph of the goal.
        base: the face around which the goal opens.
        name: which of the trees.

    Returns:
        (M,) True for the edges of the tree.

    Raises:
        NetError: if the tree is unknown, ``base`` is not a face, or the goal is not one piece.
    """
    return TreeGrower(graph).blooming(base, name)


def weighted_tree(graph: DualGraph, weight: NDArray[np.float64], base: int = 0) -> NDArray[np.bool_]:
    """(M,) minimum spanning tree for a weight (M,) per interior edge, flat joints first.

    Raises:
        NetError: if the goal is not one piece.
    """
    return TreeGrower(graph).weighted(weight, base)


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
