"""Insets: the mitre rule against plain geometry, and the core that every face keeps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.goal_mesh import GoalMesh
from planner.insets import (
    LARGEST_SHARE,
    MITRE_PLAY_MM,
    edge_insets,
    goal_dihedrals,
    inset_triangles,
    prism_corners,
)
from planner.net import Net


def loose_net(goal: GoalMesh) -> Net:
    """Every goal face laid flat on its own: enough for rules that look at one face at a time."""
    corners = goal.vertices[goal.faces]
    along = corners[:, 1] - corners[:, 0]
    length = np.linalg.norm(along, axis=1)
    third = corners[:, 2] - corners[:, 0]
    x = np.einsum("ij,ij->i", third, along) / length
    y = np.linalg.norm(np.cross(along, third), axis=1) / length
    zero = np.zeros_like(x)
    flat = np.stack([np.stack([zero, zero], 1), np.stack([length, zero], 1), np.stack([x, y], 1)], axis=1)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    return Net(
        goal=goal, base_face=0, vertices=flat.reshape(-1, 2), faces=faces, parent=np.full(len(faces), -1),
        edges=edges, assignment=np.full(len(edges), "B"), fold_angle=np.zeros(len(edges)),
        crease_of=np.full(len(faces), -1),
    )  # fmt: skip


def octahedron(size: float = 10.0) -> GoalMesh:
    vertices = size * np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return GoalMesh(vertices, np.array(faces))


def distance_to_line(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    u = (b - a) / np.linalg.norm(b - a)
    return float(np.linalg.norm((point - a) - np.dot(point - a, u) * u))


def test_octahedron_has_one_dihedral_and_the_mitre_of_it() -> None:
    goal = octahedron()
    angle = np.pi - np.arccos(-1.0 / 3.0)
    assert goal_dihedrals(goal) == pytest.approx(np.full((8, 3), angle), abs=1e-12)
    insets = edge_insets(loose_net(goal), 1.0, 0.0)
    assert insets == pytest.approx(np.full((8, 3), 0.5 * np.tan(angle / 2) + MITRE_PLAY_MM), abs=1e-12)


def test_clearance_wins_where_it_is_larger_and_on_boundaries() -> None:
    goal = GoalMesh(
        np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0], [9, 9, 3.0]]), np.array([[0, 1, 2], [1, 3, 2]])
    )
    insets = edge_insets(loose_net(goal), 0.1, 0.05)
    assert insets == pytest.approx(np.full((2, 3), 0.05), abs=1e-15)


def test_a_larger_angle_of_the_plan_widens_its_edge_only() -> None:
    goal = octahedron()
    net = loose_net(goal)
    plain = edge_insets(net, 0.5, 0.05)
    angles = np.zeros(len(net.edges))
    angles[7] = -np.radians(150.0)
    wide = edge_insets(net, 0.5, 0.05, angles)
    changed = np.argwhere(wide != plain)
    assert changed.tolist() == [[2, 1]]
    assert wide[2, 1] == pytest.approx(0.25 * np.tan(np.radians(75.0)) + MITRE_PLAY_MM)


triangles = arrays(np.float64, (3, 3), elements=st.floats(-50, 50, width=32))


@given(triangles, st.tuples(*[st.floats(0.0, 5.0)] * 3))
def test_inset_corners_lie_at_the_insets_from_the_edges(
    triangle: np.ndarray, insets: tuple[float, ...]
) -> None:
    sides = np.linalg.norm(np.roll(triangle, -1, axis=0) - triangle, axis=1)
    area2 = np.linalg.norm(np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0]))
    wanted = np.array(insets)
    if area2 < 1e-2 * sides.max() ** 2 or sides.min() < 1.0 or wanted @ sides > 0.9 * area2:
        return
    corners = inset_triangles(triangle, wanted)
    for k in range(3):
        here, there = triangle[k], triangle[(k + 1) % 3]
        assert distance_to_line(corners[k], here, there) == pytest.approx(wanted[k], abs=1e-9)
        assert distance_to_line(corners[(k + 1) % 3], here, there) == pytest.approx(wanted[k], abs=1e-9)


@given(
    st.floats(0.05, 20.0), st.floats(0.0, 3.0), st.floats(0.0, 3.0),
    st.tuples(*[st.floats(0.01, 3.0)] * 3),
)  # fmt: skip
def test_every_face_keeps_a_core(
    size: float, thickness: float, clearance: float, squash: tuple[float, ...]
) -> None:
    goal = octahedron(size)
    goal = GoalMesh(goal.vertices * np.array(squash), goal.faces)
    net = loose_net(goal)
    insets = edge_insets(net, thickness, clearance)
    flat = net.vertices[net.faces]
    sides = np.linalg.norm(np.roll(flat, -1, axis=1) - flat, axis=2)
    area2 = np.abs(np.cross(np.pad(flat[:, 1] - flat[:, 0], ((0, 0), (0, 1))),
                            np.pad(flat[:, 2] - flat[:, 0], ((0, 0), (0, 1)))))[:, 2]  # fmt: skip
    share = np.sum(insets * sides, axis=1) / area2
    wanted = np.maximum(clearance, thickness / 2 * np.tan(goal_dihedrals(goal) / 2) + MITRE_PLAY_MM)
    free = np.sum(wanted * sides, axis=1) / area2 <= LARGEST_SHARE * (1 - 1e-9)
    assert insets[free] == pytest.approx(wanted[free])
    assert share[~free] == pytest.approx(np.full((~free).sum(), LARGEST_SHARE))
    assert np.all(insets > 0.0)
    assert np.all(insets <= wanted * (1 + 1e-12))
    # what is cut down is cut to one common level, and nothing larger than the level stays
    for face in np.flatnonzero(~free):
        cut = insets[face] < wanted[face] * (1 - 1e-9)
        assert cut.any()
        assert insets[face][cut] == pytest.approx(np.full(cut.sum(), insets[face].max()))


def test_prism_is_the_inset_triangle_lifted_to_both_sides() -> None:
    triangle = np.array([[0, 0, 0], [10, 0, 0], [0, 10, 0.0]])
    prism = prism_corners(triangle, np.array([0.1, 0.2, 0.3]), 0.05)
    assert prism[:, 2].tolist() == pytest.approx([0.05] * 3 + [-0.05] * 3)
    assert prism[0, :2] == pytest.approx([0.3, 0.1])
    assert prism[3, :2] == pytest.approx([0.3, 0.1])
    both = prism_corners(np.stack([triangle, triangle + 5]), np.full((2, 3), 0.1), 0.05)
    assert both[1] == pytest.approx(both[0] + 5)


@pytest.mark.parametrize(("thickness", "clearance"), [(-1.0, 0.1), (0.1, float("nan")), (float("inf"), 0.1)])
def test_lengths_that_make_no_sense_are_refused(thickness: float, clearance: float) -> None:
    with pytest.raises(ValueError, match="must be finite"):
        edge_insets(loose_net(octahedron()), thickness, clearance)


def test_walls_of_two_joined_faces_do_not_meet_at_the_goal_angle() -> None:
    """Two unit plates at a dihedral: the gap between their prisms is twice the play along the bisector."""
    thickness, angle = 0.4, np.radians(100.0)
    up = np.array([[0, 0, 0], [10, 0, 0], [5, 10, 0.0]])
    turn = np.array([[1, 0, 0], [0, np.cos(angle), np.sin(angle)], [0, -np.sin(angle), np.cos(angle)]])
    down = (up * [1, -1, 1])[[1, 0, 2]] @ turn.T
    goal = GoalMesh(np.array([up[0], up[1], up[2], down[2]]), np.array([[0, 1, 2], [1, 0, 3]]))
    dihedral = goal_dihedrals(goal)[0, 0]
    insets = edge_insets(loose_net(goal), thickness, 0.0)
    a, b = (prism_corners(goal.vertices[goal.faces], insets, thickness / 2))[[0, 1]]
    bisector = np.cross([1.0, 0, 0], goal.face_normals.sum(axis=0))
    bisector /= np.linalg.norm(bisector)
    gap = max((a @ bisector).min() - (b @ bisector).max(), (b @ bisector).min() - (a @ bisector).max())
    assert gap == pytest.approx(2 * MITRE_PLAY_MM * np.cos(dihedral / 2), abs=1e-9)
