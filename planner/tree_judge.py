"""Judges many spanning trees at once by what overlaps in their flat layouts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner._kernels.genetic_kernels import judge_trees
from planner.blooming_trees import TreeGrower
from planner.dual_graph import DualGraph
from planner.errors import NetError

__all__ = ["TreeJudge", "VertexRings", "vertex_rings"]

HYPERBOLIC_SLACK_RAD = 1e-6
"""A vertex is hyperbolic if its angles add up to more than a full turn and this."""


class VertexRings(NamedTuple):
    """Corners of the faces around some vertices, counter-clockwise seen from outside.

    Attributes:
        vertex: (V,) the vertices; one at which several sheets touch occurs once for each.
        first: (V + 1,) where the corners of each start in ``edge`` and ``angle``.
        edge: (C,) interior edge before each corner, -1 on the boundary of the goal.
        angle: (C,) angle of the corner, rad.
    """

    vertex: NDArray[np.int64]
    first: NDArray[np.int64]
    edge: NDArray[np.int64]
    angle: NDArray[np.float64]


def vertex_rings(graph: DualGraph, least_angle: float = 0.0) -> VertexRings:
    """The corners around every vertex whose angles add up to more than ``least_angle`` rad."""
    goal = graph.goal
    corners = goal.vertices[goal.faces]
    after = np.roll(corners, -1, axis=1) - corners
    before = np.roll(corners, 1, axis=1) - corners
    size = np.linalg.norm(np.cross(after, before), axis=2)
    angles = np.arctan2(size, np.einsum("fki,fki->fk", after, before)).ravel()
    # corner 3 f + k stands between the sides k (before it, going round) and k - 1 (after it)
    side = graph.face_edges.ravel()
    step = np.full(side.size, -1, dtype=np.int64)
    for one, other in ((0, 1), (1, 0)):
        # the corner of face ``one`` at the end of its side goes on to the face across that side
        into = 3 * graph.faces[:, one] + (graph.slots[:, one] + 1) % 3
        step[into] = 3 * graph.faces[:, other] + graph.slots[:, other]
    started = np.zeros(side.size, dtype=np.bool_)
    starts = [*np.flatnonzero(side < 0).tolist(), *range(side.size)]  # open fans from their boundary on
    vertex, first, edge, angle = [], [0], [], []
    for start in starts:
        ring, corner = [], start
        while corner >= 0 and not started[corner]:
            started[corner] = True
            ring.append(corner)
            corner = int(step[corner])
        if ring and float(angles[ring].sum()) > least_angle:
            vertex.append(int(goal.faces.ravel()[start]))
            edge += side[ring].tolist()
            angle += angles[ring].tolist()
            first.append(len(edge))
    return VertexRings(
        np.array(vertex, dtype=np.int64),
        np.array(first, dtype=np.int64),
        np.array(edge, dtype=np.int64),
        np.array(angle, dtype=np.float64),
    )


class TreeJudge:
    """Grows the minimum spanning tree for edge weights and counts what overlaps in it.

    Light edges become creases, heavy ones are cut; the flat forest of the panels is in every tree. What
    overlaps does not depend on the base face.

    Attributes:
        graph: the dual graph.
        grower: grows the trees one by one.
        judged: trees judged so far.
    """

    def __init__(self, graph: DualGraph) -> None:
        """Prepare the arrays.

        Raises:
            NetError: if the goal is not one piece.
        """
        if graph.pieces != 1:
            raise NetError(
                f"{graph.goal.name}: the faces are not one piece but {graph.pieces}; "
                "fold each piece by itself"
            )
        self.graph = graph
        self.grower = TreeGrower(graph)
        self.judged = 0
        self._rings = vertex_rings(graph, 2.0 * np.pi + HYPERBOLIC_SLACK_RAD)

    @property
    def hyperbolic(self) -> NDArray[np.int64]:
        """Vertices whose angles add up to more than a full turn."""
        return self._rings.vertex

    @property
    def work(self) -> int:
        """Faces laid flat and tested for overlap so far."""
        return self.judged * len(self.graph.goal.faces)

    def judge(self, weights: NDArray[np.float64]) -> NDArray[np.int64]:
        """(K, 2) overlapping pairs of faces, and fans of more than a full turn, in the tree of each row.

        A fan is a run of faces around a vertex from cut to cut; one of more than a full turn overlaps itself.

        Args:
            weights: (K, M) weight of every interior edge.
        """
        rows = np.ascontiguousarray(weights, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != len(self.graph.faces):
            raise NetError(f"weights have the shape (trees, {len(self.graph.faces)}), got {rows.shape}")
        out = np.zeros((len(rows), 2), dtype=np.int64)
        rings, grower = self._rings, self.grower
        judge_trees(grower.arrays, grower.rank, rows, grower.tie, rings.edge, rings.angle, rings.first, out)
        self.judged += len(rows)
        return out

    def tree(self, weight: NDArray[np.float64]) -> NDArray[np.bool_]:
        """(M,) the tree for one row of weights."""
        return self.grower.weighted(weight)

    def cut_length(self, weight: NDArray[np.float64]) -> float:
        """Length of all cuts of that tree, each side of a cut counted once, mm."""
        return float(self.graph.length[~self.tree(weight) & ~self.graph.flat].sum())
