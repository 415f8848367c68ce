"""From a rooted tree of faces to the net: flat positions, shared vertices, edges with their assignment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.dual_graph import DualGraph
from planner.net import Net, NetCertificate

__all__ = ["net_from_tree"]


def net_from_tree(
    graph: DualGraph,
    parent: NDArray[np.int64],
    crease: NDArray[np.int64],
    order: NDArray[np.int64],
    base: int,
    certificate: NetCertificate | None = None,
) -> Net:
    """Lay the faces of ``graph`` flat along a tree, base face first.

    The base face has corner 0 at the origin and corner 1 on +x. Faces joined by a crease share its two
    vertices; vertices are duplicated along cuts. Edges are numbered by the goal's interior edges (a cut one
    gives two edges), then the goal's boundary.

    Args:
        graph: the dual graph of the goal.
        parent: (F,) parent face, -1 for the base.
        crease: (F,) interior edge that joins a face to its parent, -1 for the base.
        order: (F,) faces, every parent before its children.
        base: the stationary face.
        certificate: how near to blooming the net is.
    """
    count = len(parent)
    local = graph.flat_corners[..., 0] + 1j * graph.flat_corners[..., 1]
    turn = graph.turn[:, 0] + 1j * graph.turn[:, 1]
    heading = np.ones(count, dtype=np.complex128)
    points: list[complex] = []
    corners = np.empty((count, 3), dtype=np.int64)
    for face in order.tolist():
        if face == base:
            corners[face] = [0, 1, 2]
            points.extend(complex(p) for p in local[face])
            continue
        edge, up = int(crease[face]), int(parent[face])
        i = 0 if graph.faces[edge, 0] == face else 1
        heading[face] = heading[up] * (turn[edge] if i == 1 else turn[edge].conjugate())
        heading[face] /= abs(heading[face])
        start, there = int(graph.slots[edge, i]), int(graph.slots[edge, 1 - i])
        corners[face, start] = corners[up, (there + 1) % 3]
        corners[face, (start + 1) % 3] = corners[up, there]
        corners[face, (start + 2) % 3] = len(points)
        apex = local[face, (start + 2) % 3]
        near = min((start, (start + 1) % 3), key=lambda k: abs(local[face, k] - apex))
        points.append(points[int(corners[face, near])] + complex(heading[face] * (apex - local[face, near])))
    tree = np.zeros(len(graph.faces), dtype=np.bool_)
    tree[crease[crease >= 0]] = True
    number = np.cumsum(np.where(tree, 1, 2)) - np.where(tree, 1, 2)
    total = int(np.where(tree, 1, 2).sum())
    edges = np.empty((total + len(graph.boundary), 2), dtype=np.int64)
    letters = np.full(len(edges), "B", dtype="<U1")
    angles = np.zeros(len(edges))
    for edge in range(len(tree)):
        for i in range(1 if tree[edge] else 2):
            face, slot = int(graph.faces[edge, i]), int(graph.slots[edge, i])
            edges[number[edge] + i] = corners[face, slot], corners[face, (slot + 1) % 3]
        if tree[edge]:
            at = number[edge]
            letters[at] = "F" if graph.flat[edge] else ("V" if graph.fold_angle[edge] > 0.0 else "M")
            angles[at] = 0.0 if graph.flat[edge] else graph.fold_angle[edge]
    for i, (face, slot) in enumerate(graph.boundary.tolist()):
        edges[total + i] = corners[face, slot], corners[face, (slot + 1) % 3]
    return Net(
        goal=graph.goal,
        base_face=int(base),
        vertices=np.array([[p.real, p.imag] for p in points]),
        faces=corners,
        parent=parent,
        edges=edges,
        assignment=letters,
        fold_angle=angles,
        crease_of=np.append(number, -1)[crease],
        certificate=certificate or NetCertificate(0, 0),
    )
