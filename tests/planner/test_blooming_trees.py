"""Blooming trees: spanning, panels whole, overlap-free on convex bodies, the rules themselves."""

from __future__ import annotations

import heapq

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import BLOOMING_TREES, TreeGrower, blooming_tree, weighted_tree
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from tests.planner.goal_shapes import bodies, even_ball, plate, random_hull, rough_ball, tetrahedron, torus
from tests.planner.hand_nets import box_goal


def prim(graph: DualGraph, rank: np.ndarray, cost: np.ndarray, base: int, adding: bool) -> set[int]:
    """Prim's tree with a plain heap: rank, then key, then length, then number."""
    reached, tree = {base}, set()
    heap: list[tuple[int, float, float, int]] = []

    def look_around(face: int, reach: float) -> None:
        for edge in graph.face_edges[face].tolist():
            if edge >= 0:
                key = (int(rank[edge]), cost[edge] + reach, -round(float(graph.length[edge]), 9), edge)
                heapq.heappush(heap, key)

    look_around(base, 0.0)
    while heap:
        _, key, _, edge = heapq.heappop(heap)
        new = [face for face in graph.faces[edge].tolist() if face not in reached]
        if new:
            reached.add(new[0])
            tree.add(edge)
            look_around(new[0], key if adding else 0.0)
    return tree


@settings(max_examples=30)
@given(bodies, st.integers(0, 10_000))
def test_growing_agrees_with_a_plain_heap(goal: GoalMesh, seed: int) -> None:
    graph = DualGraph(goal)
    rng = np.random.default_rng(seed)
    rank, base = rng.integers(0, 3, len(graph.faces)), int(rng.integers(len(goal.faces)))
    for adding in (False, True):
        for cost in (rng.random(len(graph.faces)), np.ones(len(graph.faces))):
            tree = TreeGrower(graph).grow(rank, cost, base, adding=adding)
            assert set(np.flatnonzero(tree).tolist()) == prim(graph, rank, cost, base, adding)


@pytest.mark.parametrize("name", BLOOMING_TREES)
def test_round_bodies_bloom_without_overlap(name: str) -> None:
    """Not every convex body does (no tree rule is known that never overlaps), but round ones do."""
    for goal in (even_ball(12), even_ball(40), even_ball(90), box_goal(), tetrahedron()):
        graph = DualGraph(goal)
        grower = TreeGrower(graph)
        for base in range(len(goal.faces)):
            assert FlatLayout(graph, grower.blooming(base, name), base, hold_base=False).overlaps == 0


@pytest.mark.parametrize("name", BLOOMING_TREES)
def test_trees_span_and_keep_panels(name: str) -> None:
    for goal in (box_goal(), torus(), plate(), rough_ball(40, 1)):
        graph = DualGraph(goal)
        for base in (0, len(goal.faces) // 2, len(goal.faces) - 1):
            tree = blooming_tree(graph, base, name)
            assert tree.sum() == len(goal.faces) - 1
            FlatLayout(graph, tree, base)  # refuses what is not a spanning tree
            assert tree[graph.flat_forest].all()


def test_bfs_has_the_fewest_folds() -> None:
    goal = rough_ball(60, 5)
    graph = DualGraph(goal)
    depth = FlatLayout(graph, blooming_tree(graph, 7, "bfs"), 7).depth
    hops = {7: 0}
    queue = [7]
    for face in queue:
        for edge in graph.face_edges[face].tolist():
            other = int(graph.faces[edge].sum()) - face
            if other not in hops:
                hops[other] = hops[face] + 1
                queue.append(other)
    assert depth.tolist() == [hops[face] for face in range(len(depth))]


def test_dijkstra_has_the_shortest_ways() -> None:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    goal = rough_ball(60, 9)
    graph = DualGraph(goal)
    centres = goal.vertices[goal.faces].mean(axis=1)
    middle = goal.vertices[graph.vertices].mean(axis=1)
    cost = sum(np.linalg.norm(centres[graph.faces[:, i]] - middle, axis=1) for i in range(2))
    size = (len(goal.faces), len(goal.faces))
    links = coo_matrix((cost, (graph.faces[:, 0], graph.faces[:, 1])), size)
    layout = FlatLayout(graph, blooming_tree(graph, 3, "dijkstra"), 3)
    way = np.zeros(len(goal.faces))
    for face in layout.order[1:].tolist():
        way[face] = way[layout.parent[face]] + cost[layout.crease[face]]
    assert np.allclose(way, dijkstra(links, directed=False, indices=3), atol=1e-6)


@settings(max_examples=20)
@given(bodies, st.integers(0, 1000))
def test_steepest_cuts_point_away_from_the_base(goal: GoalMesh, pick: int) -> None:
    graph = DualGraph(goal)
    base = pick % len(goal.faces)
    down = -goal.face_normals[base]
    height = goal.vertices @ down
    cuts = TreeGrower(graph).steepest_cuts(base)
    wanted = set()
    for vertex in range(len(goal.vertices)):
        if vertex == int(np.argmax(height.round(9))):
            continue
        edges = np.flatnonzero((graph.vertices == vertex).any(axis=1))
        others = graph.vertices[edges].sum(axis=1) - vertex
        slope = ((height[others] - height[vertex]) / graph.length[edges]).round(9)
        best = np.lexsort((others, -graph.length[edges].round(9), -slope))[0]
        wanted.add(int(edges[best]))
    assert set(np.flatnonzero(cuts).tolist()) == wanted


def test_weighted_tree_is_lightest() -> None:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import minimum_spanning_tree

    graph = DualGraph(random_hull(40, 2))
    weight = 0.1 + np.random.default_rng(0).random(len(graph.faces))
    size = (len(graph.goal.faces), len(graph.goal.faces))
    links = coo_matrix((weight, (graph.faces[:, 0], graph.faces[:, 1])), size)
    lightest = minimum_spanning_tree(links.tocsr()).sum()
    assert weight[weighted_tree(graph, weight)].sum() == pytest.approx(lightest)


def test_bad_names_and_bases_are_refused() -> None:
    graph = DualGraph(box_goal())
    with pytest.raises(NetError, match="choose one of steepest, dijkstra, bfs"):
        blooming_tree(graph, 0, "flower")  # type: ignore[arg-type]  # a wrong name on purpose
    with pytest.raises(NetError, match="faces 0 to 11"):
        blooming_tree(graph, 12)


def test_two_pieces_are_refused() -> None:
    box = box_goal()
    both = GoalMesh(
        np.concatenate([box.vertices, box.vertices + 100.0]), np.concatenate([box.faces, box.faces + 8])
    )
    with pytest.raises(NetError, match="not one piece"):
        blooming_tree(DualGraph(both), 0)
