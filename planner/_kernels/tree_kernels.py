"""Trees as arrays: depth-first ranges of subtrees and the lever arm of every crease."""

from __future__ import annotations

import math

import numpy as np

from planner._kernels.compiled import entry


@entry
def subtree_ranges(parent, order):  # type: ignore[no-untyped-def]
    """Depth-first order of a tree and, for each node, the range of its subtree in that order.

    Args:
        parent: (F,) parent of each node, -1 for the root.
        order: (F,) nodes, parents before children.

    Returns:
        (preorder, first, last), each (F,): the subtree of f is ``preorder[first[f]:last[f]]``.
    """
    n = len(parent)
    size, free = np.ones(n, np.int64), np.ones(n, np.int64)
    first, preorder = np.zeros(n, np.int64), np.empty(n, np.int64)
    for k in range(n - 1, 0, -1):
        size[parent[order[k]]] += size[order[k]]
    for k in range(1, n):
        node = order[k]
        up = parent[node]
        first[node] = first[up] + free[up]
        free[up] += size[node]
    for node in range(n):
        preorder[first[node]] = node
    return preorder, first, first + size


@entry
def lever_arms(preorder, first, last, target, hinge_start, hinge_end, centroids):  # type: ignore[no-untyped-def]
    """(F,) root mean square displacement of the whole part, mm, per radian missing at the crease of each face.

    Args:
        preorder, first, last: as from ``subtree_ranges``.
        target: (F,) wanted angles; a face whose angle is 0 has no lever.
        hinge_start, hinge_end: (F, 3) ends of the creases on the goal.
        centroids: (F, 3) centroids of the goal faces.
    """
    n = len(target)
    out = np.zeros(n)
    for f in range(n):
        if target[f] == 0.0:
            continue
        ox, oy, oz = hinge_start[f, 0], hinge_start[f, 1], hinge_start[f, 2]
        ax, ay, az = hinge_end[f, 0] - ox, hinge_end[f, 1] - oy, hinge_end[f, 2] - oz
        length = math.sqrt(ax * ax + ay * ay + az * az)
        total = 0.0
        for k in range(first[f], last[f]):
            g = preorder[k]
            x, y, z = centroids[g, 0] - ox, centroids[g, 1] - oy, centroids[g, 2] - oz
            along = (x * ax + y * ay + z * az) / length
            total += x * x + y * y + z * z - along * along
        out[f] = math.sqrt(total / n)
    return out
