"""Search kernels: spanning trees, room for a tab, tabu search for a tree without overlaps."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner._kernels.compiled import entry, inner
from planner._kernels.net_arrays import (
    BLOCKED,
    BLOOMING,
    CENTRE,
    CORNER,
    CREASE,
    FACES,
    FROZEN,
    HOPS,
    MARK,
    ORDER,
    OUTLINE,
    PARENT,
    PART,
    RADIUS,
    SIDE,
    SIDES,
    SIZE,
    TESTED,
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

EDIT_COST = 0.3
"""What an edit weighs against an overlap in the tabu search."""

CHOICES = 8
"""Creases tried per target, and edges tried per crease."""

HEAVY, HEAVY_CHOICES = 256, 3
"""Edges tried per crease where more faces than this hang on it."""

WORST, SLACK = 1.0, 0.5
"""Cost that an exchange in the tabu search may have, and by how much more after each round without success."""

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


@inner
def _choose(s: NetArrays, edges: Ints, count: int, rng: Seeds) -> int:
    """Drop the frozen edges, then bring up to CHOICES random ones to the front; returns how many those are."""
    kept = 0
    for i in range(count):
        if s.edge[edges[i], FROZEN] == 0:
            edges[kept] = edges[i]
            kept += 1
    few = min(kept, CHOICES)
    for i in range(few):
        j = i + draw(rng, kept - i)
        edges[i], edges[j] = edges[j], edges[i]
    return few


@inner
def _choose_light(s: NetArrays, edges: Ints, count: int, rng: Seeds, size: Ints) -> int:
    """As ``_choose``, but each is the lighter of two, and light ones come first.

    What hangs on a light crease is soon tested, and what that finds ends the tests of heavy ones early.
    """
    kept = 0
    for i in range(count):
        if s.edge[edges[i], FROZEN] == 0:
            edges[kept] = edges[i]
            kept += 1
    few = min(kept, CHOICES)
    for i in range(few):
        j, k = i + draw(rng, kept - i), i + draw(rng, kept - i)
        j = k if size[edges[k]] < size[edges[j]] else j
        e = edges[j]
        edges[j] = edges[i]
        j = i
        while j > 0 and size[edges[j - 1]] > size[e]:
            edges[j] = edges[j - 1]
            j -= 1
        edges[j] = e
    return few


@inner
def part_sizes(s: NetArrays, sub: Ints, size: Ints) -> None:
    """Faces in the smaller part without each crease, into ``size`` (M,); ``sub`` (F,) is scratch."""
    node = s.node
    n = node.shape[1]
    sub[:] = 1
    for i in range(n - 1, 0, -1):
        f = node[ORDER, i]
        sub[node[PARENT, f]] += sub[f]
        size[node[CREASE, f]] = min(sub[f], n - sub[f])


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


@entry
def search(s: NetArrays, outline: Ints, pairs: Ints, found: int, rng: Seeds, stall: int, work: int) -> int:
    """Tabu search by path-targeted exchanges until no pair overlaps and the base panel has a free side.

    ``pairs`` holds the ``found`` overlapping pairs of the layout. Ends when ``stall`` rounds have not brought
    fewer overlaps than ever, or ``number[TESTED]`` is beyond ``work``. Returns the pairs that are left, plus one if the
    base panel has no free side.
    """
    edge = s.edge
    tabu = np.zeros(len(edge), np.int64)
    path = np.empty(len(edge) + 1, np.int64)
    joins = np.empty(len(edge) + 1, np.int64)
    sub = np.empty(s.node.shape[1], np.int64)
    size = np.zeros(len(edge), np.int64)
    part_sizes(s, sub, size)
    free = free_edges(s, outline)
    now, fewest, last = 0, found + 1, 0
    while (found > 0 or free == 0) and now - last < stall and s.number[TESTED] <= work:
        now += 1
        if found == 0 or (free == 0 and draw(rng, 4) == 0):
            count = len(outline)
            for i in range(count):
                path[i] = outline[i, 2]
        else:
            pick = draw(rng, found)
            count = tree_path(s, pairs[pick, 0], pairs[pick, 1], path)
        count = _choose_light(s, path, count, rng, size)
        best, best_cut, best_join = WORST + SLACK * (now - last), np.int64(-1), np.int64(-1)
        for i in range(count):
            cut = path[i]
            if tabu[cut] > now:
                continue
            component(s, cut)
            old = 0
            for k in range(found):
                old += 1 if s.node[MARK, pairs[k, 0]] != s.node[MARK, pairs[k, 1]] else 0
            few = _choose(s, joins, joining_edges(s, joins), rng)
            if size[cut] > HEAVY:
                few = min(few, HEAVY_CHOICES)
            for k in range(few):
                join = joins[k]
                cost = EDIT_COST * (edge[cut, BLOOMING] - edge[join, BLOOMING]) - old
                if free + edge[cut, OUTLINE] - edge[join, OUTLINE] == 0:
                    cost += 2.0
                if tabu[join] > now or cost >= best:
                    continue
                limit = math.floor(min(best - cost, 1e9))
                hits = moved_overlaps(s, join, limit, s.entry, np.int64(0), np.int64(0))
                if hits + cost < best and found - old + hits <= len(pairs):
                    best, best_cut, best_join = hits + cost, cut, join
            unmark(s)
        if best_cut < 0:
            continue
        found = exchange_pairs(s, best_cut, best_join, pairs, found)
        part_sizes(s, sub, size)
        free = free_edges(s, outline)
        if found < fewest:
            fewest, last = found, now
        tabu[best_cut] = now + 4 + draw(rng, 10)
        tabu[best_join] = now + 4 + draw(rng, 10)
    return found + (1 if free == 0 else 0)
