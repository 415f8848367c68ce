"""The dual graph: neighbours, signs of fold angles, panels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.goal_mesh import GoalMesh
from tests.planner.goal_shapes import (
    block_with_hole,
    bodies,
    helix_strip,
    plate,
    random_hull,
    tetrahedron,
    torus,
)
from tests.planner.hand_nets import box_goal, neighbours, signed_dihedral


@settings(max_examples=40)
@given(bodies)
def test_edges_agree_with_the_plain_reference(goal: GoalMesh) -> None:
    graph = DualGraph(goal)
    side = neighbours(goal)
    assert len(graph.boundary) == 0
    assert len(graph.faces) == 3 * len(goal.faces) // 2
    for m in range(len(graph.faces)):
        f, g = graph.faces[m].tolist()
        k, j = graph.slots[m].tolist()
        a, b = graph.vertices[m].tolist()
        assert a < b
        assert side[a, b] == (f, k)
        assert side[b, a] == (g, j)
        assert graph.face_edges[f, k] == m == graph.face_edges[g, j]
        assert graph.fold_angle[m] == pytest.approx(signed_dihedral(goal, f, g, k), abs=1e-12)
        assert graph.length[m] == pytest.approx(np.linalg.norm(goal.vertices[a] - goal.vertices[b]))


@given(st.integers(6, 60), st.integers(0, 1000))
def test_edges_of_convex_bodies_are_mountains(count: int, seed: int) -> None:
    graph = DualGraph(random_hull(count, seed))
    assert (graph.fold_angle < 1e-9).all()


def test_turning_a_body_inside_out_changes_the_sign() -> None:
    body = random_hull(20, 3)
    inside_out = GoalMesh(body.vertices, body.faces[:, ::-1])
    assert np.allclose(DualGraph(inside_out).fold_angle, -DualGraph(body).fold_angle)


def test_dihedral_of_the_tetrahedron() -> None:
    graph = DualGraph(tetrahedron())
    assert np.allclose(graph.fold_angle, -(np.pi - np.arccos(1.0 / 3.0)))


def test_box_has_six_panels() -> None:
    graph = DualGraph(box_goal())
    assert np.bincount(graph.panel).tolist() == [2] * 6
    assert np.array_equal(graph.flat, graph.flat_forest)
    assert np.allclose(np.unique(np.round(graph.fold_angle, 9)), [-np.pi / 2, 0.0])
    assert not graph.has_rings


def test_plate_is_one_panel_with_boundary() -> None:
    graph = DualGraph(plate(4, 3))
    assert len(graph.boundary) == 14
    assert graph.panel.max() == 0
    assert graph.flat_forest.sum() == len(graph.goal.faces) - 1
    assert graph.pieces == 1
    assert not graph.is_tree
    assert not graph.has_rings


def test_rings_and_trees_are_seen() -> None:
    assert DualGraph(block_with_hole()).has_rings
    assert not DualGraph(torus()).has_rings
    assert DualGraph(helix_strip()).is_tree


def test_flat_corners_keep_lengths() -> None:
    graph = DualGraph(torus())
    sides = np.linalg.norm(np.roll(graph.flat_corners, -1, axis=1) - graph.flat_corners, axis=2)
    assert np.allclose(sides, graph.side_length, rtol=1e-13)
    assert (graph.flat_corners[:, 2, 1] > 0.0).all()


def test_two_pieces_are_counted() -> None:
    box = box_goal()
    both = GoalMesh(
        np.concatenate([box.vertices, box.vertices + 100.0]), np.concatenate([box.faces, box.faces + 8])
    )
    assert DualGraph(both).pieces == 2


@pytest.mark.parametrize(
    "faces",
    [[[0, 1, 2], [1, 0, 3], [0, 1, 4]], [[0, 1, 2], [0, 1, 3]]],
    ids=["three faces", "two that run the same way"],
)
def test_bad_edges_are_named(faces: list[list[int]]) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]], float)
    with pytest.raises(NetError, match="edge between vertices 0 and 1"):
        DualGraph(GoalMesh(points, np.array(faces), name="bad"))


def test_empty_goal_is_refused() -> None:
    with pytest.raises(NetError, match="no faces"):
        DualGraph(GoalMesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=int)))
