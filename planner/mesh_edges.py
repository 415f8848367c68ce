"""Tables of edges and neighbours of a triangle mesh, all by array operations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["EdgeTable", "boundary_loops", "components", "edge_table", "face_heights", "fold_angles"]


@dataclass(frozen=True, eq=False)
class EdgeTable:
    """The undirected edges of a triangle mesh.

    Attributes:
        edges: (E, 2) vertex indices, smaller first, sorted.
        of_face: (F, 3) edge from corner k to corner k + 1 of each face.
        count: (E,) faces at each edge.
        pairs: (P, 2) faces on both sides of each edge that has exactly two.
        pair_edge: (P,) the edge of each pair.
        same_way: (P,) both faces run along the edge in the same direction: their windings disagree.
    """

    edges: NDArray[np.int64]
    of_face: NDArray[np.int64]
    count: NDArray[np.int64]
    pairs: NDArray[np.int64]
    pair_edge: NDArray[np.int64]
    same_way: NDArray[np.bool_]


def edge_table(faces: NDArray[np.int64]) -> EdgeTable:
    """Edges of ``faces`` (F, 3); faces that name a vertex twice must be gone before."""
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    stride = int(faces.max()) + 1 if len(faces) else 1
    keys, inverse, count = np.unique(low * stride + high, return_inverse=True, return_counts=True)
    order = np.argsort(inverse, kind="stable")
    first = np.cumsum(count) - count
    double = np.flatnonzero(count == 2)
    one, two = order[first[double]], order[first[double] + 1]
    return EdgeTable(
        edges=np.column_stack([keys // stride, keys % stride]),
        of_face=inverse.reshape(-1, 3).astype(np.int64),
        count=count.astype(np.int64),
        pairs=np.column_stack([one // 3, two // 3]),
        pair_edge=double.astype(np.int64),
        same_way=start[one] == start[two],
    )


def components(count: int, links: NDArray[np.int64]) -> NDArray[np.int64]:
    """(count,) number of the connected component of each node under the undirected ``links`` (L, 2)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    data = np.ones(len(links), dtype=np.int8)
    graph = coo_array((data, (links[:, 0], links[:, 1])), shape=(count, count))
    labels: NDArray[np.int64] = connected_components(graph.tocsr(), directed=False)[1].astype(np.int64)
    return labels


def boundary_loops(table: EdgeTable) -> int:
    """Number of closed boundary curves of an edge- and vertex-manifold mesh with the edges ``table``."""
    rim = table.edges[table.count == 1]
    if not len(rim):
        return 0
    vertices, links = np.unique(rim, return_inverse=True)
    return int(components(len(vertices), links.reshape(-1, 2)).max()) + 1


def face_heights(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(F,) smallest height of each triangle: twice its area over its longest side, in the vertices' unit."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    double_area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.sqrt(np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0))
    heights: NDArray[np.float64] = np.divide(
        double_area, longest, out=np.zeros_like(longest), where=longest > 0.0
    )
    return heights


def fold_angles(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], table: EdgeTable
) -> NDArray[np.float64]:
    """(P,) fold angle in rad of every pair of ``table``: 0 flat, positive convex, negative reflex.

    The windings must agree. Source: angle of the unit normals by atan2 of sine and cosine.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    one, two = normals[table.pairs[:, 0]], normals[table.pairs[:, 1]]
    sine = np.linalg.norm(np.cross(one, two), axis=1)
    size = np.arctan2(sine, np.einsum("ij,ij->i", one, two))
    # the far corner of the second face lies behind the plane of the first where the edge is convex
    second = faces[table.pairs[:, 1]]
    ends = table.edges[table.pair_edge]
    far = second[(second != ends[:, :1]) & (second != ends[:, 1:])]
    behind = np.einsum("ij,ij->i", vertices[far] - vertices[ends[:, 0]], one) <= 0.0
    angles: NDArray[np.float64] = np.where(behind, size, -size)
    return angles
