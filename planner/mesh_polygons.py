"""Polygons to triangles: ear clipping that keeps every vertex and says where a polygon was not flat."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.raw_mesh import RawMesh, TriangleMesh, counted, file_error

__all__ = ["FLATNESS", "triangulate"]

FLATNESS = 5e-4
"""A polygon is flat when no corner is further from its mean plane than this fraction of its size."""

_MOST_CORNERS = 500


def triangulate(raw: RawMesh) -> TriangleMesh:
    """Cut every polygon of ``raw`` into triangles; triangles stay as they are, in their order.

    Vertices that only sit in the middle of a straight edge between the same two polygons are taken out, as
    they would make polygons with a vertex of degree two. The choice of diagonals is reported for polygons
    that are not flat, because there it changes the shape.

    Raises:
        MeshError: a polygon has too many corners, crosses itself or has no area.
    """
    notices = list(raw.notices)
    if (raw.sizes == 3).all():
        return TriangleMesh(
            raw.vertices, raw.corners.reshape(-1, 3), np.arange(len(raw.sizes)), raw, tuple(notices)
        )
    corners, sizes = raw.corners, raw.sizes
    middle = _mid_edge_corners(raw)
    if middle.any():
        gone = len(np.unique(corners[middle]))
        owner = np.repeat(np.arange(len(sizes)), sizes)
        sizes = sizes - np.bincount(owner[middle], minlength=len(sizes))
        corners = corners[~middle]
        notices.append(
            f"removed {counted(gone, 'vertex', 'vertices')} in the middle of straight edges "
            "between two polygons"
        )
    ends = np.cumsum(sizes)
    triangles: list[NDArray[np.int64]] = []
    origin: list[int] = []
    bent: list[int] = []
    few: list[int] = []
    cut = 0
    for polygon, (size, end) in enumerate(zip(sizes.tolist(), ends.tolist(), strict=True)):
        loop = corners[end - size : end]
        loop = loop[loop != np.roll(loop, 1)] if size > 3 else loop
        if len(loop) < 3:
            few.append(polygon)
            continue
        if len(loop) == 3:
            triangles.append(loop.reshape(1, 3))
            origin.append(polygon)
            continue
        if len(loop) > _MOST_CORNERS:
            raise file_error(
                raw.source,
                f"{raw.place(polygon)} has {len(loop)} corners, more than {_MOST_CORNERS}",
                "triangulate the mesh in a modelling program first",
            )
        flat, deviation = _flattened(raw.vertices[loop])
        ears = _ear_clip(flat)
        if ears is None:
            raise file_error(
                raw.source,
                f"{raw.place(polygon)} with {len(loop)} corners crosses itself or has no area",
                "correct the polygon or triangulate the mesh in a modelling program",
            )
        if deviation > FLATNESS:
            bent.append(polygon)
        triangles.append(loop[ears])
        origin.extend([polygon] * len(ears))
        cut += 1
    if few:
        notices.append(
            f"removed {counted(len(few), 'face')} with fewer than three corners ({raw.place(few[0])})"
        )
    if cut:
        notices.append(f"cut {counted(cut, 'polygon')} into triangles")
    if bent:
        notices.append(
            f"{counted(len(bent), 'polygon')} not flat (first: {raw.place(bent[0])}): "
            "folds along the diagonals that were chosen"
        )
    if not triangles:
        raise file_error(raw.source, "no face has three different corners", "export the mesh again")
    faces = np.concatenate(triangles)
    return TriangleMesh(raw.vertices, faces, np.array(origin, dtype=np.int64), raw, tuple(notices))


def _mid_edge_corners(raw: RawMesh) -> NDArray[np.bool_]:
    """(N,) corners of vertices that lie straight between the same two neighbours in both their polygons."""
    corners, sizes = raw.corners, raw.sizes
    ends = np.cumsum(sizes)
    position = np.arange(len(corners))
    owner = np.repeat(np.arange(len(sizes)), sizes)
    first = (ends - sizes)[owner]
    before = corners[first + (position - first - 1) % sizes[owner]]
    after = corners[first + (position - first + 1) % sizes[owner]]
    out = np.zeros(len(corners), dtype=np.bool_)
    uses = np.bincount(corners, minlength=len(raw.vertices))
    order = np.argsort(corners, kind="stable")
    start = np.cumsum(uses) - uses
    for vertex in np.flatnonzero(uses == 2).tolist():
        i, j = order[start[vertex]], order[start[vertex] + 1]
        if before[i] != after[j] or after[i] != before[j] or min(sizes[owner[i]], sizes[owner[j]]) < 4:
            continue
        a, v, b = raw.vertices[before[i]], raw.vertices[vertex], raw.vertices[after[i]]
        span = float(np.linalg.norm(b - a))
        if float(np.linalg.norm(np.cross(b - a, v - a))) <= 1e-6 * span * span and (v - a) @ (b - v) > 0.0:
            out[[i, j]] = True
    left = sizes - np.bincount(owner[out], minlength=len(sizes))
    if (left < 3).any():  # a polygon would vanish: leave all as it is
        out[:] = False
    return out


def _flattened(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """(n, 2) points in the mean plane, counter-clockwise, and the largest distance from it over their size.

    Source: Newell's method for the normal of a polygon.
    """
    centred = points - points.mean(axis=0)
    following = np.roll(centred, -1, axis=0)
    normal = np.cross(centred, following).sum(axis=0)
    size = float(np.linalg.norm(centred, axis=1).max())
    length = float(np.linalg.norm(normal))
    if size == 0.0 or length < 1e-12 * size * size:
        return np.zeros((len(points), 2)), 0.0
    normal /= length
    x_axis = np.zeros(3)
    x_axis[np.argmin(np.abs(normal))] = 1.0
    x_axis -= normal * (x_axis @ normal)
    x_axis /= np.linalg.norm(x_axis)
    flat = np.column_stack([centred @ x_axis, centred @ np.cross(normal, x_axis)])
    return flat, float(np.abs(centred @ normal).max()) / size


def _ear_clip(points: NDArray[np.float64]) -> NDArray[np.int64] | None:
    """(n - 2, 3) ears of a simple counter-clockwise polygon (n, 2), best shaped first; None if there is none.

    Source: the two-ears theorem (Meisters 1975); of all ears the one with the largest smallest height over
    longest side is taken, and no vertex may lie on its diagonal, so that straight runs lose no vertex.
    """
    ring = list(range(len(points)))
    scale = float(np.abs(points).max())
    if scale == 0.0:
        return None
    score = [_ear_score(points, ring, k, scale) for k in range(len(ring))]
    ears = []
    while len(ring) > 3:
        best = int(np.argmax(score))
        if score[best] <= 0.0:
            return None
        ears.append((ring[best - 1], ring[best], ring[(best + 1) % len(ring)]))
        del ring[best], score[best]
        for k in range(len(ring)):
            # only the two neighbours change shape, but a clipped vertex may free any ear that it blocked
            if k in ((best - 1) % len(ring), best % len(ring)) or score[k] <= 0.0:
                score[k] = _ear_score(points, ring, k, scale)
    if _ear_score(points, ring, 1, scale) <= 0.0:
        return None
    ears.append((ring[0], ring[1], ring[2]))
    return np.array(ears, dtype=np.int64)


def _ear_score(points: NDArray[np.float64], ring: list[int], k: int, scale: float) -> float:
    """Quality of the ear at ``ring[k]``: twice its area over its longest side squared; 0 if it is no ear."""
    p, q, r = ring[k - 1], ring[k], ring[(k + 1) % len(ring)]
    a, b, c = points[p], points[q], points[r]
    sides = ((b - a), (c - b), (a - c))
    double_area = float(sides[0][0] * sides[1][1] - sides[0][1] * sides[1][0])
    longest = max(float(s @ s) for s in sides)
    if double_area <= 1e-7 * longest or longest == 0.0:
        return 0.0
    others = points[[i for i in ring if i not in (p, q, r)]]
    inside = np.ones(len(others), dtype=np.bool_)
    for corner, side in zip((a, b, c), sides, strict=True):
        away = others - corner
        inside &= side[0] * away[:, 1] - side[1] * away[:, 0] >= -1e-9 * scale * scale
        inside &= (np.abs(away) > 1e-12 * scale).any(axis=1)  # a repeated corner blocks nothing
    return 0.0 if inside.any() else double_area / longest
