"""The linear programme of spanning trees that obey no-goods: bounds, multipliers and shares of edges.

Spanning trees of a planar dual graph and the cuts that they leave are described exactly by two arborescences
that share out the edges: one of faces towards a root face, one of vertices towards a root vertex of that face
(Williams, A linear-size zero-one programming model for the minimum spanning tree problem in planar graphs,
Networks 2002; the roots touch as Validi and Buchanan, 2019, require). All vertices of a boundary loop count
as one. On surfaces of higher genus an edge may belong to neither; there it is a relaxation, and cycles are
cut off where they occur.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.linear_program import LinearProgram
from planner.no_goods import NoGood

__all__ = ["TreeProgram", "TreeShares"]


@dataclass(frozen=True, eq=False)
class TreeShares:
    """A solution of the programme.

    Attributes:
        value: edits, from below.
        kept: (M,) share to which every edge is a crease.
        multipliers: (N,) of the no-goods, in the order in which they were added.
    """

    value: float
    kept: NDArray[np.float64]
    multipliers: NDArray[np.float64]


class TreeProgram:
    """Grows by no-goods, and is solved again and again with some edges fixed.

    Columns: for every edge e whether face 0 or face 1 hangs on the other across it (2e, 2e + 1), the same for
    its vertices (2M + 2e, 2M + 2e + 1), neither (4M + e), and last a share of all no-goods that may be broken
    at a high price, so that there always is a solution.
    """

    def __init__(self, graph: DualGraph, blooming: NDArray[np.bool_], frozen: NDArray[np.bool_]) -> None:
        """Set up the programme without no-goods.

        Args:
            graph: the dual graph of the goal, one piece.
            blooming: (M,) the tree from which edits are counted.
            frozen: (M,) edges that are creases in any case.
        """
        faces, edges = len(graph.goal.faces), len(graph.faces)
        self._edges = edges
        node = vertex_nodes(graph)
        nodes = int(node.max()) + 1
        self.is_exact = nodes + faces == edges + 2
        root_face = 0
        root_node = int(node[graph.goal.faces[root_face, 0]])
        columns = 5 * edges + 1
        price = 10.0 * (faces + 1.0)
        cost = np.zeros(columns)
        cost[: 2 * edges] = np.repeat(~blooming, 2)
        cost[-1] = price
        high = np.ones(columns)
        high[-1] = np.inf
        high[: 2 * edges][graph.faces.ravel() == root_face] = 0.0
        ends = node[graph.vertices]
        loops = ends[:, 0] == ends[:, 1]
        high[2 * edges : 4 * edges][(ends.ravel() == root_node) | np.repeat(loops, 2)] = 0.0
        if self.is_exact:
            high[4 * edges : 5 * edges] = 0.0
        self._high = high
        self._frozen = np.flatnonzero(frozen).tolist()
        # rows: one per edge, one per face but the root, one per vertex but the root
        each = np.arange(edges)
        row_face = np.where(np.arange(faces) > root_face, edges - 1, edges) + np.arange(faces)
        row_node = edges + faces - 1 + np.arange(nodes) - (np.arange(nodes) > root_node)
        arc = np.arange(2 * edges)
        rows = [np.repeat(each, 2), np.repeat(each, 2), each]
        cols = [arc, 2 * edges + arc, 4 * edges + each]
        for start, owner, root, row in (
            (0, graph.faces.ravel(), root_face, row_face),
            (2 * edges, ends.ravel(), root_node, row_node),
        ):
            inner = owner != root
            rows.append(row[owner[inner]])
            cols.append(start + arc[inner])
        self._program = LinearProgram(
            cost, high, np.concatenate(rows), np.concatenate(cols), np.ones(edges + faces + nodes - 2)
        )
        self._ends: list[list[int]] = graph.faces.tolist()
        self._faces = faces
        self._rows = 0
        self._place: list[int] = []

    def add(self, no_goods: Sequence[NoGood]) -> None:
        """Add no-goods."""
        self._place.extend(range(self._rows, self._rows + len(no_goods)))
        self._add([(item.edges, len(item.edges) - item.cut_at_least) for item in no_goods], [-1.0])

    def solve(self, fixed: Mapping[int, bool], seconds: float) -> TreeShares | None:
        """Fewest edits where the edges of ``fixed`` are in or out; None if no tree is left.

        Args:
            fixed: edge to True (crease) or False (cut).
            seconds: time limit.

        Raises:
            OutOfTimeError: if the time limit was reached.
        """
        high = self._high.copy()
        edges = self._edges
        for e in (*self._frozen, *(e for e, keep in fixed.items() if keep)):
            high[2 * edges + 2 * e : 2 * edges + 2 * e + 2] = 0.0
            high[4 * edges + e] = 0.0
        for e, keep in fixed.items():
            if not keep:
                high[2 * e : 2 * e + 2] = 0.0
        deadline = time.perf_counter() + seconds
        while True:
            solution = self._program.solve(high, deadline - time.perf_counter())
            if solution is None:
                return None
            value, columns, duals = solution
            shares = np.clip(columns[: 2 * edges].reshape(-1, 2).sum(axis=1), 0.0, 1.0)
            rings = [] if self.is_exact else self._rings(shares)
            if not rings:
                return TreeShares(value, shares, np.maximum(-duals[self._place], 0.0))
            self._add(rings, [])

    def _add(self, limits: list[tuple[tuple[int, ...], int]], broken: list[float]) -> None:
        """Rows "of these edges at most so many are creases", with the column that may break them."""
        last = [5 * self._edges] * len(broken)
        self._program.add(
            [
                (
                    [column for e in chosen for column in (2 * e, 2 * e + 1)] + last,
                    [1.0] * (2 * len(chosen)) + broken,
                    float(limit),
                )
                for chosen, limit in limits
            ]
        )
        self._rows += len(limits)

    def _rings(self, shares: NDArray[np.float64]) -> list[tuple[tuple[int, ...], int]]:
        """Sets of faces that have more creases among them than a tree can: their inner edges, most creases.

        Looked for among the sets that Kruskal's algorithm joins, edges of larger share first.
        """
        group = list(range(self._faces))
        members: list[list[int]] = [[f] for f in range(self._faces)]
        inner: list[list[int]] = [[] for _ in range(self._faces)]
        found: dict[int, tuple[tuple[int, ...], int]] = {}
        for e in np.argsort(-shares, kind="stable").tolist():
            if shares[e] < 1e-6:
                break
            a, b = group[self._ends[e][0]], group[self._ends[e][1]]
            if a != b:
                if len(members[a]) < len(members[b]):
                    a, b = b, a
                for f in members[b]:
                    group[f] = a
                members[a] += members[b]
                inner[a] += inner[b]
            inner[a].append(e)
            if shares[inner[a]].sum() > len(members[a]) - 1 + 1e-6:
                found.setdefault(a, (tuple(inner[a]), len(members[a]) - 1))
        return list(found.values())


def vertex_nodes(graph: DualGraph) -> NDArray[np.int64]:
    """(V,) number of every vertex where all vertices of one boundary loop count as one."""
    goal = graph.goal
    parent = list(range(len(goal.vertices)))

    def root(v: int) -> int:
        while parent[v] != v:
            parent[v] = parent[parent[v]]
            v = parent[v]
        return v

    for face, slot in graph.boundary.tolist():
        a, b = int(goal.faces[face, slot]), int(goal.faces[face, (slot + 1) % 3])
        parent[root(a)] = root(b)
    roots = [root(v) for v in range(len(parent))]
    number: NDArray[np.int64] = np.unique(roots, return_inverse=True)[1].astype(np.int64)
    return number
