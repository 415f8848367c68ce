"""Nets from random directions and weights: the rules that make the weights, and the best of many."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh
from planner.nearly_blooming import certify
from planner.net_heuristics import (
    BATCH,
    WEIGHTS,
    best_of_many,
    flat_tree_weights,
    random_directions,
    random_edge_weights,
    steepest_weights,
    unflat_tree_weights,
)
from planner.net_methods import NET_METHODS
from planner.overlap import overlapping_triangles
from planner.tree_judge import TreeJudge
from tests.planner.goal_shapes import bodies, even_ball, plate, random_hull, rough_ball
from tests.planner.hand_nets import box_goal


def test_directions_are_uniform_on_the_sphere() -> None:
    found = random_directions(20_000, np.random.default_rng(0))
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0)
    octant = np.bincount((found > 0) @ [1, 2, 4], minlength=8) / len(found)
    assert np.abs(octant - 1 / 8).max() < 0.01
    for axis in range(3):  # each coordinate is uniform in [-1, 1] (Archimedes)
        share, _ = np.histogram(found[:, axis], bins=10, range=(-1.0, 1.0))
        assert np.abs(share / len(found) - 0.1).max() < 0.01


@settings(max_examples=15)
@given(bodies, st.integers(0, 10_000))
def test_steepest_cuts_are_the_steepest_at_each_vertex(goal: GoalMesh, seed: int) -> None:
    graph = DualGraph(goal)
    judge = TreeJudge(graph)
    weights = steepest_weights(judge, 2, np.random.default_rng(seed))
    directions = random_directions(2, np.random.default_rng(seed))
    for row, direction in zip(weights, directions, strict=True):
        wanted = set()
        top = int(np.argmax(goal.vertices @ direction))
        for vertex in range(len(goal.vertices)):
            slopes = {}
            for edge in np.flatnonzero((graph.vertices == vertex).any(axis=1)).tolist():
                other = int(graph.vertices[edge].sum()) - vertex
                along = goal.vertices[other] - goal.vertices[vertex]
                slopes[edge] = float(along @ direction / np.linalg.norm(along))
            if vertex != top:
                wanted.add(max(slopes, key=lambda edge: slopes[edge]))
        assert set(np.flatnonzero(row).tolist()) == wanted


def test_flat_tree_weights_are_the_cosines() -> None:
    graph = DualGraph(rough_ball(20, 1))
    judge = TreeJudge(graph)
    direction = random_directions(1, np.random.default_rng(5))[0]
    along = np.diff(graph.goal.vertices[graph.vertices], axis=1)[:, 0]
    wanted = np.abs(along @ direction) / np.linalg.norm(along, axis=1)
    assert np.allclose(flat_tree_weights(judge, 1, np.random.default_rng(5))[0], wanted)
    assert np.allclose(unflat_tree_weights(judge, 1, np.random.default_rng(5))[0], 1.0 - wanted)


def test_random_edges_are_cut_at_every_inner_vertex_twice_at_hyperbolic_ones() -> None:
    judge = TreeJudge(DualGraph(rough_ball(40, 3, 0.7)))
    graph = judge.graph
    for row in random_edge_weights(judge, 10, np.random.default_rng(2)):
        cuts = np.bincount(graph.vertices[row == 1.0].ravel(), minlength=len(graph.goal.vertices))
        assert (cuts >= 1).all()
        assert (cuts[judge.hyperbolic] >= 2).all()
        assert row.sum() <= len(graph.goal.vertices) + len(judge.hyperbolic)
    open_graph = DualGraph(plate(3, 3))
    inner = random_edge_weights(TreeJudge(open_graph), 5, np.random.default_rng(2))
    assert (inner.sum(axis=1) <= 4).all()  # of sixteen vertices four lie inside


@pytest.mark.parametrize("name", sorted(WEIGHTS))
def test_the_best_of_many_is_honest(name: str) -> None:
    for goal in (box_goal(), even_ball(30), rough_ball(40, 3, 0.5)):
        graph = DualGraph(goal)
        attempt = NET_METHODS[name](graph, 2, 7, None)
        assert attempt.layout.base == 2
        assert attempt.layout.tree[graph.flat].all() or not graph.flat.any()
        pairs = overlapping_triangles(attempt.layout.corners)
        assert [tuple(pair) for pair in attempt.overlapping.tolist()] == pairs
        nearest = certify(attempt.layout, name)
        assert (attempt.tree, attempt.edits) == (nearest.tree, nearest.edits)
        certificate = attempt.certificate(name)
        assert certificate.lower_bound <= certificate.edits or not attempt.is_net
        assert attempt.work >= 100 * len(goal.faces)


@pytest.mark.parametrize("name", sorted(WEIGHTS))
def test_more_trees_are_never_worse(name: str) -> None:
    graph = DualGraph(rough_ball(60, 5, 0.5))
    few, many = (best_of_many(graph, 0, WEIGHTS[name], seed=1, tries=tries) for tries in (BATCH, 5 * BATCH))
    assert len(many.overlapping) <= len(few.overlapping)


def test_steepest_directions_unfold_convex_bodies() -> None:
    for seed in range(10):
        assert NET_METHODS["steepest-random"](DualGraph(random_hull(30, seed)), 0, seed, None).is_net


def test_a_small_budget_ends_after_the_first_trees() -> None:
    graph = DualGraph(rough_ball(60, 5, 0.5))
    attempt = best_of_many(graph, 0, WEIGHTS["random"], budget_s=1e-9)
    assert attempt.work < 2 * BATCH * len(graph.goal.faces)
