"""Nets with faces left out, only ever on request: the smallest area that has to go so that the rest fits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.base_faces import rank_bases
from planner.blooming_trees import BLOOMING_TREES, TreeName, blooming_tree
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.lightest_branches import face_areas, lightest_branches
from planner.nearly_blooming import DEFAULT_BUDGET_S, WORK_PER_SECOND, certify, nearly_blooming
from planner.net import Net
from planner.net_methods import net_method
from planner.overlap import overlapping_triangles

__all__ = ["net_with_faces_left_out"]

BASES_TRIED = 8
"""Bases, best first, whose trees are thinned out."""

REFINED = 6
"""Thinned-out trees, lightest first, to which faces are added again."""

MOST_PAIRS = 4000
"""Trees with more overlapping pairs than this are not thinned out."""

REFINED_BASES = 3
"""Bases from which each lighter choice is tried."""

LIGHTER_S = 2.0
"""Nominal seconds for lighter choices, even if the trees took the whole budget."""

SET_UP_WORK = 20
"""Faces tested for overlap that setting up one lighter choice stands for, per face of the goal."""


@dataclass(frozen=True, eq=False)
class _Thinned:
    """A layout of what is left of a goal, and the area that is missing."""

    layout: FlatLayout
    area: float

    @property
    def order(self) -> tuple[float, bool, int]:
        """Key that puts better ones first: little area, then room for a tab, then few faces missing."""
        goal = self.layout.graph.goal
        return (round(self.area, 6), not self.layout.tab_has_room(), len(goal.left_out))


def net_with_faces_left_out(
    goal: GoalMesh,
    *,
    method: str = "nb",
    base_face: int | None = None,
    seed: int = 0,
    budget_s: float | None = None,
) -> Net:
    """A net of ``goal`` without the faces, small in area, that keep it from having one.

    The trees of several bases are thinned out by ``lightest_branches``; faces that fit elsewhere are added
    again; then lighter choices are tried: one missing face less, or another single face. The base panel
    always stays. The area is the least for a tree, not over all trees: another net may need less.

    Args:
        goal: a mesh of one piece.
        method: ``nb`` thins out the blooming trees and the nets that the search from them ends with, any
            other method its own tree.
        base_face: the stationary face; None: chosen.
        seed: of every random choice.
        budget_s: nominal seconds, counted as work.

    Returns:
        The net; its ``goal`` is what is left, ``goal.left_out`` names the missing faces of ``goal.original``.

    Raises:
        NetError: if ``goal`` is not one piece, or no base could be held.
    """
    graph = DualGraph(goal)
    if graph.pieces > 1:
        raise NetError(
            f"{goal.name} is not formable from one sheet: its faces are {graph.pieces} pieces that no edge "
            "joins; fold each piece by itself"
        )
    left = (DEFAULT_BUDGET_S if budget_s is None else budget_s) * WORK_PER_SECOND
    areas = face_areas(graph)
    thinned: list[tuple[float, int, FlatLayout, NDArray[np.bool_]]] = []
    if base_face is None:
        bases = [(rank.face, rank.tree) for rank in rank_bases(graph, BASES_TRIED, seed=seed)]
    else:
        bases = [(base_face, tree) for tree in BLOOMING_TREES]
    for layout, work in _trees(graph, method, bases, seed, left / WORK_PER_SECOND):
        left -= work
        pairs = layout.overlapping_pairs()
        if len(pairs) <= MOST_PAIRS or not thinned:
            gone = lightest_branches(layout, pairs)
            thinned.append((round(float(areas[gone].sum()), 6), len(thinned), layout, gone))
        if left <= 0.0 and thinned:
            break
    thinned.sort(key=lambda one: one[:2])
    found = [
        _Thinned(rest, float(areas[rest.graph.goal.left_out].sum()))
        for _, _, layout, gone in thinned[:REFINED]
        for rest in (_rest(layout, gone, _added_again(layout, gone)), _rest(layout, gone, {}))
        if rest.free_edges() and not rest.overlaps
    ]
    if not found:
        raise NetError(f"{goal.name}: even with faces left out no tab can hold the base; try another --base")
    best = min(found, key=lambda one: one.order)
    if method == "nb":
        best = _lighter(best, bases, areas, seed, max(left, LIGHTER_S * WORK_PER_SECOND))
    return best.layout.to_net(certify(best.layout, method))


def _trees(
    graph: DualGraph, method: str, bases: list[tuple[int, TreeName]], seed: int, budget_s: float
) -> Iterator[tuple[FlatLayout, int]]:
    """Layouts to thin out, with the work that went into each, base by base."""
    for base in dict.fromkeys(face for face, _ in bases):
        if graph.is_tree:
            yield FlatLayout(graph, np.ones(len(graph.faces), dtype=np.bool_), base), 0
            continue
        if method != "nb":
            attempt = net_method(method)(graph, base, seed, budget_s)
            yield attempt.layout, attempt.work
            continue
        for tree in BLOOMING_TREES:
            for cut_panels in (False, True)[: 1 + graph.has_rings]:
                attempt = nearly_blooming(
                    graph, base, tree=tree, seed=seed, budget_s=budget_s, cut_panels=cut_panels
                )
                yield attempt.layout, attempt.work
            yield FlatLayout(graph, blooming_tree(graph, base, tree), base), 0


def _added_again(layout: FlatLayout, gone: NDArray[np.bool_]) -> dict[int, int]:
    """Missing faces that fit beside one that is there, largest first: face → the edge that joins it."""
    graph, corners = layout.graph, layout.corners
    closed = np.zeros(len(gone), dtype=np.bool_) if layout.free_edges() else layout.depth == 0
    present = ~gone
    missing = np.flatnonzero(gone)
    missing = missing[np.argsort(-face_areas(graph)[missing].round(9), kind="stable")]
    added: dict[int, int] = {}
    again = True
    while again:
        again = False
        for face in missing.tolist():
            for edge in graph.face_edges[face].tolist() if not present[face] else []:
                other = int(graph.faces[edge].sum()) - face if edge >= 0 else -1
                if other < 0 or not present[other] or closed[other]:
                    continue
                laid = _laid_beside(graph, corners[other], face, edge)
                if _is_free(laid, corners[present]):
                    corners[face], present[face], again = laid, True, True
                    added[face] = edge
                    break
    return added


def _laid_beside(graph: DualGraph, beside: NDArray[np.float64], face: int, edge: int) -> NDArray[np.float64]:
    """(3, 2) corners of ``face`` laid flat across ``edge`` from its neighbour with corners ``beside``."""
    own = 0 if graph.faces[edge, 0] == face else 1
    slot, there = int(graph.slots[edge, own]), int(graph.slots[edge, 1 - own])
    local = graph.flat_corners[face] @ np.array([1.0, 1.0j])
    start, end = beside[[(there + 1) % 3, there]] @ np.array([1.0, 1.0j])
    heading = (end - start) / (local[(slot + 1) % 3] - local[slot])
    points = start + heading / abs(heading) * (local - local[slot])
    return np.stack([points.real, points.imag], axis=1)


def _is_free(triangle: NDArray[np.float64], others: NDArray[np.float64]) -> bool:
    """True if ``triangle`` (3, 2) overlaps none of ``others`` (N, 3, 2)."""
    low, high = triangle.min(axis=0), triangle.max(axis=0)
    near = others[((others.max(axis=1) > low) & (others.min(axis=1) < high)).all(axis=1)]
    pairs = overlapping_triangles(np.concatenate([near, triangle[None]]))
    return all(other != len(near) for _, other in pairs)


def _rest(layout: FlatLayout, gone: NDArray[np.bool_], added: dict[int, int]) -> FlatLayout:
    """The layout without the faces that are ``gone``, but with those that are ``added`` by an edge each."""
    graph = layout.graph
    missing = gone.copy()
    missing[list(added)] = False
    goal = graph.goal.without(np.flatnonzero(missing).tolist())
    rest = DualGraph(goal)
    kept = np.flatnonzero(~missing)
    number = np.cumsum(~missing) - 1
    tree = np.zeros(len(rest.faces), dtype=np.bool_)
    for face in kept.tolist():
        edge = added.get(face, int(layout.crease[face]))
        if edge >= 0:
            slot = int(graph.slots[edge, 0 if graph.faces[edge, 0] == face else 1])
            tree[rest.face_edges[number[face], slot]] = True
    return FlatLayout(rest, tree, int(number[layout.base]))


def _lighter(
    best: _Thinned, ranked: list[tuple[int, TreeName]], areas: NDArray[np.float64], seed: int, budget: float
) -> _Thinned:
    """Look for a choice with less area than ``best``: one face less, or another single face.

    Args:
        best: what was found so far.
        ranked: bases of the whole goal with the tree to start from, best first.
        areas: (F,) of the goal's faces, mm².
        seed: of the search.
        budget: faces tested for overlap that may be spent.
    """
    goal = best.layout.graph.goal.original
    single = np.argsort(areas.round(9), kind="stable").tolist()
    tried: set[tuple[int, ...]] = set()
    while True:
        missing = best.layout.graph.goal.left_out.tolist()
        fewer = [tuple(other for other in missing if other != face) for face in missing]
        lighter = sorted(fewer, key=lambda faces: float(areas[list(faces)].sum()))
        lighter += [(face,) for face in single if areas[face] < best.area - 1e-6]
        better = None
        for choice in lighter:
            bases = [rank for rank in ranked if rank[0] not in choice][:REFINED_BASES]
            if not choice or choice in tried or not bases:
                continue
            if budget <= 0.0:
                return best
            tried.add(choice)
            better, work = _with_choice(goal, choice, bases, areas, seed, budget)
            budget -= work
            if better is not None:
                best = better
                break
        if better is None:
            return best


def _with_choice(
    goal: GoalMesh,
    choice: tuple[int, ...],
    bases: list[tuple[int, TreeName]],
    areas: NDArray[np.float64],
    seed: int,
    budget: float,
) -> tuple[_Thinned | None, int]:
    """The nearly-blooming search with exactly the faces of ``choice`` missing, and the work it was."""
    graph = DualGraph(goal.without(choice))
    work = SET_UP_WORK * len(graph.goal.faces)
    if graph.pieces > 1 or graph.is_tree:
        return None, work
    for face, tree in bases:
        base = int(np.searchsorted(graph.goal.faces_goal, face))
        attempt = nearly_blooming(
            graph, base, tree=tree, seed=seed, budget_s=budget / WORK_PER_SECOND, cut_panels=graph.has_rings
        )
        work += attempt.work
        if attempt.is_net:
            return _Thinned(attempt.layout, float(areas[list(choice)].sum())), work
    return None, work
