"""The arrays that all kernels of nets work on: faces, interior edges, rooted tree, layout and hash grid.

A face is a fixed triangle in a frame of its own and a pose (cos, sin, x, y) in the plane. The record has few, wide
arrays because the time to compile a kernel grows with the number of arrays that it is given.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

# columns of NetArrays.real: corners (x, y each) in the face's frame and in the plane, side lengths, pose,
# centroid, radius of the circle about the centroid, side of a grid cell (the same in every row)
CENTRE, RADIUS, CORNER, SIDE, POSE, LOCAL, CELL, REALS = 0, 2, 3, 9, 12, 16, 22, 24

# rows of NetArrays.node: interior edge on each side (-1: boundary), the rooted tree (depth in folds, hops in
# creases), 1 for the marked component, number of the last query, grid entries (first, used), the two
# components of a cut and the edges through which their faces were reached
SIDES, PARENT, SLOT, CREASE, DEPTH, HOPS, ORDER, MARK, STAMP, FIRST, USED, PART, VIA, NODES = (
    0, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15, 17,
)  # fmt: skip

# columns of NetArrays.edge: faces, their slots, flat, flat and never cut, in the tree, in the blooming tree,
# on the outline of the base panel
FACES, SLOTS, FLAT, FROZEN, TREE, BLOOMING, OUTLINE, EDGES = 0, 2, 4, 5, 6, 7, 8, 9

# entries of NetArrays.number: base face, last query, size of the marked component, faces tested while moving, faces in
# the way of tabs
BASE, QUERY, SIZE, TESTED, BLOCKED, NUMBERS = 0, 1, 2, 3, 4, 5


class NetArrays(NamedTuple):
    """Dual graph, tree, flat layout and hash grid as plain arrays (F faces, M interior edges)."""

    real: Floats  # (F + 1, REALS); the last row is for a triangle that is being tested
    node: Ints  # (NODES, F)
    edge: Ints  # (M, EDGES)
    turn: Floats  # (M, 2) rotation from the frame of face 0 to that of face 1 when laid flat
    head: Ints  # (buckets,) first grid entry
    entry: Ints  # (E, 4) next, previous, bucket, face
    number: Ints  # (NUMBERS,)
