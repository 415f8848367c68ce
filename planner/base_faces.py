"""Which face stays where it is: bases ranked by their blooming trees and by how well they can be held."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from planner._kernels.base_kernels import packed_paths
from planner._kernels.net_arrays import DEPTH
from planner._kernels.net_kernels import lay_flat, root_tree
from planner._kernels.overlap_kernels import all_overlaps
from planner.blooming_trees import BLOOMING_TREES, TreeGrower, TreeName
from planner.dual_graph import DualGraph
from planner.flat_layout import base_outline
from planner.goal_mesh import GoalMesh

__all__ = ["SAMPLE_ABOVE", "BaseRank", "BloomingFigures", "blooming_figures", "rank_bases"]

SAMPLE_ABOVE = 1000
"""Goals with more panels than this are ranked on a seeded sample of as many."""


@dataclass(frozen=True)
class BloomingFigures:
    """How a blooming tree lies flat.

    Attributes:
        bound: overlapping paths that share no crease: every net that keeps the panels whole needs as many
            edits.
        overlaps: overlapping face pairs.
        depth: folds to the farthest face.
    """

    bound: int
    overlaps: int
    depth: int


@dataclass(frozen=True)
class BaseRank:
    """A base face and the figures that rank it; lower scores are better.

    Attributes:
        face: the base face, the largest of its panel.
        bound: fewest edits from the best of its blooming trees, see ``BloomingFigures``.
        overlaps: overlapping pairs in that tree.
        tree: that tree.
        depth: folds to the farthest face in it.
        panel_area: area of the flat panel around the face, mm².
        longest_edge: longest side of that panel which could be left free, mm.
        score: what they are ranked by.
    """

    face: int
    bound: int
    overlaps: int
    tree: TreeName
    depth: int
    panel_area: float
    longest_edge: float
    score: float


def rank_bases(
    goal: GoalMesh | DualGraph, count: int | None = None, *, seed: int = 0, sample: int = SAMPLE_ABOVE
) -> list[BaseRank]:
    """Base faces in order of promise, one for each flat panel.

    The score is ``bound / sqrt(F) + overlaps / 2F + 2 depth / sqrt(F) - log2(1 + panel area share * F) / 4 -
    min(1, edge / 10 mm) / 4`` with F faces: few edits, few overlaps, few folds in a row, a large panel, a
    long side for the tabs.

    Args:
        goal: the goal, or its dual graph.
        count: how many to return; None: all that were looked at.
        seed: of the sample.
        sample: most panels to look at; where there are more, a random choice of them is.

    Raises:
        NetError: if the goal is not one piece.
    """
    graph = goal if isinstance(goal, DualGraph) else DualGraph(goal)
    faces = len(graph.goal.faces)
    corners = graph.flat_corners
    area = 0.5 * corners[:, 1, 0] * corners[:, 2, 1]
    by_panel = np.lexsort((np.arange(faces), -area.round(9), graph.panel))
    first = np.unique(graph.panel[by_panel], return_index=True)[1]
    candidates = np.sort(by_panel[first])
    if len(candidates) > sample:
        chosen = np.random.default_rng(seed).choice(len(candidates), sample, replace=False)
        candidates = candidates[np.sort(chosen)]
    panel_area = np.bincount(graph.panel, weights=area)
    grower = TreeGrower(graph)
    ranked = []
    for face in candidates.tolist():
        figures = {name: blooming_figures(grower, face, name) for name in BLOOMING_TREES}
        tree = min(BLOOMING_TREES, key=lambda name: (_weight(figures[name], faces), figures[name].depth))
        best = figures[tree]
        outline = base_outline(graph, graph.panel == graph.panel[face])
        longest = float(graph.side_length[outline[:, 0], outline[:, 1]].max())
        own = float(panel_area[graph.panel[face]])
        share = own / float(area.sum())
        score = _weight(best, faces) + 2.0 * best.depth / faces**0.5
        score -= 0.25 * float(np.log2(1.0 + share * faces)) + 0.25 * min(1.0, longest / 10.0)
        ranked.append(BaseRank(face, best.bound, best.overlaps, tree, best.depth, own, longest, score))
    ranked.sort(key=lambda rank: (round(rank.score, 9), rank.face))
    return ranked[:count]


def blooming_figures(grower: TreeGrower, base: int, name: TreeName) -> BloomingFigures:
    """Lay the blooming tree ``name`` around ``base`` flat and look at it."""
    arrays = grower.arrays
    grower.blooming(base, name)
    root_tree(arrays, base)
    lay_flat(arrays)
    overlaps = int(all_overlaps(arrays, arrays.entry, 0))
    bound = 0
    if overlaps:
        pairs = np.empty((overlaps, 2), dtype=np.int64)
        all_overlaps(arrays, pairs, overlaps)
        bound = int(packed_paths(arrays, pairs, overlaps))
    return BloomingFigures(bound, overlaps, int(arrays.node[DEPTH].max()))


def _weight(figures: BloomingFigures, faces: int) -> float:
    """What a tree's overlaps weigh among ``faces`` faces."""
    return figures.bound / math.sqrt(faces) + 0.5 * figures.overlaps / faces
