"""Flat layouts in the plane: laying out a tree of faces, a hash grid, overlap of triangles, moving a part.

All kernels work on one ``NetArrays`` record. A face is a fixed triangle in a frame of its own and a pose
(cos, sin, x, y) in the plane. Cutting a crease and joining another edge moves one component rigidly. The
record has few, wide arrays because the time to compile a kernel grows with the number of arrays that it is
given.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

OVERLAP_TOLERANCE_MM = 1e-4
"""Two faces overlap if no edge line separates them to within this depth: deeper than this is an overlap."""

NO_LIMIT = 1 << 60

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

# columns of NetArrays.real: corners (x, y each) in the face's frame and in the plane, side lengths, pose,
# centroid, radius of the circle about the centroid, side of a grid cell (the same in every row)
LOCAL, CORNER, SIDE, POSE, CENTRE, RADIUS, CELL, REALS = 0, 6, 12, 15, 19, 21, 22, 23

# rows of NetArrays.node: interior edge on each side (-1: boundary), the rooted tree (depth in folds, hops in
# creases), 1 for the marked component, number of the last query, grid entries (first, used), the two
# components of a cut and the edges through which their faces were reached
SIDES, PARENT, SLOT, CREASE, DEPTH, HOPS, ORDER, MARK, STAMP, FIRST, USED, PART, VIA, NODES = (
    0, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15, 17,
)  # fmt: skip

# columns of NetArrays.edge: faces, their slots, flat, flat and never cut, in the tree, in the blooming tree,
# on the outline of the base panel
FACES, SLOTS, FLAT, FROZEN, TREE, BLOOMING, OUTLINE, EDGES = 0, 2, 4, 5, 6, 7, 8, 9

# entries of NetArrays.number: base face, last query, size of the marked component, faces tested while moving
BASE, QUERY, SIZE, TESTED, NUMBERS = 0, 1, 2, 3, 4


# kernels called from Python, and kernels called from kernels only: wrappers that nobody uses cost time to
# compile
entry = njit(cache=True, error_model="numpy", no_cfunc_wrapper=True)
inner = njit(cache=True, error_model="numpy", no_cfunc_wrapper=True, no_cpython_wrapper=True)


class NetArrays(NamedTuple):
    """Dual graph, tree, flat layout and hash grid as plain arrays (F faces, M interior edges)."""

    real: Floats  # (F + 1, REALS); the last row is for a triangle that is being tested
    node: Ints  # (NODES, F)
    edge: Ints  # (M, EDGES)
    turn: Floats  # (M, 2) rotation from the frame of face 0 to that of face 1 when laid flat
    head: Ints  # (buckets,) first grid entry
    entry: Ints  # (E, 4) next, previous, bucket, face
    number: Ints  # (NUMBERS,)


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
def _cells(r: Floats, i: int) -> Any:
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
    x0, x1, y0, y1 = _cells(s.real, face)
    mask = len(s.head) - 1
    at = s.node[FIRST, face]
    for x in range(x0, x1 + 1):
        for y in range(y0, y1 + 1):
            bucket = ((x * 73856093) ^ (y * 19349663)) & mask
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
    x0, x1, y0, y1 = _cells(s.real, i)
    mask = len(s.head) - 1
    found = 0
    for x in range(x0, x1 + 1):
        for y in range(y0, y1 + 1):
            e = s.head[((x * 73856093) ^ (y * 19349663)) & mask]
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
def root_tree(s: NetArrays, base: int) -> int:
    """Parent, slot, crease, depth and order of every face; returns how many were reached.

    A result other than F means that the tree does not span the faces or has a cycle.
    """
    node, edge = s.node, s.edge
    count = node.shape[1]
    for f in range(count):
        node[HOPS, f] = -1
    s.number[BASE] = base
    node[ORDER, 0] = base
    node[PARENT, base], node[SLOT, base], node[CREASE, base], node[DEPTH, base], node[HOPS, base] = (
        -1,
        -1,
        -1,
        0,
        0,
    )
    reached, at = 1, 0
    while at < reached:
        f = node[ORDER, at]
        at += 1
        for k in range(3):
            e = node[SIDES + k, f]
            if e < 0 or edge[e, TREE] == 0 or e == node[CREASE, f]:
                continue
            i = 1 if edge[e, FACES] == f else 0
            g = edge[e, FACES + i]
            if node[HOPS, g] >= 0:
                return -1
            node[PARENT, g], node[SLOT, g], node[CREASE, g] = f, edge[e, SLOTS + i], e
            node[HOPS, g] = node[HOPS, f] + 1
            node[DEPTH, g] = node[DEPTH, f] + 1 - edge[e, FLAT]
            node[ORDER, reached] = g
            reached += 1
    return reached


@inner
def set_pose(s: NetArrays, face: int, c: float, d: float, x: float, y: float) -> None:
    """Put a face at pose (c, d, x, y), c + id of length one."""
    r = s.real
    r[face, POSE], r[face, POSE + 1], r[face, POSE + 2], r[face, POSE + 3] = c, d, x, y
    sx, sy = 0.0, 0.0
    for k in range(0, 6, 2):
        u, v = r[face, LOCAL + k], r[face, LOCAL + k + 1]
        px, py = c * u - d * v + x, d * u + c * v + y
        r[face, CORNER + k], r[face, CORNER + k + 1] = px, py
        sx += px
        sy += py
    r[face, CENTRE], r[face, CENTRE + 1] = sx / 3.0, sy / 3.0


@inner
def joined_pose(s: NetArrays, e: int, child: int) -> Any:
    """Pose (c, d, x, y) of ``child`` laid flat against the face on the other side of edge ``e``."""
    r = s.real
    i = 0 if s.edge[e, FACES] == child else 1
    other = s.edge[e, FACES + 1 - i]
    u, v = s.turn[e, 0], (s.turn[e, 1] if i == 1 else -s.turn[e, 1])
    c = r[other, POSE] * u - r[other, POSE + 1] * v
    d = r[other, POSE] * v + r[other, POSE + 1] * u
    size = math.sqrt(c * c + d * d)
    c, d = c / size, d / size
    k = 2 * s.edge[e, SLOTS + i]
    n = 2 * s.edge[e, SLOTS + 1 - i] + 2
    n = 0 if n == 6 else n
    p, q = r[child, LOCAL + k], r[child, LOCAL + k + 1]
    return c, d, r[other, CORNER + n] - c * p + d * q, r[other, CORNER + n + 1] - d * p - c * q


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


@entry
def lay_flat(s: NetArrays) -> None:
    """Lay out the rooted tree, base face in its own frame. The grid is not touched."""
    set_pose(s, s.number[BASE], 1.0, 0.0, 0.0, 0.0)
    for i in range(1, s.node.shape[1]):
        f = s.node[ORDER, i]
        c, d, x, y = joined_pose(s, s.node[CREASE, f], f)
        set_pose(s, f, c, d, x, y)


@entry
def component(s: NetArrays, cut: int) -> int:
    """Mark the smaller side of the tree without crease ``cut``: returns its size, members in ``node[PART]``.

    Both sides are walked in turn, so the cost is twice the size of the smaller side.
    """
    node, edge = s.node, s.edge
    for i in range(2):
        node[PART + i, 0] = edge[cut, FACES + i]
        node[VIA + i, 0] = cut
    end0, end1, at0, at1, side = 1, 1, 0, 0, 0
    while (at0 < end0) if side == 0 else (at1 < end1):
        at = at0 if side == 0 else at1
        end = end0 if side == 0 else end1
        f, via = node[PART + side, at], node[VIA + side, at]
        for k in range(3):
            e = node[SIDES + k, f]
            if e >= 0 and e != via and edge[e, TREE] != 0:
                node[PART + side, end] = edge[e, FACES + 1] if edge[e, FACES] == f else edge[e, FACES]
                node[VIA + side, end] = e
                end += 1
        if side == 0:
            at0, end0, side = at + 1, end, 1
        else:
            at1, end1, side = at + 1, end, 0
    size = end0 if side == 0 else end1
    for i in range(size):
        node[PART, i] = node[PART + side, i]
        node[MARK, node[PART, i]] = 1
    s.number[SIZE] = size
    return size


@entry
def unmark(s: NetArrays) -> None:
    """Forget the marked component."""
    for i in range(s.number[SIZE]):
        s.node[MARK, s.node[PART, i]] = 0
    s.number[SIZE] = 0


@inner
def motion(s: NetArrays, join: int) -> Any:
    """Rigid motion (c, d, x, y) of the marked component that lays it against the rest along edge ``join``."""
    a = s.edge[join, FACES]
    if s.node[MARK, a] == 0:
        a = s.edge[join, FACES + 1]
    c, d, x, y = joined_pose(s, join, a)
    u, v, p, q = s.real[a, POSE], s.real[a, POSE + 1], s.real[a, POSE + 2], s.real[a, POSE + 3]
    mc, md = c * u + d * v, d * u - c * v
    return mc, md, x - mc * p + md * q, y - md * p - mc * q


@inner
def moved_overlaps(s: NetArrays, join: int, limit: int, out: Ints, at: int, room: int) -> Any:
    """Overlapping pairs between the marked component, joined at ``join``, and the rest, up to ``limit``.

    One more than ``limit`` stands for any number beyond it.
    The pairs are written to ``out[at:room]``. The faces that were tested are added to ``number[TESTED]``.
    """
    c, d, x, y = motion(s, join)
    r = s.real
    t = len(r) - 1
    found = np.int64(0)
    for i in range(s.number[SIZE]):
        f = s.node[PART, i]
        for k in range(0, 6, 2):
            u, v = r[f, CORNER + k], r[f, CORNER + k + 1]
            r[t, CORNER + k], r[t, CORNER + k + 1] = c * u - d * v + x, d * u + c * v + y
        for k in range(3):
            r[t, SIDE + k] = r[f, SIDE + k]
        u, v = r[f, CENTRE], r[f, CENTRE + 1]
        r[t, CENTRE], r[t, CENTRE + 1] = c * u - d * v + x, d * u + c * v + y
        r[t, RADIUS] = r[f, RADIUS]
        new = count_hits(s, t, limit - found, out, at + found, room)
        for k in range(at + found, min(at + found + new, room)):
            out[k, 0] = f
        found += new
        s.number[TESTED] += 1
        if found > limit:
            break
    return found


@entry
def swap(s: NetArrays, cut: int, join: int) -> None:
    """Replace crease ``cut`` by ``join`` without asking what it hits, and root the tree again."""
    component(s, cut)
    mc, md, mx, my = motion(s, join)
    for i in range(s.number[SIZE]):
        f = s.node[PART, i]
        remove_face(s, f)
        c, d, x, y = s.real[f, POSE], s.real[f, POSE + 1], s.real[f, POSE + 2], s.real[f, POSE + 3]
        u, v = mc * c - md * d, md * c + mc * d
        size = math.sqrt(u * u + v * v)
        set_pose(s, f, u / size, v / size, mc * x - md * y + mx, md * x + mc * y + my)
        insert_face(s, f)
    unmark(s)
    s.edge[cut, TREE], s.edge[join, TREE] = 0, 1
    root_tree(s, s.number[BASE])


@entry
def swap_is_free(s: NetArrays, cut: int, join: int) -> int:
    """1 if the part that ``cut`` frees would overlap nothing when joined at ``join``, 0 if it would.

    -1 if ``join`` does not connect the two components.
    """
    component(s, cut)
    free = -1
    if s.node[MARK, s.edge[join, FACES]] != s.node[MARK, s.edge[join, FACES + 1]]:
        free = 1 if moved_overlaps(s, join, np.int64(0), s.entry, np.int64(0), np.int64(0)) == 0 else 0
    unmark(s)
    return free


@entry
def place_back(s: NetArrays, members: Ints, poses: Floats) -> None:
    """Put faces back to earlier poses (exact undo) and root the tree again."""
    for i in range(len(members)):
        f = members[i]
        remove_face(s, f)
        set_pose(s, f, poses[i, 0], poses[i, 1], poses[i, 2], poses[i, 3])
        insert_face(s, f)
    root_tree(s, s.number[BASE])
