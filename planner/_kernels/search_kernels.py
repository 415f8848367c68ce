"""Tabu search for a tree without overlaps.

The search keeps what it asks often up to date instead of counting it afresh: the faces below every crease and the
overlapping pairs whose tree path holds it. An exchange changes both along two paths only.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.nb_kernels import Seeds, draw, free_edges, joining_edges
from planner._kernels.net_arrays import (
    BASE,
    BLOOMING,
    CREASE,
    FACES,
    FROZEN,
    MARK,
    ORDER,
    OUTLINE,
    PARENT,
    PART,
    SIDES,
    SIZE,
    SLOT,
    SLOTS,
    TESTED,
    TREE,
    VIA,
    Ints,
    NetArrays,
)
from planner._kernels.net_kernels import move_part, moved_overlaps, root_tree, unmark
from planner._kernels.overlap_kernels import NO_LIMIT

EDIT_COST = 0.3
"""What an edit weighs against an overlap in the tabu search."""

CHOICES = 8
"""Creases tried per target, and edges tried per crease."""

HEAVY, HEAVY_CHOICES = 256, 3
"""Edges tried per crease where more faces than this hang on it."""

WORST, SLACK = 1.0, 0.5
"""Cost that an exchange in the tabu search may have, and by how much more after each round without success."""


@inner
def _below(s: NetArrays, crease: int) -> Any:
    """The face that hangs on ``crease``."""
    f = s.edge[crease, FACES]
    return f if s.node[CREASE, f] == crease else s.edge[crease, FACES + 1]


@inner
def _part_size(s: NetArrays, below: Ints, crease: int) -> Any:
    """Faces in the smaller part without ``crease``; ``below`` (F,) has the faces of every subtree."""
    size = below[_below(s, crease)]
    return min(size, s.node.shape[1] - size)


@inner
def _path(s: NetArrays, below: Ints, a: int, b: int, path: Ints) -> int:
    """Creases on the tree path between two faces, into ``path``; returns how many.

    A face has more faces below it than any below it has, so of two different faces the one with fewer is not
    above the other.
    """
    node = s.node
    count = 0
    while a != b:
        if below[a] <= below[b]:
            path[count] = node[CREASE, a]
            a = node[PARENT, a]
        else:
            path[count] = node[CREASE, b]
            b = node[PARENT, b]
        count += 1
    return count


@inner
def _count_path(s: NetArrays, below: Ints, through: Ints, pair: Ints, by: int) -> None:
    """Add ``by`` to ``through`` of all creases on the tree path of a pair of faces."""
    node = s.node
    a, b = pair[0], pair[1]
    while a != b:
        if below[a] <= below[b]:
            through[node[CREASE, a]] += by
            a = node[PARENT, a]
        else:
            through[node[CREASE, b]] += by
            b = node[PARENT, b]


@inner
def _mark_small_part(s: NetArrays, below: Ints, cut: int) -> None:
    """As ``component``, but walks the smaller part only."""
    node, edge = s.node, s.edge
    f = _below(s, cut)
    if 2 * below[f] > node.shape[1]:
        f = node[PARENT, f]
    node[PART, 0], node[VIA, 0], node[MARK, f] = f, cut, 1
    end, at = 1, 0
    while at < end:
        f, via = node[PART, at], node[VIA, at]
        at += 1
        for k in range(3):
            e = node[SIDES + k, f]
            if e >= 0 and e != via and edge[e, TREE] != 0:
                g = edge[e, FACES + 1] if edge[e, FACES] == f else edge[e, FACES]
                node[PART, end], node[VIA, end], node[MARK, g] = g, e, 1
                end += 1
    s.number[SIZE] = end


@inner
def _hang_on(s: NetArrays, below: Ints, cut: int, join: int) -> None:
    """Replace ``cut`` by ``join`` in the rooted tree: parents, creases, slots and ``below``.

    Hops, depths and order are left as they were. The faces on the way from ``join`` to ``cut`` turn over.
    """
    node, edge = s.node, s.edge
    top = _below(s, cut)
    count = below[top]
    f = node[PARENT, top]
    while f >= 0:
        below[f] -= count
        f = node[PARENT, f]
    f = edge[join, FACES]
    while f != top and f >= 0:
        f = node[PARENT, f]
    i = 0 if f == top else 1
    f, other = edge[join, FACES + i], edge[join, FACES + 1 - i]
    parent, crease, slot, lower = other, join, edge[join, SLOTS + i], 0
    while True:
        next_face, next_crease, size = node[PARENT, f], node[CREASE, f], below[f]
        node[PARENT, f], node[CREASE, f], node[SLOT, f] = parent, crease, slot
        below[f] = count - lower
        if f == top:
            break
        parent, crease, lower = f, next_crease, size
        f = next_face
        slot = edge[crease, SLOTS] if edge[crease, FACES] == f else edge[crease, SLOTS + 1]
    f = other
    while f >= 0:
        below[f] += count
        f = node[PARENT, f]
    edge[cut, TREE], edge[join, TREE] = 0, 1


@inner
def _exchange(s: NetArrays, below: Ints, through: Ints, cut: int, join: int, pairs: Ints, found: int) -> Any:
    """Replace ``cut`` by ``join``, keep all lists; returns how many pairs overlap then."""
    _mark_small_part(s, below, cut)
    kept = np.int64(0)
    for k in range(found):
        if s.node[MARK, pairs[k, 0]] == s.node[MARK, pairs[k, 1]]:
            pairs[kept, 0], pairs[kept, 1] = pairs[k, 0], pairs[k, 1]
            kept += 1
        else:
            _count_path(s, below, through, pairs[k], -1)
    found = kept + moved_overlaps(s, join, np.int64(NO_LIMIT), pairs, kept, len(pairs))
    move_part(s, join)
    unmark(s)
    _hang_on(s, below, cut, join)
    for k in range(kept, found):
        _count_path(s, below, through, pairs[k], 1)
    return found


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
def _choose_cuts(
    s: NetArrays, path: Ints, count: int, rng: Seeds, below: Ints, through: Ints, tabu: Ints, now: int
) -> int:
    """As ``_choose`` for creases that are not taboo, each the better of two, and the best come first.

    Better is the one with more overlapping pairs on its paths for each face that hangs on it: it can remove
    more, and is sooner tested. What it removes ends the tests of others early.
    """
    kept = 0
    for i in range(count):
        if s.edge[path[i], FROZEN] == 0 and tabu[path[i]] <= now:
            path[kept] = path[i]
            kept += 1
    few = min(kept, CHOICES)
    for i in range(few):
        j, k = i + draw(rng, kept - i), i + draw(rng, kept - i)
        one, two = _part_size(s, below, path[j]), _part_size(s, below, path[k])
        if through[path[k]] * one > through[path[j]] * two:
            j, one = k, two
        e = path[j]
        path[j] = path[i]
        j = i
        while j > 0 and through[path[j - 1]] * one < through[e] * _part_size(s, below, path[j - 1]):
            path[j] = path[j - 1]
            j -= 1
        path[j] = e
    return few


@entry
def search(s: NetArrays, outline: Ints, pairs: Ints, found: int, rng: Seeds, stall: int, work: int) -> int:
    """Tabu search by path-targeted exchanges until no pair overlaps and the base panel has a free side.

    ``pairs`` holds the ``found`` overlapping pairs of the layout. Ends when ``stall`` rounds have not brought
    fewer overlaps than ever, or ``number[TESTED]`` is beyond ``work``. Returns the pairs that are left, plus one if the
    base panel has no free side.
    """
    node, edge = s.node, s.edge
    tabu = np.zeros(len(edge), np.int64)
    path = np.empty(len(edge) + 1, np.int64)
    joins = np.empty(len(edge) + 1, np.int64)
    below = np.ones(node.shape[1], np.int64)
    for i in range(node.shape[1] - 1, 0, -1):
        below[node[PARENT, node[ORDER, i]]] += below[node[ORDER, i]]
    through = np.zeros(len(edge), np.int64)
    for k in range(found):
        _count_path(s, below, through, pairs[k], 1)
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
            count = _path(s, below, pairs[pick, 0], pairs[pick, 1], path)
        count = _choose_cuts(s, path, count, rng, below, through, tabu, now)
        best, best_cut, best_join = WORST + SLACK * (now - last), np.int64(-1), np.int64(-1)
        for i in range(count):
            cut = path[i]
            old = through[cut]
            if EDIT_COST * (edge[cut, BLOOMING] - 1) - old >= best:
                continue
            _mark_small_part(s, below, cut)
            few = _choose(s, joins, joining_edges(s, joins), rng)
            if s.number[SIZE] > HEAVY:
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
        free += edge[best_cut, OUTLINE] - edge[best_join, OUTLINE]
        found = _exchange(s, below, through, best_cut, best_join, pairs, found)
        if found < fewest:
            fewest, last = found, now
        tabu[best_cut] = now + 4 + draw(rng, 10)
        tabu[best_join] = now + 4 + draw(rng, 10)
    root_tree(s, s.number[BASE])
    return found + (1 if free == 0 else 0)
