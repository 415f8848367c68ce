"""A quick lower bound of edits: overlapping paths of the blooming tree that share no edge need one each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.blooming_trees import TreeName, blooming_tree
from planner.flat_layout import FlatLayout
from planner.net_proof import NetProof, ProofBranch, ProofNoGood, Reason
from planner.no_goods import hold_no_good

__all__ = ["packed_proof"]


def packed_proof(net: FlatLayout, name: TreeName) -> NetProof:
    """Proof that every net needs as many edits as paths can be packed, short ones first.

    Of each path between faces that overlap in the blooming tree every net misses an edge; paths without a
    common edge that can be cut so need an edit each. The multipliers are 1.

    Args:
        net: a layout around the base face; the bound is for nets that keep the panels whole that it keeps
            whole: all, or only the base panel.
        name: the blooming tree from which edits are counted.
    """
    graph, base = net.graph, net.base
    whole_panels = bool(net.tree[graph.flat_forest].all())
    blooming = blooming_tree(graph, base, name)
    layout = FlatLayout(graph, blooming, base, hold_base=False)
    own = graph.panel[graph.faces[:, 0]] == graph.panel[base]
    free = ~(graph.flat_forest & (own | whole_panels))
    paths: list[tuple[int, tuple[int, int], NDArray[np.int64]]] = []
    if layout.overlaps:
        for f, g in layout.overlapping_pairs().tolist():
            edges = layout.path(f, g)
            paths.append((int(np.count_nonzero(free[edges])), (f, g), edges))
    paths.sort(key=lambda item: item[:2])
    ends: list[list[int]] = graph.vertices.tolist()
    taken = ~free
    packed: list[ProofNoGood] = []

    def pack(edges: list[int], why: Reason, faces: tuple[int, int]) -> None:
        taken[edges] = True
        pairs = tuple((ends[e][0], ends[e][1]) for e in edges)
        packed.append(ProofNoGood(pairs, 1, why, faces))

    hold = hold_no_good(graph, base)
    if hold is not None and blooming[list(hold.edges)].all():
        pack(list(hold.edges), "hold", hold.faces)
    for _, (f, g), edges in paths:
        if not (taken[edges] & free[edges]).any():
            pack(path_between(layout, f, g), "overlap", (f, g))
    return NetProof(
        no_goods=tuple(packed),
        denominator=1,
        multipliers=(tuple((i, 1) for i in range(len(packed))),),
        branches=(ProofBranch(multipliers=0),),
        bound=len(packed),
        whole_panels=whole_panels,
    )


def path_between(layout: FlatLayout, first: int, last: int) -> list[int]:
    """Edges of the tree path from one face to another, in order."""
    parent, crease = layout.parent, layout.crease
    up, steps = [], {first: 0}
    face = first
    while parent[face] >= 0:
        up.append(int(crease[face]))
        face = int(parent[face])
        steps[face] = len(up)
    down = []
    face = last
    while face not in steps:
        down.append(int(crease[face]))
        face = int(parent[face])
    return up[: steps[face]] + down[::-1]
