"""Many spanning trees judged in one call: grown from edge weights, laid flat, overlaps counted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from planner._kernels.compiled import entry, inner
from planner._kernels.nb_kernels import grow_tree
from planner._kernels.net_arrays import FLAT, TREE, Floats, Ints, NetArrays
from planner._kernels.net_kernels import lay_flat, root_tree
from planner._kernels.overlap_kernels import all_overlaps

FAN_SLACK_RAD = 1e-6
"""A fan of faces overlaps itself if its angles add up to more than a full turn and this."""


@inner
def _wound_fans(s: NetArrays, ring: Ints, angle: Floats, first: Ints) -> Any:
    """Fans of faces between two cuts at a vertex whose angles add up to more than a full turn."""
    count = np.int64(0)
    for v in range(len(first) - 1):
        size = first[v + 1] - first[v]
        start = 0
        while start < size:
            e = ring[first[v] + start]
            if e < 0 or s.edge[e, TREE] + s.edge[e, FLAT] == 0:
                break
            start += 1
        if start == size:
            continue
        total = 0.0
        for i in range(start, start + size):
            k = first[v] + (i if i < size else i - size)
            e = ring[k]
            if e < 0 or s.edge[e, TREE] + s.edge[e, FLAT] == 0:
                total = 0.0
            before = total
            total += angle[k]
            limit = 2.0 * math.pi + FAN_SLACK_RAD
            count += 1 if before <= limit < total else 0
    return count


@entry
def judge_trees(
    s: NetArrays,
    rank: Ints,
    weight: Floats,
    tie: Ints,
    ring: Ints,
    angle: Floats,
    first: Ints,
    out: Ints,
) -> Any:
    """Overlapping pairs and fans of more than a full turn of the minimum spanning tree for each row of weights.

    Args:
        s: arrays of the dual graph; the tree and the layout in them are written over.
        rank: (M,) edges of lower rank come first, whatever they weigh.
        weight: (K, M) one row for each tree.
        tie: (M,) order among equals.
        ring: (C,) edge before each corner, vertex by vertex, counter-clockwise; -1 where there is none.
        angle: (C,) angle of the corner, rad.
        first: (V + 1,) where the corners of each vertex start in ``ring``.
        out: (K, 2) pairs and fans, written; both -1 if the goal is not one piece.

    Returns:
        Number of trees without overlap.
    """
    good = np.int64(0)
    for k in range(len(weight)):
        grow_tree(s, rank, weight[k], tie, np.int64(0), False)
        if root_tree(s, np.int64(0)) != s.node.shape[1]:
            out[k, 0], out[k, 1] = -1, -1
            continue
        lay_flat(s)
        out[k, 0] = all_overlaps(s, s.entry, np.int64(0))
        out[k, 1] = _wound_fans(s, ring, angle, first)
        good += 1 if out[k, 0] == 0 else 0
    return good
