"""Kernels of trees and what they leave: spanning trees, paths, joining edges, room for a tab."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner._kernels.compiled import entry, inner
from planner._kernels.net_arrays import (
    BLOCKED,
    CENTRE,
    CORNER,
    CREASE,
    FACES,
    HOPS,
    MARK,
    PARENT,
    PART,
    RADIUS,
    SIDE,
    SIDES,
    SIZE,
    TREE,
    Floats,
    Ints,
    NetArrays,
)
from planner._kernels.net_kernels import (
    component,
    moved_overlaps,
    swap,
    unmark,
)
from planner._kernels.overlap_kernels import (
    NO_LIMIT,
    count_hits,
)

TAB_WIDTH_MM = 2.0
"""Stretch of a free edge of the base panel that a tab takes up, play included."""

TAB_REACH_MM = 1.0
"""How far outside that stretch no other face may lie."""

Seeds = NDArray[np.uint64]


@inner
def draw(rng: Seeds, below: int) -> Any:
    """Next random number in [0, below): xorshift64* (Vigna 2016)."""
    x = rng[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    rng[0] = x
    return np.int64((x * np.uint64(2685821657736338717)) >> np.uint64(33)) % below


@entry
def grow_tree(s: NetArrays, rank: Ints, cost: Floats, tie: Ints, base: int, adding: bool) -> int:
    """Make Prim's spanning tree from ``base`` the tree: lowest rank first, then lowest key, then lowest tie.

    The key of an edge is ``cost`` of the edge, with ``adding`` plus the key of the crease that it starts
    from. Because the rank alone decides first, the tree is a minimum spanning tree for it. Returns its
    edges. The edges to choose from are few, so they are scanned and not kept in order.
    """
    node, edge = s.node, s.edge
    key = np.empty(len(edge))
    open_edges = np.empty(len(edge), np.int64)
    edge[:, TREE] = 0
    node[MARK, :] = 0
    size, count, face, reach = 0, 0, base, 0.0
    while True:
        node[MARK, face] = 1
        for k in range(3):
            e = node[SIDES + k, face]
            if e >= 0 and node[MARK, edge[e, FACES]] + node[MARK, edge[e, FACES + 1]] == 1:
                key[e] = cost[e] + reach
                open_edges[size] = e
                size += 1
        best, at = -1, 0
        while at < size:
            e = open_edges[at]
            if node[MARK, edge[e, FACES]] + node[MARK, edge[e, FACES + 1]] == 2:
                size -= 1
                open_edges[at] = open_edges[size]
                continue
            at += 1
            if best >= 0 and rank[e] > rank[best]:
                continue
            if (
                best < 0
                or rank[e] < rank[best]
                or key[e] < key[best]
                or (key[e] == key[best] and tie[e] < tie[best])
            ):
                best = e
        if best < 0:
            break
        edge[best, TREE] = 1
        count += 1
        face = edge[best, FACES + node[MARK, edge[best, FACES]]]
        reach = key[best] if adding else 0.0
    node[MARK, :] = 0
    return count


@entry
def free_edges(s: NetArrays, outline: Ints) -> int:
    """How many sides of the base panel, rows (face, slot, edge or -1) of ``outline``, are not creases."""
    count = 0
    for i in range(len(outline)):
        if outline[i, 2] < 0 or s.edge[outline[i, 2], TREE] == 0:
            count += 1
    return count


@entry
def clear_tabs(s: NetArrays, outline: Ints, least: int, blockers: Ints, room: int) -> int:
    """How many tabs find room on free sides of the base panel; stops at ``least``.

    A tab has room if no other face lies in a rectangle TAB_WIDTH_MM x TAB_REACH_MM outside the side. The
    first ``room`` faces that lie in the way are written to ``blockers[:, 1]``, their number to
    ``number[BLOCKED]``.
    """
    r = s.real
    t = len(r) - 1
    count, blocked = 0, np.int64(0)
    for i in range(len(outline)):
        f, k = outline[i, 0], outline[i, 1]
        if outline[i, 2] >= 0 and s.edge[outline[i, 2], TREE] != 0:
            continue
        n = 0 if k == 2 else k + 1
        length = r[f, SIDE + k]
        x, y = r[f, CORNER + 2 * k], r[f, CORNER + 2 * k + 1]
        ux, uy = (r[f, CORNER + 2 * n] - x) / length, (r[f, CORNER + 2 * n + 1] - y) / length
        width = min(TAB_WIDTH_MM, length)
        windows = max(1, math.ceil(length / width - 1e-9))
        for w in range(windows):
            start = 0.5 * (length - width) if windows == 1 else w * (length - width) / (windows - 1)
            hits = np.int64(0)
            for half in range(2):
                # corners (along, outwards) of a half, counter-clockwise: (0, 0) (0, 1) (1, 1), then (0, 0)
                # (1, 1) (1, 0)
                r[t, CENTRE], r[t, CENTRE + 1] = 0.0, 0.0
                for c in range(3):
                    along = start + (width if c + half >= 2 else 0.0)
                    out = TAB_REACH_MM if c > 0 and c + half < 3 else 0.0
                    px, py = x + along * ux + out * uy, y + along * uy - out * ux
                    r[t, CORNER + 2 * c], r[t, CORNER + 2 * c + 1] = px, py
                    r[t, CENTRE] += px / 3.0
                    r[t, CENTRE + 1] += py / 3.0
                diagonal = math.hypot(width, TAB_REACH_MM)
                r[t, SIDE], r[t, SIDE + 1], r[t, SIDE + 2] = TAB_REACH_MM, width, diagonal
                if half == 1:
                    r[t, SIDE], r[t, SIDE + 1], r[t, SIDE + 2] = diagonal, TAB_REACH_MM, width
                r[t, RADIUS] = diagonal
                hits += count_hits(s, t, np.int64(NO_LIMIT), blockers, blocked + hits, room)
            blocked = min(blocked + hits, np.int64(room))
            if hits == 0:
                count += 1
                if count >= least:
                    return count
    s.number[BLOCKED] = blocked
    return count


@entry
def tree_path(s: NetArrays, a: int, b: int, path: Ints) -> int:
    """Creases on the tree path between two faces, into ``path``; returns how many."""
    node = s.node
    count = 0
    while a != b:
        if node[HOPS, a] >= node[HOPS, b]:
            path[count] = node[CREASE, a]
            a = node[PARENT, a]
        else:
            path[count] = node[CREASE, b]
            b = node[PARENT, b]
        count += 1
    return count


@entry
def joining_edges(s: NetArrays, joins: Ints) -> int:
    """Edges that would join the marked component to the rest again, into ``joins``; returns how many."""
    count = 0
    for i in range(s.number[SIZE]):
        f = s.node[PART, i]
        for k in range(3):
            e = s.node[SIDES + k, f]
            if e < 0 or s.edge[e, TREE] != 0:
                continue
            if s.node[MARK, s.edge[e, FACES]] + s.node[MARK, s.edge[e, FACES + 1]] == 1:
                joins[count] = e
                count += 1
    return count


@inner
def exchange_pairs(s: NetArrays, cut: int, join: int, pairs: Ints, found: int) -> Any:
    """Replace ``cut`` by ``join`` and keep the list of overlapping pairs; returns how many there are then."""
    component(s, cut)
    kept = np.int64(0)
    for k in range(found):
        if s.node[MARK, pairs[k, 0]] == s.node[MARK, pairs[k, 1]]:
            pairs[kept, 0], pairs[kept, 1] = pairs[k, 0], pairs[k, 1]
            kept += 1
    found = kept + moved_overlaps(s, join, np.int64(NO_LIMIT), pairs, kept, len(pairs))
    unmark(s)
    swap(s, cut, join)
    return found
