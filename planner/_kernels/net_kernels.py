"""Flat layouts in the plane: laying out a tree of faces, and moving a part of it.

Cutting a crease and joining another edge moves one component of the tree rigidly.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.net_arrays import (
    BASE,
    CENTRE,
    CORNER,
    CREASE,
    DEPTH,
    FACES,
    FLAT,
    HOPS,
    LOCAL,
    MARK,
    ORDER,
    PARENT,
    PART,
    POSE,
    RADIUS,
    SIDE,
    SIDES,
    SIZE,
    SLOT,
    SLOTS,
    TESTED,
    TREE,
    VIA,
    Floats,
    Ints,
    NetArrays,
)
from planner._kernels.overlap_kernels import (
    count_hits,
    insert_face,
    remove_face,
)


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
def motion(s: NetArrays, join: int, child: int) -> Any:
    """Rigid motion (c, d, x, y) that lays face ``child`` against the other face of edge ``join``."""
    c, d, x, y = joined_pose(s, join, child)
    u, v, p, q = (
        s.real[child, POSE],
        s.real[child, POSE + 1],
        s.real[child, POSE + 2],
        s.real[child, POSE + 3],
    )
    mc, md = c * u + d * v, d * u - c * v
    return mc, md, x - mc * p + md * q, y - md * p - mc * q


@inner
def marked_face(s: NetArrays, join: int) -> Any:
    """The face of edge ``join`` that is in the marked component."""
    return s.edge[join, FACES] if s.node[MARK, s.edge[join, FACES]] != 0 else s.edge[join, FACES + 1]


@inner
def stride(count: int) -> Any:
    """A step near the golden section of ``count`` that visits all of that many places, round and round."""
    step = np.int64(count * 0.6180339887) | 1
    while True:
        a, b = np.int64(count), step
        while b != 0:
            a, b = b, a % b
        if a == 1:
            return step
        step += 2


@inner
def moved_overlaps(s: NetArrays, join: int, limit: int, out: Ints, at: int, room: int) -> Any:
    """Overlapping pairs between the marked component, joined at ``join``, and the rest, up to ``limit``.

    One more than ``limit`` stands for any number beyond it. Faces are taken from all over the component in turn, since
    those that overlap lie together: so too many are soon found.
    The pairs are written to ``out[at:room]``. The faces that were tested are added to ``number[TESTED]``.
    """
    c, d, x, y = motion(s, join, marked_face(s, join))
    r = s.real
    t = len(r) - 1
    found = np.int64(0)
    size = s.number[SIZE]
    step, place = stride(size), np.int64(0)
    for _ in range(size):
        f = s.node[PART, place]
        place += step
        if place >= size:
            place -= size
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


@inner
def move_part(s: NetArrays, join: int) -> None:
    """Lay the marked component against the other face of edge ``join``."""
    mc, md, mx, my = motion(s, join, marked_face(s, join))
    for i in range(s.number[SIZE]):
        f = s.node[PART, i]
        remove_face(s, f)
        c, d, x, y = s.real[f, POSE], s.real[f, POSE + 1], s.real[f, POSE + 2], s.real[f, POSE + 3]
        u, v = mc * c - md * d, md * c + mc * d
        size = math.sqrt(u * u + v * v)
        set_pose(s, f, u / size, v / size, mc * x - md * y + mx, md * x + mc * y + my)
        insert_face(s, f)


@entry
def swap(s: NetArrays, cut: int, join: int) -> None:
    """Replace crease ``cut`` by ``join`` without asking what it hits, and root the tree again."""
    component(s, cut)
    move_part(s, join)
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
