"""Which branches of an overlapping net weigh least and have to go: an integer programme."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout

__all__ = ["face_areas", "lightest_branches"]

NODE_LIMIT = 20_000
"""Branchings of one integer programme; it counts work, so that results do not depend on the machine."""


def lightest_branches(layout: FlatLayout, pairs: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(F,) faces of least total area without which no pair of ``pairs`` (P, 2) overlaps.

    Of a tree whole branches go: x_child >= x_parent, x_f + x_g >= 1 for every pair, minimum of the sum of
    area times x; the base panel stays. Where each side of it that a tab could hold is a crease, one of the
    faces beyond goes as well. Solved with HiGHS (``scipy.optimize.milp``); if ``NODE_LIMIT`` ends it, the
    best choice found.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import coo_array

    graph = layout.graph
    count = len(layout.parent)
    gone = np.zeros(count, dtype=np.bool_)
    beside = [] if layout.free_edges() else _beyond(layout)
    if not len(pairs) and not beside:
        return gone
    parent, order = layout.parent.tolist(), layout.order.tolist()
    relevant = {*pairs.ravel().tolist(), *beside}
    for face in reversed(order):
        if face in relevant and parent[face] >= 0:
            relevant.add(parent[face])
    column = {face: number for number, face in enumerate(sorted(relevant))}
    stands_for = [-1] * count  # the nearest relevant face on the way to the base
    for face in order:
        stands_for[face] = face if face in relevant else stands_for[parent[face]]
    areas = face_areas(graph)
    cost = np.zeros(len(column))
    for face in range(count):
        cost[column[stands_for[face]]] += areas[face]
    rows: list[tuple[int, int, int]] = []
    for number, (one, other) in enumerate(pairs.tolist()):
        rows += [(number, column[one], 1), (number, column[other], 1)]
    least = [1.0] * len(pairs)
    if beside:
        rows += [(len(least), column[face], 1) for face in beside]
        least.append(1.0)
    for face in sorted(relevant):
        if parent[face] >= 0:
            rows += [(len(least), column[face], 1), (len(least), column[parent[face]], -1)]
            least.append(0.0)
    at, which, value = np.array(rows).T
    matrix = coo_array((value.astype(np.float64), (at, which)), shape=(len(least), len(column))).tocsr()
    most = np.array([0.0 if layout.depth[face] == 0 else 1.0 for face in sorted(relevant)])
    result = milp(
        cost / cost.max(),
        integrality=np.ones(len(cost), dtype=np.int64),
        bounds=Bounds(np.zeros(len(cost)), most),
        constraints=LinearConstraint(matrix, np.array(least), np.inf),
        options={"node_limit": NODE_LIMIT, "mip_rel_gap": 1e-9},
    )
    taken = most if result.x is None else result.x
    for face in range(count):
        gone[face] = taken[column[stands_for[face]]] > 0.5
    return gone


def _beyond(layout: FlatLayout) -> list[int]:
    """Faces that hang on the sides of the base panel which are long enough for a tab."""
    edges = layout.outline[:, 2]
    below = layout.graph.faces[edges[edges >= 0]].ravel()
    crease = layout.crease[below]
    faces = np.unique(below[(layout.depth[below] > 0) & np.isin(crease, edges)])
    return [int(face) for face in faces]


def face_areas(graph: DualGraph) -> NDArray[np.float64]:
    """(F,) area of every face, mm²."""
    corners = graph.flat_corners
    area: NDArray[np.float64] = 0.5 * corners[:, 1, 0] * corners[:, 2, 1]
    return area
