"""Many trees judged at once: the same counts as laid out one by one, fans at vertices, rings of corners."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.tree_judge import TreeJudge, vertex_rings
from tests.planner.goal_shapes import block_with_hole, bodies, plate, rough_ball, torus
from tests.planner.hand_nets import box_goal


def wound_fans(graph: DualGraph, tree: np.ndarray) -> int:
    """Fans by union-find: faces at a vertex, joined over the creases and flat edges that end there."""
    goal, count = graph.goal, 0
    for vertex in range(len(goal.vertices)):
        around = np.flatnonzero((goal.faces == vertex).any(axis=1)).tolist()
        label = {face: face for face in around}
        for edge in np.flatnonzero((graph.vertices == vertex).any(axis=1)).tolist():
            if tree[edge] or graph.flat[edge]:
                one, other = label[graph.faces[edge, 0]], label[graph.faces[edge, 1]]
                label = {face: one if x == other else x for face, x in label.items()}
        total: dict[int, float] = {}
        for face, name in label.items():
            k = goal.faces[face].tolist().index(vertex)
            a, b, c = goal.vertices[np.roll(goal.faces[face], -k)]
            cosine = (b - a) @ (c - a) / np.linalg.norm(b - a) / np.linalg.norm(c - a)
            total[name] = total.get(name, 0.0) + float(np.arccos(np.clip(cosine, -1.0, 1.0)))
        count += sum(angle > 2.0 * np.pi + 1e-6 for angle in total.values())
    return count


@settings(max_examples=25)
@given(bodies, st.integers(0, 10_000))
def test_counts_agree_with_layouts_one_by_one(goal: GoalMesh, seed: int) -> None:
    graph = DualGraph(goal)
    judge = TreeJudge(graph)
    weights = np.random.default_rng(seed).random((4, len(graph.faces)))
    for row, (pairs, fans) in zip(weights, judge.judge(weights).tolist(), strict=True):
        tree = judge.tree(row)
        layout = FlatLayout(graph, tree, seed % len(goal.faces), hold_base=False)
        assert pairs == layout.overlaps == len(layout.overlapping_pairs())
        assert fans == wound_fans(graph, tree)
        assert fans <= pairs
        assert judge.cut_length(row) == pytest.approx(graph.length[~tree & ~graph.flat].sum())
    assert (judge.judged, judge.work) == (4, 4 * len(goal.faces))


def test_fans_do_occur() -> None:
    graph = DualGraph(rough_ball(40, 3, 0.7))
    judge = TreeJudge(graph)
    found = judge.judge(np.random.default_rng(0).random((50, len(graph.faces))))
    assert len(judge.hyperbolic) > 0
    assert (found[:, 1] > 0).any()


def test_the_tree_is_the_lightest() -> None:
    graph = DualGraph(box_goal())
    judge = TreeJudge(graph)
    weight = np.random.default_rng(1).random(len(graph.faces))
    tree = judge.tree(weight)
    assert tree[graph.flat].all()
    layout = FlatLayout(graph, tree, 0)
    for join in np.flatnonzero(~tree).tolist():
        path = layout.path(*graph.faces[join].tolist())
        path = path[~graph.flat[path]]
        assert (weight[path] <= weight[join]).all()


@pytest.mark.parametrize("goal", [box_goal(), plate(), torus(), block_with_hole()], ids=lambda g: g.name)
def test_rings_hold_every_corner_once(goal: GoalMesh) -> None:
    graph = DualGraph(goal)
    rings = vertex_rings(graph)
    assert sorted(rings.vertex.tolist()) == list(range(len(goal.vertices)))
    assert len(rings.edge) == 3 * len(goal.faces)
    assert rings.angle.sum() == pytest.approx(np.pi * len(goal.faces))
    for k, vertex in enumerate(rings.vertex.tolist()):
        edges = rings.edge[rings.first[k] : rings.first[k + 1]].tolist()
        inner = set(np.flatnonzero((graph.vertices == vertex).any(axis=1)).tolist())
        assert {edge for edge in edges if edge >= 0} == inner
        assert edges.count(-1) <= 1
        assert len(edges) == np.count_nonzero((goal.faces == vertex).any(axis=1))
        open_end = edges[0] < 0
        assert -1 not in edges[1:]
        for one, other in zip(edges, edges[1:] + ([] if open_end else edges[:1]), strict=open_end is False):
            if one >= 0:
                assert set(graph.faces[one]) & set(graph.faces[other])


def test_wrong_weights_and_loose_pieces_are_refused() -> None:
    graph = DualGraph(box_goal())
    with pytest.raises(NetError, match="shape"):
        TreeJudge(graph).judge(np.zeros((2, 3)))
    goal = box_goal()
    twice = GoalMesh(
        np.concatenate([goal.vertices, goal.vertices + 100.0]),
        np.concatenate([goal.faces, goal.faces + len(goal.vertices)]),
        "two boxes",
    )
    with pytest.raises(NetError, match="not one piece but 2"):
        TreeJudge(DualGraph(twice))
