"""Bringing edges of a blooming tree back into a net without overlaps: restoring, and shaking for fewer edits."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.nb_kernels import Seeds, clear_tabs, draw, exchange_pairs, free_edges
from planner._kernels.net_arrays import (
    BASE,
    BLOOMING,
    CENTRE,
    CORNER,
    CREASE,
    FACES,
    FLAT,
    FROZEN,
    HOPS,
    ORDER,
    OUTLINE,
    PARENT,
    POSE,
    QUERY,
    RADIUS,
    SIDE,
    STAMP,
    TESTED,
    TREE,
    Floats,
    Ints,
    NetArrays,
)
from planner._kernels.net_kernels import (
    component,
    motion,
    moved_overlaps,
    root_tree,
    set_pose,
    stride,
    swap,
    unmark,
)
from planner._kernels.overlap_kernels import cells, insert_face, remove_face, triangles_overlap
from planner._kernels.search_kernels import search

# rows of the scratch array of restoring: label of each face, faces and creases of a path, next cut allowed
# from each place of the path on
LABEL, NODES_OF, CREASES_OF, NEXT, ROWS = 0, 1, 2, 3, 4

KICKS = 4
"""Edges tried to bring back by force in one round, and creases tried for each."""

MOST_KICKED = 8
"""Overlaps that one of them may cause."""

STALL = 16
"""Rounds without fewer overlaps after which such overlaps are given up."""


@inner
def _walk(s: NetArrays, join: int, w: Ints) -> Any:
    """Faces and creases on the tree path between the faces of ``join``, in order; returns the creases.

    Labels the faces of the path with their places on it, the others with -1 until ``_label_all``.
    """
    node = s.node
    a, b = s.edge[join, FACES], s.edge[join, FACES + 1]
    faces = node.shape[1]
    count, back = 0, faces
    while a != b:
        if node[HOPS, a] >= node[HOPS, b]:
            w[NODES_OF, count], w[CREASES_OF, count] = a, node[CREASE, a]
            count += 1
            a = node[PARENT, a]
        else:
            back -= 1
            w[NODES_OF, back], w[CREASES_OF, back] = b, node[CREASE, b]
            b = node[PARENT, b]
    top = count
    creases = count + faces - back
    w[NEXT, 0] = a
    for i in range(back, faces):  # moves to lower places only
        w[CREASES_OF, count + i - back] = w[CREASES_OF, i]
    for i in range(back, faces):
        w[NEXT, 1 + i - back] = w[NODES_OF, i]
    for i in range(creases - count + 1):
        w[NODES_OF, count + i] = w[NEXT, i]
    for f in range(faces):
        w[LABEL, f] = -1
    for i in range(creases + 1):
        w[LABEL, w[NODES_OF, i]] = i
    w[LABEL, faces] = top
    return creases


@inner
def _label_all(s: NetArrays, w: Ints) -> None:
    """Label every face with the place on the path where it hangs.

    Without crease i of the path, the faces with labels up to i are on the side of the first face of ``join``,
    those beyond on that of the second.
    """
    node = s.node
    faces = node.shape[1]
    for i in range(faces):
        f = node[ORDER, i]
        if w[LABEL, f] < 0:
            w[LABEL, f] = w[LABEL, faces] if node[PARENT, f] < 0 else w[LABEL, node[PARENT, f]]


@inner
def _label(s: NetArrays, w: Ints, f: int) -> Any:
    """The label of one face, found by climbing to the path."""
    while w[LABEL, f] < 0 and s.node[PARENT, f] >= 0:
        f = s.node[PARENT, f]
    return w[LABEL, f] if w[LABEL, f] >= 0 else w[LABEL, s.node.shape[1]]


@inner
def _forbid(w: Ints, first: int, last: int) -> None:
    """Take the cuts at places ``first`` to ``last`` out of those allowed."""
    after = w[NEXT, last + 1]
    i = last
    while i >= 0 and w[NEXT, i] >= (0 if i >= first else first):
        w[NEXT, i] = after
        i -= 1


@inner
def _place(s: NetArrays, f: int, c: float, d: float, x: float, y: float) -> None:
    """Copy face ``f`` moved by (c, d, x, y) to the last row."""
    r = s.real
    t = len(r) - 1
    for k in range(0, 6, 2):
        u, v = r[f, CORNER + k], r[f, CORNER + k + 1]
        r[t, CORNER + k], r[t, CORNER + k + 1] = c * u - d * v + x, d * u + c * v + y
    for k in range(3):
        r[t, SIDE + k] = r[f, SIDE + k]
    u, v = r[f, CENTRE], r[f, CENTRE + 1]
    r[t, CENTRE], r[t, CENTRE + 1] = c * u - d * v + x, d * u + c * v + y
    r[t, RADIUS] = r[f, RADIUS]


@inner
def _hits(s: NetArrays, g: int) -> Any:
    """True if the face in the last row overlaps face ``g``."""
    r = s.real
    t = len(r) - 1
    dx, dy = r[g, CENTRE] - r[t, CENTRE], r[g, CENTRE + 1] - r[t, CENTRE + 1]
    reach = r[g, RADIUS] + r[t, RADIUS]
    return dx * dx + dy * dy < reach * reach and triangles_overlap(r, t, g)


@inner
def _free_cut(s: NetArrays, join: int, count: int, w: Ints, witness: Ints) -> Any:
    """Place of a cut that ``join`` can replace without overlap, -1 if there is none among those allowed.

    All cuts are judged at once: joining at ``join`` moves the second part by the same motion whichever
    crease of the path is cut, so a pair of faces that overlap after it forbids all cuts between them. The
    last such pair found is kept in ``witness``, since it mostly forbids the same cuts the next time.
    """
    c, d, x, y = motion(s, join, s.edge[join, FACES + 1])
    if witness[join, 0] >= 0:
        f, g = witness[join, 0], witness[join, 1]
        low, high = _label(s, w, f), _label(s, w, g)
        if w[NEXT, low] < high:
            _place(s, g, c, d, x, y)
            if _hits(s, f):
                _forbid(w, low, high - 1)
                if w[NEXT, 0] == count:
                    return -1
    _label_all(s, w)
    last = 0
    for i in range(count):
        if w[NEXT, i] == i:
            last = i
    first = w[NEXT, 0]
    below, above, faces = 0, 0, s.node.shape[1]
    for f in range(faces):
        below += 1 if w[LABEL, f] <= last else 0
        above += 1 if w[LABEL, f] > first else 0
    second = above <= below
    if not second:
        c, d, x, y = motion(s, join, s.edge[join, FACES])
    mask, t = len(s.head) - 1, len(s.real) - 1
    step = stride(faces)
    at = s.edge[join, FACES + (1 if second else 0)]
    for _ in range(faces):
        f = at
        at += step
        if at >= faces:
            at -= faces
        own = w[LABEL, f]
        if (own <= w[NEXT, 0]) if second else (w[NEXT, own] == count):
            continue
        _place(s, f, c, d, x, y)
        s.number[TESTED] += 1
        s.number[QUERY] += 1
        query = s.number[QUERY]
        x0, x1, y0, y1 = cells(s.real, t)
        for cx in range(x0, x1 + 1):
            for cy in range(y0, y1 + 1):
                e = s.head[(cx + 257 * cy) & mask]
                while e >= 0:
                    g = s.entry[e, 3]
                    e = s.entry[e, 0]
                    if s.node[STAMP, g] == query:
                        continue
                    s.node[STAMP, g] = query
                    low, high = (w[LABEL, g], own) if second else (own, w[LABEL, g])
                    if low >= high or w[NEXT, low] >= high or not _hits(s, g):
                        continue
                    witness[join, 0], witness[join, 1] = (g, f) if second else (f, g)
                    _forbid(w, low, high - 1)
                    if w[NEXT, 0] == count:
                        return -1
    return w[NEXT, 0]


@entry
def restore(s: NetArrays, outline: Ints, w: Ints, witness: Ints, roomy: int) -> Any:
    """Bring blooming edges back, each for a foreign crease, while nothing overlaps; returns the edits left.

    ``w`` (ROWS, F + 1) is scratch, ``witness`` (M, 2) starts at -1. With ``roomy`` a tab keeps its room.
    """
    edge = s.edge
    again = True
    while again:
        again = False
        for flat in range(1, -1, -1):
            for join in range(len(edge)):
                if edge[join, BLOOMING] == 0 or edge[join, TREE] != 0 or edge[join, FLAT] != flat:
                    continue
                count = _walk(s, join, w)
                tight = edge[join, OUTLINE] != 0 and free_edges(s, outline) <= 1
                w[NEXT, count] = count
                for i in range(count - 1, -1, -1):
                    e = w[CREASES_OF, i]
                    free = edge[e, BLOOMING] == 0 and edge[e, FROZEN] == 0
                    if tight and edge[e, OUTLINE] == 0:
                        free = False
                    w[NEXT, i] = i if free else w[NEXT, i + 1]
                while w[NEXT, 0] < count:
                    at = _free_cut(s, join, count, w, witness)
                    if at < 0:
                        break
                    cut = w[CREASES_OF, at]
                    swap(s, cut, join)
                    if roomy == 0 or clear_tabs(s, outline, 1, s.entry, 0) > 0:
                        again = True
                        break
                    swap(s, join, cut)
                    _forbid(w, at, at)
    left = 0
    for e in range(len(edge)):
        left += 1 if edge[e, BLOOMING] != 0 and edge[e, TREE] == 0 else 0
    return left


@inner
def _kick(s: NetArrays, join: int, w: Ints, pairs: Ints, found: int, rng: Seeds) -> Any:
    """Bring ``join`` back for the foreign crease that costs the fewest overlaps; returns the pairs then.

    Returns -1, and changes nothing, if there is no such crease or each costs too many overlaps.
    """
    edge = s.edge
    count = _walk(s, join, w)
    foreign = np.int64(0)
    for i in range(count):
        e = w[CREASES_OF, i]
        if edge[e, BLOOMING] == 0 and edge[e, FROZEN] == 0:
            w[NEXT, foreign] = e
            foreign += 1
    fewest, best = np.int64(MOST_KICKED), np.int64(-1)
    for i in range(min(foreign, np.int64(KICKS))):
        j = i + draw(rng, foreign - i)
        w[NEXT, i], w[NEXT, j] = w[NEXT, j], w[NEXT, i]
        component(s, w[NEXT, i])
        hits = moved_overlaps(s, join, fewest, s.entry, np.int64(0), np.int64(0))
        unmark(s)
        if hits <= fewest:
            fewest, best = hits - 1, w[NEXT, i]
    if best < 0:
        return np.int64(-1)
    return exchange_pairs(s, best, join, pairs, found)


@inner
def _keep(s: NetArrays, trees: Ints, poses: Floats) -> None:
    """Remember tree and layout."""
    for e in range(len(trees)):
        trees[e] = s.edge[e, TREE]
    for f in range(len(poses)):
        for k in range(4):
            poses[f, k] = s.real[f, POSE + k]


@inner
def _take_back(s: NetArrays, trees: Ints, poses: Floats) -> None:
    """Put tree and layout back to what was remembered."""
    for e in range(len(trees)):
        s.edge[e, TREE] = trees[e]
    for f in range(len(poses)):
        same = True
        for k in range(4):
            same = same and s.real[f, POSE + k] == poses[f, k]
        if not same:
            remove_face(s, f)
            set_pose(s, f, poses[f, 0], poses[f, 1], poses[f, 2], poses[f, 3])
            insert_face(s, f)
    root_tree(s, s.number[BASE])


@entry
def polish(
    s: NetArrays, outline: Ints, pairs: Ints, w: Ints, witness: Ints, rng: Seeds, roomy: int, rounds: int
) -> Any:
    """Look for fewer edits: bring edges back by force, remove the overlaps elsewhere, and restore.

    Each round starts from the best net so far, which must not overlap, and is taken back if it ends with
    more edits, with overlaps, or without the room for a tab. Returns the edits left.
    """
    edge = s.edge
    trees, poses = np.empty(len(edge), np.int64), np.empty((s.node.shape[1], 4))
    missing = np.empty(len(edge), np.int64)
    edits = restore(s, outline, w, witness, roomy)
    _keep(s, trees, poses)
    for _ in range(rounds):
        count = np.int64(0)
        for e in range(len(edge)):
            if edge[e, BLOOMING] != 0 and edge[e, TREE] == 0:
                missing[count] = e
                count += 1
        if count == 0:
            break
        found, kicked = np.int64(0), np.int64(0)
        wanted = 1 + draw(rng, 2)
        for _ in range(KICKS):
            join = missing[draw(rng, count)]
            if edge[join, TREE] != 0:
                continue
            new = _kick(s, join, w, pairs, found, rng)
            if new >= 0:
                found = new
                edge[join, FROZEN] += 2
                kicked += 1
                if kicked == wanted:
                    break
        left = search(s, outline, pairs, found, rng, STALL, s.number[TESTED] + 40 * len(poses))
        for i in range(count):
            edge[missing[i], FROZEN] &= 1
        if left == 0:
            now = restore(s, outline, w, witness, roomy)
            if now <= edits and (roomy == 0 or clear_tabs(s, outline, 1, s.entry, 0) > 0):
                edits = now
                _keep(s, trees, poses)
                continue
        _take_back(s, trees, poses)
    return edits
