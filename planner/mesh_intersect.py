"""Self-intersection of a triangle mesh: which pairs of faces pass through or lie on one another.

Touching is allowed, within ``tolerance``; shared corners and edges are told apart from intersections. A pair
intersects when

1. both triangles have corners strictly on both sides of the other's plane, and the two stretches that they
   cut from the common line of the planes overlap (Möller 1997), or
2. an edge of one lies in the other, and the two faces at that edge are on opposite sides of it, or
3. both lie in one plane and overlap in area (separating axes in that plane).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.mesh_edges import EdgeTable, edge_table

__all__ = ["intersecting_pairs"]

_CHUNK = 1_000_000


def intersecting_pairs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], *, tolerance: float | None = None
) -> NDArray[np.int64]:
    """Pairs of faces that intersect, each pair once and sorted.

    Args:
        vertices: (V, 3) positions.
        faces: (F, 3) corner indices of triangles with area, at most two at each edge.
        tolerance: distance within which faces only touch, in the unit of the vertices; default one
            millionth of the longest side.

    Returns:
        (K, 2) face indices, the smaller first.
    """
    box = np.ptp(vertices[faces.ravel()], axis=0)
    near = 1e-6 * float(box.max()) if tolerance is None else tolerance
    corners = vertices[faces]
    table = edge_table(faces)
    found = [
        _narrow(candidates, corners, faces, table, near)
        for candidates in _close_boxes(corners, near, int(np.argmax(box)))
    ]
    pairs = np.concatenate([np.zeros((0, 2), dtype=np.int64), *found])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def _close_boxes(corners: NDArray[np.float64], near: float, axis: int) -> list[NDArray[np.int64]]:
    """Pairs of faces whose bounding boxes come within ``near``, in chunks, by sort and sweep."""
    low, high = corners.min(axis=1) - near, corners.max(axis=1) + near
    order = np.argsort(low[:, axis], kind="stable")
    last = np.searchsorted(low[order, axis], high[order, axis], side="right")
    width = last - np.arange(len(order)) - 1
    ends = np.cumsum(width)
    chunks = []
    begin = 0
    while begin < len(order):
        done = ends[begin - 1] if begin else 0
        stop = max(int(np.searchsorted(ends, done + _CHUNK, side="right")), begin + 1)
        rows = np.repeat(np.arange(begin, stop), width[begin:stop])
        offset = np.arange(len(rows)) - np.repeat(
            ends[begin:stop] - width[begin:stop] - done, width[begin:stop]
        )
        one, two = order[rows], order[rows + 1 + offset]
        close: NDArray[np.bool_] = np.ones(len(one), dtype=np.bool_)
        for k in range(3):
            if k != axis:
                close &= (low[one, k] <= high[two, k]) & (low[two, k] <= high[one, k])
        chunks.append(np.column_stack([one[close], two[close]]))
        begin = stop
    return chunks


def _narrow(
    pairs: NDArray[np.int64],
    corners: NDArray[np.float64],
    faces: NDArray[np.int64],
    table: EdgeTable,
    near: float,
) -> NDArray[np.int64]:
    """The pairs that really intersect."""
    one, two = pairs[:, 0], pairs[:, 1]
    height_two = _plane_heights(corners[one], corners[two], faces[one], faces[two], near)
    height_one = _plane_heights(corners[two], corners[one], faces[two], faces[one], near)
    across = _both_sides(height_one) & _both_sides(height_two)
    hit = np.zeros(len(pairs), dtype=np.bool_)
    hit[across] = _stretches_overlap(
        corners[one[across]], corners[two[across]], height_one[across], height_two[across], near
    )
    flat = (height_one == 0.0).all(axis=1) | (height_two == 0.0).all(axis=1)
    hit[flat] |= _overlap_in_plane(corners[one[flat]], corners[two[flat]], near)
    for host, guest, heights in ((one, two, height_two), (two, one, height_one)):
        for k in range(3):
            lies = (
                (heights[:, k] == 0.0) & (heights[:, (k + 1) % 3] == 0.0) & (heights[:, (k + 2) % 3] != 0.0)
            )
            lies &= ~hit
            index = np.flatnonzero(lies)
            if len(index):
                hit[index] = _edge_pierces(
                    host[index], guest[index], k, heights[index, (k + 2) % 3], corners, faces, table, near
                )
    return pairs[hit]


def _plane_heights(
    host: NDArray[np.float64],
    guest: NDArray[np.float64],
    host_faces: NDArray[np.int64],
    guest_faces: NDArray[np.int64],
    near: float,
) -> NDArray[np.float64]:
    """(n, 3) signed heights of the guests' corners over the hosts' planes; 0 within ``near``, 0 if shared."""
    normals = np.cross(host[:, 1] - host[:, 0], host[:, 2] - host[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    heights: NDArray[np.float64] = np.einsum("nij,nj->ni", guest - host[:, :1], normals)
    heights[np.abs(heights) <= near] = 0.0
    heights[(guest_faces[:, :, None] == host_faces[:, None, :]).any(axis=2)] = 0.0
    return heights


def _both_sides(heights: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) some corner is above and some corner is below."""
    sides: NDArray[np.bool_] = (heights.max(axis=1) > 0.0) & (heights.min(axis=1) < 0.0)
    return sides


