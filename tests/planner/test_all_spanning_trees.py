"""Every spanning tree of small bodies: counts, no overlap on Platonic solids, the fewest edits there are."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import BLOOMING_TREES, blooming_tree
from planner.dual_graph import DualGraph
from planner.fewest_edits import prove_net
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.nearly_blooming import nearly_blooming
from tests.planner.all_spanning_trees import count_spanning_trees, lay_all_trees, spanning_trees
from tests.planner.goal_shapes import hull_goal, plate, random_hull, rough_ball, tetrahedron

GOLDEN = (1.0 + np.sqrt(5.0)) / 2.0
SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def turned(pairs: list[tuple[float, float]]) -> np.ndarray:
    """Points (0, a, b) with all signs, and turned about the space diagonal."""
    points = np.array([[0.0, x * a, y * b] for a, b in pairs for x in (-1, 1) for y in (-1, 1)])
    return np.concatenate([np.roll(points, shift, axis=1) for shift in range(3)])


def solid(name: str) -> GoalMesh:
    points = {
        "cube": SIGNS,
        "octahedron": np.concatenate([np.eye(3), -np.eye(3)]),
        "icosahedron": turned([(1.0, GOLDEN)]),
        "dodecahedron": np.concatenate([SIGNS, turned([(1.0 / GOLDEN, GOLDEN)])]),
    }
    return tetrahedron() if name == "tetrahedron" else hull_goal(10.0 * points[name], name)


def check_platonic(name: str, trees: int) -> None:
    graph = DualGraph(solid(name))
    assert count_spanning_trees(graph) == trees
    found = lay_all_trees(graph, 0, blooming_tree(graph, 0))
    assert (found.trees, found.nets, found.most_overlaps) == (trees, trees, 0)


@pytest.mark.parametrize(("name", "trees"), [("tetrahedron", 16), ("cube", 384), ("octahedron", 384)])
def test_no_tree_of_the_small_platonic_solids_overlaps(name: str, trees: int) -> None:
    check_platonic(name, trees)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dodecahedron", "icosahedron"])
def test_no_tree_of_the_large_platonic_solids_overlaps(name: str) -> None:
    # the known number of unfoldings with labelled edges; Horiyama and Shoji, CCCG 2011, report no overlap
    check_platonic(name, 5_184_000)


def by_choosing(graph: DualGraph) -> set[bytes]:
    """Spanning trees found by trying all sets of edges of the right size."""
    faces, found = len(graph.goal.faces), set()
    folds = np.flatnonzero(~graph.flat)
    forest = graph.flat_forest
    for chosen in combinations(folds.tolist(), faces - 1 - int(forest.sum())):
        mask = forest.copy()
        mask[list(chosen)] = True
        label = list(range(faces))
        for one, other in graph.faces[mask].tolist():
            label = [label[one] if x == label[other] else x for x in label]
        if len(set(label)) == 1:
            found.add(mask.tobytes())
    return found


@pytest.mark.parametrize(
    "goal",
    [tetrahedron(), solid("cube"), solid("octahedron"), plate(2, 1), random_hull(7, 3)],
    ids=lambda g: g.name,
)
def test_all_trees_are_found_once(goal: GoalMesh) -> None:
    graph = DualGraph(goal)
    trees = [tree.tobytes() for tree in spanning_trees(graph)]
    assert len(trees) == len(set(trees)) == count_spanning_trees(graph)
    assert set(trees) == by_choosing(graph)


@settings(max_examples=10)
@given(st.integers(5, 7), st.integers(0, 10_000), st.floats(0.3, 0.8), st.sampled_from(BLOOMING_TREES))
def test_the_compiled_walk_agrees_with_laying_each_tree_by_itself(
    count: int, seed: int, depth: float, name: str
) -> None:
    graph = DualGraph(rough_ball(count, seed, depth))
    base = seed % len(graph.goal.faces)
    start = blooming_tree(graph, base, name)
    nets, held, most = [], [], 0
    trees = list(spanning_trees(graph))
    for tree in trees:
        layout = FlatLayout(graph, tree, base)
        most = max(most, layout.overlaps)
        if layout.overlaps == 0:
            nets.append(np.count_nonzero(tree & ~start))
            if layout.free_edges():
                held.append(np.count_nonzero(tree & ~start))
    found = lay_all_trees(graph, base, start)
    assert (found.trees, found.nets, found.held_nets, found.most_overlaps) == (
        len(trees),
        len(nets),
        len(held),
        most,
    )
    assert found.fewest_edits == min(nets, default=None)
    assert found.fewest_held_edits == min(held, default=None)


@settings(max_examples=25)
@given(st.integers(6, 9), st.integers(0, 10_000), st.floats(0.4, 0.85), st.sampled_from(BLOOMING_TREES))
def test_the_search_finds_no_fewer_edits_than_there_are(
    count: int, seed: int, depth: float, name: str
) -> None:
    graph = DualGraph(rough_ball(count, seed, depth))  # at most 14 faces
    base = seed % len(graph.goal.faces)
    attempt = nearly_blooming(graph, base, tree=name, seed=seed)
    best = lay_all_trees(graph, base, blooming_tree(graph, base, name))
    if best.fewest_held_edits is None:
        assert not attempt.is_net
    elif attempt.is_net:
        assert attempt.edits >= best.fewest_held_edits


@settings(max_examples=25)
@given(st.integers(5, 9), st.integers(0, 10_000), st.floats(0.4, 0.85), st.sampled_from(BLOOMING_TREES))
def test_proven_fewest_edits_are_the_fewest_of_all_trees(
    count: int, seed: int, depth: float, name: str
) -> None:
    graph = DualGraph(rough_ball(count, seed, depth))  # at most 14 faces
    base = seed % len(graph.goal.faces)
    proven = prove_net(graph, base, tree=name, seed=seed)
    best = lay_all_trees(graph, base, blooming_tree(graph, base, name))
    if best.fewest_held_edits is None:
        assert not proven.attempt.is_net
    else:
        assert proven.optimal
        assert proven.attempt.edits == proven.lower_bound == best.fewest_held_edits
