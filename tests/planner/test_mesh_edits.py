"""Mesh edits: how far flips let the surface deviate, what stays sound, and goals that get a net by them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.dual_graph import DualGraph
from planner.edge_flips import flipped, possible_flips
from planner.errors import NetError
from planner.goal_mesh import GoalMesh
from planner.make_net import make_net
from planner.mesh_edits import edit_until_net
from planner.mesh_intersect import intersecting_pairs
from planner.overlap import overlapping_faces
from planner.vertex_moves import vertex_moves
from tests.planner.goal_shapes import load_obj, plate, rough_ball
from tests.planner.hand_nets import box_goal
from tests.planner.no_net_shapes import overlapping_fan


def distance_to(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(N,) distance of points to the nearest triangle, by the library that reads meshes elsewhere."""
    import trimesh

    surface = trimesh.Trimesh(
        triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3), process=False
    )
    return trimesh.proximity.closest_point(surface, points)[1]


def spread(triangles: np.ndarray, steps: int = 12) -> np.ndarray:
    """Points spread over triangles (N, 3, 3), corners and sides included."""
    weights = (
        np.array([(i, j, steps - i - j) for i in range(steps + 1) for j in range(steps + 1 - i)]) / steps
    )
    return np.einsum("wk,nkd->nwd", weights, triangles).reshape(-1, 3)


@settings(max_examples=15)
@given(st.integers(0, 1000))
def test_a_flip_deviates_no_further_than_it_says(seed: int) -> None:
    goal = rough_ball(14, seed, 0.4)
    for flip in possible_flips(DualGraph(goal), np.inf)[:6]:
        changed = flipped(goal, [flip])
        faces = list(flip.faces)
        old, new = (mesh.vertices[mesh.faces[faces]] for mesh in (goal, changed))
        gap = max(distance_to(spread(old), new).max(), distance_to(spread(new), old).max())
        assert gap <= flip.deviation_mm + 1e-7
        DualGraph(changed)  # refuses edges with three faces or wound against each other
        again = [
            back for back in possible_flips(DualGraph(changed), np.inf) if set(back.faces) == set(flip.faces)
        ]
        assert any(back.deviation_mm == pytest.approx(flip.deviation_mm) for back in again)


def test_flips_of_a_flat_plate_change_no_shape() -> None:
    goal = plate()
    flips = possible_flips(DualGraph(goal), 1e-9)
    assert flips
    assert all(flip.flat and flip.deviation_mm < 1e-12 for flip in flips)
    assert [flip.deviation_mm for flip in flips] == sorted(flip.deviation_mm for flip in flips)


def test_a_flip_never_doubles_an_edge() -> None:
    """Any flip of a tetrahedron would make an edge that is there already."""
    points = np.array([(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)], dtype=float)
    faces = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    assert possible_flips(DualGraph(GoalMesh(points, faces)), np.inf) == []


def test_deviations_must_not_add_up() -> None:
    flips = possible_flips(DualGraph(box_goal()), np.inf)
    shared = next(f for f in flips[1:] if set(f.faces) & set(flips[0].faces))
    with pytest.raises(ValueError, match="share a face"):
        flipped(box_goal(), [flips[0], shared])


@given(st.floats(0.01, 5.0), st.integers(0, 50))
def test_no_vertex_moves_further_than_allowed(amplitude: float, seed: int) -> None:
    graph = DualGraph(rough_ball(12, 3))
    moves = list(vertex_moves(graph, np.array([0, 4]), amplitude, seed, 3))
    assert len(moves) >= 4
    for move in moves:
        assert np.linalg.norm(move, axis=1).max() <= amplitude * (1.0 + 1e-12)


@pytest.mark.parametrize("total", [361.0, 366.0])
def test_a_fan_is_bent_until_it_fits(total: float) -> None:
    goal = overlapping_fan(total)
    edit = edit_until_net(goal, 3.0)
    assert edit.kind == "moved"
    moved = np.linalg.norm(edit.goal.vertices - goal.vertices, axis=1)
    assert edit.deviation_mm == pytest.approx(moved.max())
    assert 0.0 < edit.deviation_mm <= 3.0
    assert edit.changed == tuple(np.flatnonzero(moved).tolist())
    assert np.array_equal(edit.goal.faces, goal.faces)
    assert edit.before_sha256 == goal.sha256 != edit.goal.sha256
    assert edit.goal.notices[-1] == edit.words
    assert not len(intersecting_pairs(edit.goal.vertices, edit.goal.faces))
    assert overlapping_faces(make_net(edit.goal)) == []


def test_less_is_changed_where_less_is_needed() -> None:
    little, much = (edit_until_net(overlapping_fan(total), 3.0).deviation_mm for total in (361.0, 370.0))
    assert little < much


def test_an_edge_is_flipped_before_vertices_are_moved() -> None:
    """Without one spoke, the fan's angles add up to about 4 degrees less."""
    goal = overlapping_fan(362.0)
    edit = edit_until_net(goal, 6.0)
    assert edit.kind == "flipped"
    assert edit.deviation_mm == min(flip.deviation_mm for flip in possible_flips(DualGraph(goal), 6.0))
    assert len(edit.changed) == 1
    assert np.array_equal(edit.goal.vertices, goal.vertices)
    assert overlapping_faces(make_net(edit.goal)) == []


def test_the_spiked_tetrahedron_with_its_spikes_lowered(shared_meshes) -> None:
    goal = load_obj(shared_meshes / "proc" / "spiketet36_a.obj")
    edit = edit_until_net(goal, 0.1 * goal.longest_side_mm)
    assert edit.deviation_mm <= 0.1 * goal.longest_side_mm
    assert overlapping_faces(make_net(edit.goal)) == []


def test_what_is_not_enough_is_a_no() -> None:
    with pytest.raises(NetError, match=r"within 0\.001 mm gave a net.*--leave-out") as caught:
        edit_until_net(overlapping_fan(370.0), 0.001)
    assert caught.value.faces


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf])
def test_a_tolerance_is_a_length(wrong: float) -> None:
    with pytest.raises(ValueError, match="finite length"):
        edit_until_net(box_goal(), wrong)


def test_same_input_same_edit() -> None:
    one, two = (edit_until_net(overlapping_fan(366.0), 2.0, seed=3) for _ in range(2))
    assert one.goal.sha256 == two.goal.sha256
    assert one.words == two.words