def _stretches_overlap(
    one: NDArray[np.float64],
    two: NDArray[np.float64],
    height_one: NDArray[np.float64],
    height_two: NDArray[np.float64],
    near: float,
) -> NDArray[np.bool_]:
    """(n,) the stretches on the common line of both planes overlap by more than a few ``near``."""
    line = np.cross(
        np.cross(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0]),
        np.cross(two[:, 1] - two[:, 0], two[:, 2] - two[:, 0]),
    )
    line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-300)
    origin = one[:, :1]
    low_one, high_one = _stretch(one - origin, height_one, line)
    low_two, high_two = _stretch(two - origin, height_two, line)
    overlap: NDArray[np.bool_] = np.minimum(high_one, high_two) - np.maximum(low_one, low_two) > 4.0 * near
    return overlap


def _stretch(
    points: NDArray[np.float64], heights: NDArray[np.float64], line: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where triangles cut the other plane: smallest and largest position along ``line``, each (n,)."""
    along = np.einsum("nij,nj->ni", points, line)
    low = np.where(heights == 0.0, along, np.inf).min(axis=1)
    high = np.where(heights == 0.0, along, -np.inf).max(axis=1)
    for k in range(3):
        m = (k + 1) % 3
        crosses = heights[:, k] * heights[:, m] < 0.0
        share = heights[:, k] / np.where(crosses, heights[:, k] - heights[:, m], 1.0)
        at = along[:, k] + share * (along[:, m] - along[:, k])
        low = np.minimum(low, np.where(crosses, at, np.inf))
        high = np.maximum(high, np.where(crosses, at, -np.inf))
    return low, high


def _overlap_in_plane(one: NDArray[np.float64], two: NDArray[np.float64], near: float) -> NDArray[np.bool_]:
    """(n,) triangles of one plane overlap by more than a few ``near`` along every edge normal of both."""
    normal = np.cross(one[:, 1] - one[:, 0], one[:, 2] - one[:, 0])
    depth = np.full(len(one), np.inf)
    for triangle in (one, two):
        for k in range(3):
            side = triangle[:, (k + 1) % 3] - triangle[:, k]
            axis = np.cross(normal, side)
            axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-300)
            a = np.einsum("nij,nj->ni", one - triangle[:, k : k + 1], axis)
            b = np.einsum("nij,nj->ni", two - triangle[:, k : k + 1], axis)
            depth = np.minimum(
                depth, np.minimum(a.max(axis=1) - b.min(axis=1), b.max(axis=1) - a.min(axis=1))
            )
    deep: NDArray[np.bool_] = depth > 4.0 * near
    return deep


def _edge_pierces(
    host: NDArray[np.int64],
    guest: NDArray[np.int64],
    k: int,
    third: NDArray[np.float64],
    corners: NDArray[np.float64],
    faces: NDArray[np.int64],
    table: EdgeTable,
    near: float,
) -> NDArray[np.bool_]:
    """(n,) edge k of each guest lies in its host, and the face behind that edge is on the other side.

    Args:
        host: (n,) faces whose plane holds the edge.
        guest: (n,) faces that the edge belongs to.
        k: the edge runs from corner k to corner k + 1 of the guest.
        third: (n,) height of the guest's remaining corner over the host's plane.
        corners: (F, 3, 3) corners of all faces.
        faces: (F, 3) corner indices.
        table: edges of the mesh.
        near: tolerance.
    """
    behind = np.full(len(table.edges), -1, dtype=np.int64)
    behind[table.pair_edge] = table.pairs.sum(axis=1)
    edge = table.of_face[guest, k]
    other = np.where(behind[edge] >= 0, behind[edge] - guest, -1)
    heights = _plane_heights(corners[host], corners[other], faces[host], faces[other], near)
    opposite = (other >= 0) & (other != host)
    opposite &= (heights * third[:, None]).min(axis=1) < 0.0
    start, end = corners[guest, k], corners[guest, (k + 1) % 3]
    length = np.linalg.norm(end - start, axis=1)
    low, high = np.zeros(len(host)), np.ones(len(host))
    triangle = corners[host]
    normal = np.cross(triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0])
    for m in range(3):
        side = triangle[:, (m + 1) % 3] - triangle[:, m]
        inward = np.cross(normal, side)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        at_start = np.einsum("ij,ij->i", start - triangle[:, m], inward) - near
        at_end = np.einsum("ij,ij->i", end - triangle[:, m], inward) - near
        falls, rises = (at_start > 0.0) & (at_end <= 0.0), (at_start <= 0.0) & (at_end > 0.0)
        root = at_start / np.where(falls | rises, at_start - at_end, 1.0)
        high = np.where(falls, np.minimum(high, root), high)
        low = np.where(rises, np.maximum(low, root), low)
        high = np.where((at_start <= 0.0) & (at_end <= 0.0), -1.0, high)
    pierces: NDArray[np.bool_] = opposite & ((high - low) * length > 4.0 * near)
    return pierces
