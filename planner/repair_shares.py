"""Nets from a solution of the programme: its tree of largest shares, repaired, then brought near blooming."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner._kernels import search_kernels
from planner._kernels.net_arrays import BLOOMING, FROZEN
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.nearly_blooming import NetAttempt, restore, rounds_for

__all__ = ["net_from_shares", "shared_tree"]

REPAIR_WORK = 300_000
"""Faces tested for overlap at most while one tree is repaired."""


def shared_tree(
    graph: DualGraph, blooming: NDArray[np.bool_], frozen: NDArray[np.bool_], kept: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(M,) the spanning tree of largest shares; ties: edges of the blooming tree, then lower numbers."""
    rank = np.lexsort((np.arange(len(kept)), ~blooming, -kept.round(6), ~frozen))
    parent = list(range(len(graph.goal.faces)))
    ends = graph.faces.tolist()
    tree = np.zeros(len(kept), dtype=np.bool_)
    for e in rank.tolist():
        a, b = ends[e]
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        while parent[b] != b:
            parent[b] = parent[parent[b]]
            b = parent[b]
        if a != b:
            parent[a] = b
            tree[e] = True
    return tree


def net_from_shares(
    graph: DualGraph,
    base: int,
    blooming: NDArray[np.bool_],
    start: NDArray[np.bool_],
    like: NetAttempt,
    seed: int,
    *,
    cut_panels: bool,
) -> NetAttempt:
    """Exchange creases of ``start`` until nothing overlaps, then bring back creases of the blooming tree.

    Args:
        graph: the dual graph of the goal.
        base: the base face.
        blooming: (M,) the blooming tree.
        start: (M,) the tree to start from.
        like: an attempt from the same blooming tree, for what does not change.
        seed: of the random choices.
        cut_panels: flat joints may be cut, but for those of the base panel.
    """
    layout = FlatLayout(graph, start, base)
    arrays = layout.arrays
    arrays.edge[:, BLOOMING] = blooming
    if cut_panels:
        own = graph.panel[graph.faces[:, 0]] == graph.panel[base]
        arrays.edge[:, FROZEN] = graph.flat & own
    found = layout.overlaps
    if found or not layout.free_edges():
        pairs = np.zeros((2 * found + 4 * len(graph.goal.faces), 2), dtype=np.int64)
        pairs[:found] = layout.overlapping_pairs()
        rng = np.array([0x9E3779B97F4A7C15 ^ (seed + 1)], dtype=np.uint64)
        search_kernels.search(arrays, layout.outline, pairs, found, rng, 200, REPAIR_WORK)
    if not len(layout.overlapping_pairs()):
        restore(layout, blooming, False, rounds=rounds_for(graph, None), seed=seed)
    layout = FlatLayout(graph, layout.tree, base)
    return NetAttempt(
        layout=layout,
        tree=like.tree,
        blooming_overlaps=like.blooming_overlaps,
        edits=int(np.count_nonzero(layout.tree & ~blooming)),
        overlapping=layout.overlapping_pairs(),
        held=layout.free_edges() > 0,
        roomy=layout.tab_has_room(),
        work=like.work,
    )
