"""No-goods: sets of edges of which every net cuts some, with the reason."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner._kernels.no_good_kernels import overlapping_paths
from planner.dual_graph import DualGraph
from planner.flat_layout import base_outline
from planner.layout_arrays import graph_arrays
from planner.net_proof import Reason
from planner.proof_geometry import FaceShapes, vertex_fan

__all__ = ["NoGood", "PathFinder", "hold_no_good", "never_free", "vertex_no_goods"]

PATH_ROOM = 20_000
"""Paths that one search returns at most."""


@dataclass(frozen=True)
class NoGood:
    """Of ``edges``, every net cuts at least ``cut_at_least``.

    Attributes:
        edges: interior edges of the dual graph; for a path in the order from ``faces[0]`` to ``faces[1]``.
        cut_at_least: how many.
        why: ``overlap``: the faces at the ends of the path overlap when it is laid out; ``vertex``: around a
            vertex faces overlap if one edge there is cut alone; ``hold``: the base panel needs a free side.
        faces: the two faces that overlap; for ``vertex`` the vertex twice, for ``hold`` the base face twice.
    """

    edges: tuple[int, ...]
    cut_at_least: int
    why: Reason
    faces: tuple[int, int]


class PathFinder:
    """Finds overlapping dual paths of one goal."""

    def __init__(self, graph: DualGraph, *, cut_panels: bool = False) -> None:
        """Prepare the arrays.

        Args:
            graph: the dual graph of the goal.
            cut_panels: whether flat joints that no whole panel needs may be used.
        """
        self.graph = graph
        self._arrays = graph_arrays(graph)
        kept = graph.flat_forest
        self._barred = np.zeros(len(kept), dtype=np.bool_) if cut_panels else graph.flat & ~kept
        self._found = np.empty((PATH_ROOM + 1, 4), dtype=np.int64)
        self._edges = np.empty(40 * PATH_ROOM, dtype=np.int64)

    def short(self, folds: int, work: int) -> list[NoGood]:
        """Minimal overlapping paths of at most ``folds`` creases; flat joints do not count."""
        cost = np.where(self.graph.flat_forest, 0.0, 1.0)
        return self._search(cost, float(folds), work)

    def violated(self, kept: NDArray[np.float64], work: int, slack: float = 1e-4) -> list[NoGood]:
        """Minimal overlapping paths of which ``kept`` cuts less than one edge, by more than ``slack``.

        Args:
            kept: (M,) share to which every interior edge is a crease: 0 or 1 for a tree.
            work: faces placed at most.
            slack: violations up to this are rounding.
        """
        return self._search(np.maximum(1.0 - kept, 0.0), 1.0 - slack, work)

    def _search(self, cost: NDArray[np.float64], reach: float, work: int) -> list[NoGood]:
        limited = np.where(self._barred, -1.0, cost)
        count = overlapping_paths(
            self._arrays, limited, float(reach), np.int64(work), self._edges, self._found
        )
        rows = self._found[:count].tolist()
        return [NoGood(tuple(self._edges[i:j].tolist()), 1, "overlap", (f, g)) for f, g, i, j in rows]


def vertex_no_goods(graph: DualGraph) -> list[NoGood]:
    """Inner vertices with so much angle that one cut edge is not enough: two or more must be cut."""
    goal = graph.goal
    shapes = FaceShapes(goal)
    corners = goal.vertices[goal.faces]
    angle = np.zeros(len(goal.vertices))
    for k in range(3):
        u, v = corners[:, (k + 1) % 3] - corners[:, k], corners[:, (k + 2) % 3] - corners[:, k]
        size = np.linalg.norm(np.cross(u, v), axis=1)
        np.add.at(angle, goal.faces[:, k], np.arctan2(size, np.einsum("ij,ij->i", u, v)))
    number = {(a, b): e for e, (a, b) in enumerate(graph.vertices.tolist())}
    found = []
    for vertex in np.flatnonzero(angle > 2.0 * np.pi + 1e-6).tolist():
        fan = vertex_fan(goal, vertex)
        if fan is None or not shapes.every_cut_overlaps(vertex, fan):
            continue
        spokes = [spoke for _, spoke in fan]
        edges = tuple(number[min(vertex, w), max(vertex, w)] for w in spokes)
        found.append(NoGood(edges, 2, "vertex", (vertex, vertex)))
    return found


def hold_no_good(graph: DualGraph, base: int) -> NoGood | None:
    """The sides of the base panel that could hold a tab: one is cut.

    None if one lies on the boundary, or if none can be cut in any net (``never_free``).
    """
    sides = base_outline(graph, graph.panel == graph.panel[base])[:, 2]
    if (sides < 0).any() or never_free(graph, base):
        return None
    return NoGood(tuple(np.unique(sides).tolist()), 1, "hold", (base, base))


def never_free(graph: DualGraph, base: int) -> bool:
    """True if every side of the base panel that could hold a tab is the only way to what lies beyond it."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    sides = base_outline(graph, graph.panel == graph.panel[base])[:, 2]
    if (sides < 0).any():
        return False
    count = len(graph.face_edges)
    for side in np.unique(sides).tolist():
        left = np.delete(graph.faces, side, axis=0)
        joined = coo_array((np.ones(len(left)), (left[:, 0], left[:, 1])), shape=(count, count))
        _, part = connected_components(joined, directed=False)
        if not part.any():
            return False
    return True
