"""Which faces of a flat net overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner._kernels import net_kernels as k
from planner.net import Net

__all__ = ["overlapping_faces", "overlapping_triangles"]


def overlapping_triangles(triangles: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Pairs (lower, higher) of counter-clockwise triangles that overlap, in ascending order.

    Two triangles overlap if they penetrate each other deeper than ``OVERLAP_TOLERANCE_MM`` (0.1 micrometre, a
    thousandth of a kerf), measured as the least distance by which one of them would have to move: touching
    along an edge or at a corner is no overlap, and nothing is shrunk.

    Args:
        triangles: (F, 3, 2) corners in mm.
    """
    corners = np.asarray(triangles, dtype=np.float64)
    faces = len(corners)
    if faces == 0:
        return []
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    longest = sides.max(axis=1)
    cell = max(float(longest.mean()), float(longest.max()) / 16.0)
    per_face = (np.floor(longest / cell).astype(np.int64) + 2) ** 2
    centre = corners.mean(axis=1)
    real = np.zeros((faces + 1, k.REALS))
    real[:-1, k.CORNER : k.CORNER + 6] = corners.reshape(-1, 6)
    real[:-1, k.SIDE : k.SIDE + 3] = sides
    real[:-1, k.CENTRE : k.CENTRE + 2] = centre
    real[:-1, k.RADIUS] = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    real[:, k.CELL] = cell
    node = np.zeros((k.NODES, faces), dtype=np.int64)
    node[k.FIRST, 1:] = np.cumsum(per_face)[:-1]
    arrays = k.NetArrays(
        real=real,
        node=node,
        edge=np.zeros((0, k.EDGES), dtype=np.int64),
        turn=np.zeros((0, 2)),
        head=np.full(1 << max(4, int(np.ceil(np.log2(4 * faces)))), -1, dtype=np.int64),
        entry=np.zeros((int(per_face.sum()), 4), dtype=np.int64),
        number=np.zeros(k.NUMBERS, dtype=np.int64),
    )
    pairs = np.empty((4 * faces, 2), dtype=np.int64)
    found = k.all_overlaps(arrays, pairs, len(pairs))
    if found > len(pairs):
        pairs = np.empty((found, 2), dtype=np.int64)
        arrays.head[:] = -1
        found = k.all_overlaps(arrays, pairs, len(pairs))
    return sorted((min(a, b), max(a, b)) for a, b in pairs[:found].tolist())


def overlapping_faces(net: Net) -> list[tuple[int, int]]:
    """Pairs (lower, higher) of faces of ``net`` that overlap in the plane; see ``overlapping_triangles``."""
    return overlapping_triangles(net.vertices[net.faces])
