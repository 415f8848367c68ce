"""Dual paths whose end faces overlap when they are laid out along the path."""

from __future__ import annotations

import numpy as np

from planner._kernels.compiled import entry
from planner._kernels.net_arrays import CENTRE, FACES, MARK, RADIUS, SIDES, Floats, Ints, NetArrays
from planner._kernels.net_kernels import joined_pose, set_pose
from planner._kernels.overlap_kernels import triangles_overlap


@entry
def overlapping_paths(s: NetArrays, cost: Floats, reach: float, work: int, edges: Ints, found: Ints) -> int:
    """Minimal dual paths of total ``cost`` at most ``reach`` whose end faces overlap, by depth-first search.

    Minimal: no two other faces on the path overlap. Edges of negative cost are never used. A path found is
    written as its interior edges to ``edges`` and as (first face, last face, start, end) to a row of
    ``found``; only the way from the lower to the higher face is kept. Poses of the layout are overwritten.
    The search ends when ``work`` faces have been placed or there is no more room; the faces placed stand in
    the last row of ``found`` then. Returns how many paths were found.
    """
    node, edge, r = s.node, s.edge, s.real
    faces = node.shape[1]
    path = np.empty(faces, np.int64)
    via = np.empty(faces, np.int64)
    slot = np.empty(faces, np.int64)
    spent = np.empty(faces, np.float64)
    count, at, placed = 0, 0, 0
    node[MARK, :] = 0
    for start in range(faces):
        set_pose(s, start, 1.0, 0.0, 0.0, 0.0)
        path[0], slot[0], spent[0], n = start, 0, 0.0, 1
        node[MARK, start] = 1
        while n > 0:
            f = path[n - 1]
            if slot[n - 1] == 3 or placed >= work:
                node[MARK, f] = 0
                n -= 1
                continue
            e = node[SIDES + slot[n - 1], f]
            slot[n - 1] += 1
            if e < 0 or cost[e] < 0.0:
                continue
            g = edge[e, FACES] + edge[e, FACES + 1] - f
            total = spent[n - 1] + cost[e]
            if node[MARK, g] != 0 or total > reach:
                continue
            placed += 1
            c, d, x, y = joined_pose(s, e, g)
            set_pose(s, g, c, d, x, y)
            hit = -1
            for i in range(n - 2, -1, -1):
                h = path[i]
                dx, dy = r[h, CENTRE] - r[g, CENTRE], r[h, CENTRE + 1] - r[g, CENTRE + 1]
                near = r[h, RADIUS] + r[g, RADIUS]
                if dx * dx + dy * dy < near * near and triangles_overlap(r, g, h):
                    hit = i
                    break
            if hit < 0:
                path[n], via[n], slot[n], spent[n] = g, e, 0, total
                node[MARK, g] = 1
                n += 1
            elif hit == 0 and start < g:
                if count + 1 >= len(found) or at + n > len(edges):
                    placed = work
                    continue
                found[count, 0], found[count, 1], found[count, 2] = start, g, at
                for i in range(1, n):
                    edges[at] = via[i]
                    at += 1
                edges[at] = e
                at += 1
                found[count, 3] = at
                count += 1
    found[len(found) - 1, 0] = placed
    return count
