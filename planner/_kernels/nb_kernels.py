"""Search kernels: blooming trees, room for a tab, tabu search for an overlap-free tree, restoring of edges."""

from __future__ import annotations

import math
import numpy as np
from numba import njit
from numpy.typing import NDArray

from planner._kernels.net_kernels import (
    BASE,
    BLOOMING,
    CENTRE,
    CORNER,
    CREASE,
    FACES,
    FROZEN,
    HOPS,
    MARK,
    NO_LIMIT,
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
    component,
    count_hits,
    moved_overlaps,
    swap,
    swap_is_free,
    unmark,
)

TAB_WIDTH_MM = 2.0
"""Stretch of a free edge of the base panel that a tab takes up, play included."""

TAB_REACH_MM = 1.0
"""How far outside that stretch no other face may lie."""

EDIT_COST = 0.3
"""What an edit weighs against an overlap in the tabu search."""

CHOICES = 8
"""Creases tried per target, and edges tried per crease."""

Seeds = NDArray[np.uint64]


@njit(cache=True, error_model="numpy")
def draw(rng: Seeds, below: int) -> int:
    """Next random number in [0, below): xorshift64* (Vigna 2016)."""
    x = rng[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    rng[0] = x
    return np.int64((x * np.uint64(2685821657736338717)) >> np.uint64(33)) % below


@njit(cache=True, error_model="numpy")
def _before(rank: Ints, key: Floats, tie: Ints, a: int, b: int) -> bool:
    """True if edge a comes before edge b: by rank, then key, then tie number."""
    if rank[a] != rank[b]:
        return rank[a] < rank[b]
    if key[a] != key[b]:
        return key[a] < key[b]
    return tie[a] < tie[b]


@njit(cache=True, error_model="numpy")
def grow_tree(s: NetArrays, rank: Ints, cost: Floats, tie: Ints, base: int, adding: bool) -> int:
    """Make Prim's spanning tree from ``base`` the tree: lowest rank first, then lowest key, then lowest tie.

    The key of an edge is ``cost`` of the edge, with ``adding`` plus the key of the crease that it starts from.
    Because the rank alone decides first, the tree is a minimum spanning tree for it. Returns its edges.
    """
    edge = s.edge
    faces, edges = s.node.shape[1], len(edge)
    reached = np.zeros(faces, np.int64)
    key = np.zeros(edges)
    heap = np.empty(3 * faces + 1, np.int64)
    for e in range(edges):
        edge[e, TREE] = 0
    size, count, face, reach = 0, 0, base, 0.0
    while True:
        reached[face] = 1
        for k in range(3):
            e = s.node[SIDES + k, face]
            if e < 0 or reached[edge[e, FACES]] + reached[edge[e, FACES + 1]] == 2:
                continue
            key[e] = cost[e] + reach
            at = size
            size += 1
            while at > 0 and _before(rank, key, tie, e, heap[(at - 1) // 2]):
                heap[at] = heap[(at - 1) // 2]
                at = (at - 1) // 2
            heap[at] = e
        found = -1
        while size > 0 and found < 0:
            top = heap[0]
            size -= 1
            last = heap[size]
            at = 0
            while 2 * at + 1 < size:
                down = 2 * at + 1
                if down + 1 < size and _before(rank, key, tie, heap[down + 1], heap[down]):
                    down += 1
                if not _before(rank, key, tie, heap[down], last):
                    break
                heap[at] = heap[down]
                at = down
            heap[at] = last
            if reached[edge[top, FACES]] + reached[edge[top, FACES + 1]] < 2:
                found = top
        if found < 0:
            return count
        edge[found, TREE] = 1
        count += 1
        face = edge[found, FACES + 1] if reached[edge[found, FACES]] == 1 else edge[found, FACES]
        reach = key[found] if adding else 0.0


@njit(cache=True, error_model="numpy")
def free_edges(s: NetArrays, outline: Ints) -> int:
    """How many sides of the base panel, rows (face, slot, edge or -1) of ``outline``, are not creases."""
    count = 0
    for i in range(len(outline)):
        if outline[i, 2] < 0 or s.edge[outline[i, 2], TREE] == 0:
            count += 1
    return count


@njit(cache=True, error_model="numpy")
def clear_tabs(s: NetArrays, outline: Ints, least: int, blockers: Ints, room: int) -> int:
    """How many tabs find room on free sides of the base panel; stops at ``least``.

    A tab has room if no other face lies in a rectangle TAB_WIDTH_MM x TAB_REACH_MM outside the side. The first
    ``room`` faces that lie in the way are written to ``blockers[:, 1]``, their number to ``number[TESTED]``.
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
                # corners (along, outwards) of a half, counter-clockwise: (0, 0) (0, 1) (1, 1), then (0, 0) (1, 1) (1, 0)
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
            blocked = min(blocked + hits, room)
            if hits == 0:
                count += 1
                if count >= least:
                    return count
    s.number[TESTED] = blocked
    return count


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
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


@njit(cache=True, error_model="numpy")
def joining_edges(s: NetArrays, joins: Ints) -> int:
    """Edges that would join the marked component to the rest again, into ``joins``; returns how many."""
    count = 0
    for i in range(s.number[SIZE]):
        f = s.node[PART, i]
        for k in range(3):
            e = s.node[SIDES + k, f]
            if e >= 0 and s.edge[e, TREE] == 0:
                if s.node[MARK, s.edge[e, FACES]] + s.node[MARK, s.edge[e, FACES + 1]] == 1:
                    joins[count] = e
                    count += 1
    return count


@njit(cache=True, error_model="numpy")
def search(s: NetArrays, outline: Ints, pairs: Ints, found: int, rng: Seeds, rounds: int, work: int) -> int:
    """Tabu search by path-targeted exchanges until no pair overlaps and the base panel has a free side.

    ``pairs`` holds the ``found`` overlapping pairs of the layout. Ends after ``rounds`` or when ``work`` faces have
    been tested. Returns the pairs that are left, plus one if the base panel has no free side.
    """
    edge = s.edge
    tabu = np.zeros(len(edge), np.int64)
    path = np.empty(len(edge) + 1, np.int64)
    joins = np.empty(len(edge) + 1, np.int64)
    s.number[TESTED] = 0
    free = free_edges(s, outline)
    for now in range(1, rounds + 1):
        if (found == 0 and free > 0) or s.number[TESTED] > work:
            break
        if found == 0 or (free == 0 and draw(rng, 4) == 0):
            count = len(outline)
            for i in range(count):
                path[i] = outline[i, 2]
        else:
            pick = draw(rng, found)
            count = tree_path(s, pairs[pick, 0], pairs[pick, 1], path)
        count = _choose(s, path, count, rng)
        best, best_cut, best_join = 1e18, np.int64(-1), np.int64(-1)
        for i in range(count):
            cut = path[i]
            if tabu[cut] > now:
                continue
            component(s, cut)
            old = 0
            for k in range(found):
                old += 1 if s.node[MARK, pairs[k, 0]] != s.node[MARK, pairs[k, 1]] else 0
            few = _choose(s, joins, joining_edges(s, joins), rng)
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
        component(s, best_cut)
        kept = np.int64(0)
        for k in range(found):
            if s.node[MARK, pairs[k, 0]] == s.node[MARK, pairs[k, 1]]:
                pairs[kept, 0], pairs[kept, 1] = pairs[k, 0], pairs[k, 1]
                kept += 1
        found = kept + moved_overlaps(s, best_join, np.int64(NO_LIMIT), pairs, kept, len(pairs))
        unmark(s)
        swap(s, best_cut, best_join)
        free = free_edges(s, outline)
        tabu[best_cut] = now + 4 + draw(rng, 10)
        tabu[best_join] = now + 4 + draw(rng, 10)
    return found + (1 if free == 0 else 0)


@njit(cache=True, error_model="numpy")
def hold_is_kept(s: NetArrays, outline: Ints, cut: int, join: int) -> bool:
    """False if replacing ``cut`` by ``join`` would take the last free side of the base panel."""
    if s.edge[join, OUTLINE] == 0 or s.edge[cut, OUTLINE] != 0:
        return True
    return free_edges(s, outline) > 1


@njit(cache=True, error_model="numpy")
def restore(s: NetArrays, outline: Ints, clear: bool) -> int:
    """Bring blooming creases back, each for one that is not blooming, while nothing overlaps.

    The base panel keeps a free side, and with ``clear`` room for a tab. Returns the edits that are left.
    """
    path = np.empty(len(s.edge) + 1, np.int64)
    edits = 0
    again = True
    while again:
        again, edits = False, 0
        for join in range(len(s.edge)):
            if s.edge[join, BLOOMING] == 0 or s.edge[join, TREE] != 0:
                continue
            edits += 1
            count = tree_path(s, s.edge[join, FACES], s.edge[join, FACES + 1], path)
            for i in range(count):
                cut = path[i]
                if s.edge[cut, BLOOMING] != 0 or s.edge[cut, FROZEN] != 0:
                    continue
                if not hold_is_kept(s, outline, cut, join) or swap_is_free(s, cut, join) != 1:
                    continue
                swap(s, cut, join)
                if clear and clear_tabs(s, outline, np.int64(1), s.entry, np.int64(0)) == 0:
                    swap(s, join, cut)
                    continue
                again = True
                edits -= 1
                break
    return edits


@njit(cache=True, error_model="numpy")
def make_room(s: NetArrays, outline: Ints, rng: Seeds, tries: int) -> bool:
    """Look for one exchange of an overlap-free layout that gives a tab room; True if there is room then."""
    blockers = np.zeros((16, 2), np.int64)
    path = np.empty(len(s.edge) + 1, np.int64)
    joins = np.empty(len(s.edge) + 1, np.int64)
    for _ in range(tries):
        if clear_tabs(s, outline, np.int64(1), blockers, len(blockers)) > 0:
            return True
        if s.number[TESTED] == 0:
            break
        face = blockers[draw(rng, s.number[TESTED]), 1]
        count = _choose(s, path, tree_path(s, s.number[BASE], face, path), rng)
        for i in range(count):
            cut = path[i]
            component(s, cut)
            few = _choose(s, joins, joining_edges(s, joins), rng)
            unmark(s)
            for k in range(few):
                join = joins[k]
                if not hold_is_kept(s, outline, cut, join) or swap_is_free(s, cut, join) != 1:
                    continue
                swap(s, cut, join)
                if clear_tabs(s, outline, np.int64(1), s.entry, np.int64(0)) > 0:
                    return True
                swap(s, join, cut)
    return False
