"""Which faces of a flat net overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner._kernels.overlap_kernels import all_overlaps
from planner.layout_arrays import triangle_arrays
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
    return [(one, other) for one, other in overlapping_pairs(triangles).tolist()]


def overlapping_pairs(triangles: NDArray[np.float64]) -> NDArray[np.int64]:
    """The same pairs as rows of an array (P, 2)."""
    corners = np.asarray(triangles, dtype=np.float64)
    faces = len(corners)
    if faces == 0:
        return np.empty((0, 2), dtype=np.int64)
    arrays = triangle_arrays(corners)
    pairs = np.empty((16 * faces, 2), dtype=np.int64)
    found = all_overlaps(arrays, pairs, len(pairs))
    if found > len(pairs):
        pairs = np.empty((found, 2), dtype=np.int64)
        found = all_overlaps(arrays, pairs, len(pairs))
    pairs = np.sort(pairs[:found], axis=1)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def overlapping_faces(net: Net) -> list[tuple[int, int]]:
    """Pairs (lower, higher) of faces of ``net`` that overlap in the plane; see ``overlapping_triangles``."""
    return overlapping_triangles(net.vertices[net.faces])
