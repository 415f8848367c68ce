"""Every spanning tree of a small dual graph, laid flat: the oracle for searches and for proofs.

Trees are taken as the searches take them: the flat forest of the panels is in every tree, other flat edges
in none.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numba
import numpy as np
from numpy.typing import NDArray

from planner._kernels.nb_kernels import free_edges
from planner._kernels.net_arrays import FACES, TREE
from planner._kernels.net_kernels import lay_flat, root_tree
from planner._kernels.overlap_kernels import all_overlaps
from planner.dual_graph import DualGraph
from planner.flat_layout import base_outline
from planner.layout_arrays import graph_arrays

FAR = 1 << 40
"""Edits that stand for: there is no such tree."""


@dataclass(frozen=True)
class AllTrees:
    """What all spanning trees of one goal come to.

    Attributes:
        trees: how many there are.
        nets: those without overlap.
        held_nets: those of them that leave a free side at the base panel, long enough for a tab.
        fewest_edits: fewest creases that a net has and the start tree lacks; None without any net.
        fewest_held_edits: the same among the held nets.
        most_overlaps: overlapping pairs in the worst tree.
    """

    trees: int
    nets: int
    held_nets: int
    fewest_edits: int | None
    fewest_held_edits: int | None
    most_overlaps: int


def count_spanning_trees(graph: DualGraph) -> int:
    """How many spanning trees the panel graph has: Kirchhoff's determinant in exact arithmetic."""
    count = int(graph.panel.max()) + 1
    matrix = [[Fraction(0)] * count for _ in range(count)]
    for one, other in graph.panel[graph.faces].tolist():
        if one != other:
            matrix[one][one] += 1
            matrix[other][other] += 1
            matrix[one][other] -= 1
            matrix[other][one] -= 1
    result = Fraction(1)
    for k in range(1, count):  # row and column 0 left out
        pivot = next((row for row in range(k, count) if matrix[row][k] != 0), None)
        if pivot is None:
            return 0
        if pivot != k:
            matrix[k], matrix[pivot] = matrix[pivot], matrix[k]
            result = -result
        result *= matrix[k][k]
        for row in range(k + 1, count):
            factor = matrix[row][k] / matrix[k][k]
            if factor:
                matrix[row] = [a - factor * b for a, b in zip(matrix[row], matrix[k], strict=True)]
    return int(result)


def spanning_trees(graph: DualGraph) -> Iterator[NDArray[np.bool_]]:
    """Masks (M,) of all spanning trees, in plain Python; for graphs with thousands of trees."""
    edges = _order(graph)
    ends = graph.faces.tolist()
    faces = len(graph.goal.faces)

    def merged(label: list[int], edge: int) -> list[int]:
        one, other = label[ends[edge][0]], label[ends[edge][1]]
        return [one if x == other else x for x in label]

    def walk(at: int, label: list[int], chosen: list[int]) -> Iterator[NDArray[np.bool_]]:
        if len(chosen) == faces - 1:
            mask = np.zeros(len(ends), dtype=np.bool_)
            mask[chosen] = True
            yield mask
            return
        rest = label
        for edge in edges[at:]:
            rest = merged(rest, edge)
        if len(set(rest)) > 1:
            return
        edge = edges[at]
        if label[ends[edge][0]] != label[ends[edge][1]]:
            yield from walk(at + 1, merged(label, edge), [*chosen, edge])
            if graph.flat[edge]:
                return
        yield from walk(at + 1, label, chosen)

    yield from walk(0, list(range(faces)), [])


def lay_all_trees(graph: DualGraph, base: int, start: NDArray[np.bool_]) -> AllTrees:
    """Lay every spanning tree flat around ``base`` and count edits from ``start`` (M,)."""
    arrays = graph_arrays(graph)
    outline = base_outline(graph, graph.panel == graph.panel[base])
    edges = np.array(_order(graph), dtype=np.int64)
    found = _walk(
        arrays, outline, edges, np.int64(np.count_nonzero(graph.flat_forest)), start, np.int64(base)
    )
    trees, nets, held, fewest, fewest_held, most = (int(x) for x in found)
    return AllTrees(trees, nets, held, fewest if nets else None, fewest_held if held else None, most)


def _order(graph: DualGraph) -> list[int]:
    """Edges in the order of decision: the flat forest, then across panels; flat cycles are left out."""
    forest, folds = np.flatnonzero(graph.flat_forest), np.flatnonzero(~graph.flat)
    return [int(edge) for edge in (*forest, *folds)]


@numba.njit(error_model="numpy")
def _walk(s, outline, order, forced, start, base):
    faces, count = s.node.shape[1], len(order)
    label = np.empty((count + 1, faces), np.int64)
    label[0] = np.arange(faces)
    choice = np.zeros(count, np.int64)  # 0 not decided, 1 in, 2 out
    chosen, edits, at = 0, 0, 0
    trees, nets, held, fewest, fewest_held, most = 0, 0, 0, FAR, FAR, 0
    s.edge[:, TREE] = 0
    while at >= 0:
        if chosen == faces - 1:
            trees += 1
            root_tree(s, base)
            lay_flat(s)
            overlaps = all_overlaps(s, s.entry, np.int64(0))
            most = max(most, overlaps)
            if overlaps == 0:
                nets += 1
                fewest = min(fewest, edits)
                if free_edges(s, outline) > 0:
                    held += 1
                    fewest_held = min(fewest_held, edits)
        elif at < count:
            e = order[at]
            one, other = label[at, s.edge[e, FACES]], label[at, s.edge[e, FACES + 1]]
            label[at + 1] = label[at]
            choice[at] = 2
            if one != other:
                choice[at] = 1
                s.edge[e, TREE] = 1
                chosen += 1
                edits += 0 if start[e] else 1
                for f in range(faces):
                    if label[at, f] == other:
                        label[at + 1, f] = one
            at += 1
            continue
        at -= 1
        while at >= 0:  # back to the last edge that can be left out instead
            e = order[at]
            if choice[at] == 1:
                s.edge[e, TREE] = 0
                chosen -= 1
                edits -= 0 if start[e] else 1
                if at >= forced and _connects(s, order, at + 1, label[at], label[at + 1]):
                    choice[at] = 2
                    label[at + 1] = label[at]
                    at += 1
                    break
            at -= 1
    return trees, nets, held, fewest, fewest_held, most


@numba.njit(error_model="numpy")
def _connects(s, order, first, label, room):
    """True if the edges from ``first`` on join all components of ``label``; ``room`` is written over."""
    room[:] = label
    pieces = 0
    for f in range(len(label)):
        pieces += 1 if label[f] == f else 0
    for k in range(first, len(order)):
        one, other = room[s.edge[order[k], FACES]], room[s.edge[order[k], FACES + 1]]
        if one != other:
            pieces -= 1
            if pieces == 1:
                return True
            for f in range(len(room)):
                if room[f] == other:
                    room[f] = one
    return pieces == 1
