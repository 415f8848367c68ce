"""A quick lower bound of edits: overlapping paths of a tree that share no crease."""

from __future__ import annotations

from typing import Any

import numpy as np

from planner._kernels.compiled import entry
from planner._kernels.nb_kernels import tree_path
from planner._kernels.net_arrays import FROZEN, Ints, NetArrays


@entry
def packed_paths(s: NetArrays, pairs: Ints, found: int) -> Any:
    """How many tree paths between the ``found`` overlapping pairs can be packed without a common crease.

    Short paths come first, paths of one length in the order of ``pairs``. Frozen edges may be shared.
    """
    edges = len(s.edge)
    path = np.empty(edges + 1, np.int64)
    length = np.empty(found, np.int64)
    start = np.zeros(edges + 2, np.int64)
    for i in range(found):
        count = tree_path(s, pairs[i, 0], pairs[i, 1], path)
        length[i] = 0
        for k in range(count):
            length[i] += 1 if s.edge[path[k], FROZEN] == 0 else 0
        start[length[i] + 1] += 1
    for k in range(edges + 1):
        start[k + 1] += start[k]
    order = np.empty(found, np.int64)
    for i in range(found):
        order[start[length[i]]] = i
        start[length[i]] += 1
    taken = np.zeros(edges, np.int64)
    packed = 0
    for at in range(found):
        i = order[at]
        count = tree_path(s, pairs[i, 0], pairs[i, 1], path)
        free = True
        for k in range(count):
            free = free and taken[path[k]] == 0
        if free:
            packed += 1
            for k in range(count):
                taken[path[k]] = 1 if s.edge[path[k], FROZEN] == 0 else 0
    return packed
