"""Overlap of triangles in the plane, found over a hash grid."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.net_arrays import (
    CELL,
    CENTRE,
    CORNER,
    FIRST,
    MARK,
    QUERY,
    RADIUS,
    SIDE,
    STAMP,
    USED,
    Floats,
    Ints,
    NetArrays,
)

OVERLAP_TOLERANCE_MM = 1e-4
"""Two faces overlap if no edge line separates them to within this depth: deeper than this is an overlap."""

NO_LIMIT = 1 << 60
"""More overlaps than any net has."""


@inner
def triangles_overlap(r: Floats, i: int, j: int) -> bool:
    """True if counter-clockwise triangles, rows i and j of r, penetrate deeper than the tolerance.

    Separating axes: the penetration depth of two convex polygons is attained at a normal of one of their
    sides.
    """
    for _ in range(2):
        for k in range(3):
            n = 0 if k == 2 else k + 1
            x, y = r[i, CORNER + 2 * k], r[i, CORNER + 2 * k + 1]
            dx, dy = r[i, CORNER + 2 * n] - x, r[i, CORNER + 2 * n + 1] - y
            limit = OVERLAP_TOLERANCE_MM * r[i, SIDE + k]
            if (
                dx * (r[j, CORNER + 1] - y) - dy * (r[j, CORNER] - x) <= limit
                and dx * (r[j, CORNER + 3] - y) - dy * (r[j, CORNER + 2] - x) <= limit
                and dx * (r[j, CORNER + 5] - y) - dy * (r[j, CORNER + 4] - x) <= limit
            ):
                return False
        i, j = j, i
    return True


@inner
def cells(r: Floats, i: int) -> Any:
    """First and last grid cell in x and in y that the bounding box of row i of r touches."""
    cell = r[0, CELL]
    x0, x1, y0, y1 = r[i, CORNER], r[i, CORNER], r[i, CORNER + 1], r[i, CORNER + 1]
    for k in range(2, 6, 2):
        x, y = r[i, CORNER + k], r[i, CORNER + k + 1]
        x0, x1, y0, y1 = min(x0, x), max(x1, x), min(y0, y), max(y1, y)
    return math.floor(x0 / cell), math.floor(x1 / cell), math.floor(y0 / cell), math.floor(y1 / cell)


@inner
def insert_face(s: NetArrays, face: int) -> None:
    """Enter a face into the grid cells that its bounding box touches."""
    x0, x1, y0, y1 = cells(s.real, face)
    mask = len(s.head) - 1
    at = s.node[FIRST, face]
    for x in range(x0, x1 + 1):
        for y in range(y0, y1 + 1):
            bucket = (x + 257 * y) & mask
            first = s.head[bucket]
            s.entry[at, 0], s.entry[at, 1], s.entry[at, 2], s.entry[at, 3] = first, -1, bucket, face
            if first >= 0:
                s.entry[first, 1] = at
            s.head[bucket] = at
            at += 1
    s.node[USED, face] = at - s.node[FIRST, face]


@inner
def remove_face(s: NetArrays, face: int) -> None:
    """Take a face out of the grid."""
    start = s.node[FIRST, face]
    for at in range(start, start + s.node[USED, face]):
        after, before = s.entry[at, 0], s.entry[at, 1]
        if before >= 0:
            s.entry[before, 0] = after
        else:
            s.head[s.entry[at, 2]] = after
        if after >= 0:
            s.entry[after, 1] = before
    s.node[USED, face] = 0


@inner
def count_hits(s: NetArrays, i: int, limit: int, out: Ints, at: int, room: int) -> int:
    """How many faces of the grid that are not marked overlap row i of ``real``; stops beyond ``limit``.

    Their numbers are written to ``out[at:room, 1]``.
    """
    s.number[QUERY] += 1
    query = s.number[QUERY]
    x0, x1, y0, y1 = cells(s.real, i)
    mask = len(s.head) - 1
    found = 0
    for x in range(x0, x1 + 1):
        for y in range(y0, y1 + 1):
            e = s.head[(x + 257 * y) & mask]
            while e >= 0:
                g = s.entry[e, 3]
                e = s.entry[e, 0]
                if s.node[STAMP, g] == query or s.node[MARK, g] != 0:
                    continue
                s.node[STAMP, g] = query
                dx, dy = s.real[g, CENTRE] - s.real[i, CENTRE], s.real[g, CENTRE + 1] - s.real[i, CENTRE + 1]
                reach = s.real[g, RADIUS] + s.real[i, RADIUS]
                if dx * dx + dy * dy < reach * reach and triangles_overlap(s.real, i, g):
                    if at + found < room:
                        out[at + found, 1] = g
                    found += 1
                    if found > limit:
                        return found
    return found


@entry
def all_overlaps(s: NetArrays, pairs: Ints, room: int) -> Any:
    """Fill the grid with the faces where they are, and count the pairs that overlap.

    The first ``room`` pairs are written to ``pairs`` (P, 2).
    """
    for i in range(len(s.head)):
        s.head[i] = -1
    found = np.int64(0)
    for f in range(s.node.shape[1]):
        new = count_hits(s, f, np.int64(NO_LIMIT), pairs, found, room)
        for k in range(found, min(found + new, room)):
            pairs[k, 0] = f
        found += new
        insert_face(s, f)
    return found
