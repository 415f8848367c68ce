"""Ear clipping: it covers the polygon once, keeps every vertex and says what was not flat."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import MeshError
from planner.mesh_polygons import triangulate
from planner.raw_mesh import RawMesh


def one_polygon(points) -> RawMesh:
    points = np.asarray(points, dtype=float)
    return RawMesh("one.obj", points, np.arange(len(points)), np.array([len(points)]), np.array([7]))


def areas(mesh) -> np.ndarray:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a) / 2.0


@given(
    radii=st.lists(st.integers(2, 20), min_size=4, max_size=24),
    turn=st.integers(0, 2**32 - 1),
)
@settings(max_examples=60)
def test_star_shaped_polygons_in_any_plane_are_covered_exactly_once(radii, turn):
    count = len(radii)
    angle = 2.0 * np.pi * np.arange(count) / count
    flat = np.array(radii)[:, None] * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(count)])
    shoelace = np.cross(flat, np.roll(flat, -1, axis=0))[:, 2].sum() / 2.0
    q, _ = np.linalg.qr(np.random.default_rng(turn).normal(size=(3, 3)))
    q *= np.sign(np.linalg.det(q))
    mesh = triangulate(one_polygon(flat @ q.T + 3.0))
    assert len(mesh.faces) == count - 2
    assert np.unique(mesh.faces).tolist() == list(range(count))
    # all ears turn as the polygon does, and their areas sum to its area: they cover it once
    signed = areas(mesh) @ q[:, 2]
    assert (signed > 0.0).all()
    assert signed.sum() == pytest.approx(shoelace, rel=1e-9)
    assert not any("not flat" in n for n in mesh.notices)


def test_straight_runs_keep_their_vertices_and_get_no_flat_triangle():
    side = [(x, 0, 0) for x in range(0, 60, 10)] + [(60, y, 0) for y in range(0, 40, 10)]
    side += [(x, 40, 0) for x in range(60, 0, -10)] + [(0, y, 0) for y in range(40, 0, -10)]
    mesh = triangulate(one_polygon(side))
    assert np.unique(mesh.faces).tolist() == list(range(len(side)))
    assert np.linalg.norm(areas(mesh), axis=1).min() > 1.0
    assert areas(mesh)[:, 2].sum() == pytest.approx(2400.0)


def test_a_polygon_that_is_not_flat_is_reported_with_its_place():
    mesh = triangulate(one_polygon([(0, 0, 0), (60, 0, 0), (60, 40, 6), (0, 40, 0)]))
    assert len(mesh.faces) == 2
    assert any("1 polygon not flat (first: face 1 (line 7))" in n for n in mesh.notices)


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0, 0), (10, 0, 0), (20, 0, 0), (30, 0, 0)],
        [(0, 0, 0), (10, 10, 0), (10, 0, 0), (0, 10, 0)],
        [(5, 5, 5)] * 4,
    ],
    ids=["straight", "bow tie", "one point"],
)
def test_polygons_without_a_covering_are_refused(points):
    with pytest.raises(MeshError, match=r"one.obj: face 1 \(line 7\) with 4 corners crosses itself"):
        triangulate(one_polygon(points))


def test_a_vertex_between_two_polygons_on_a_straight_edge_goes_and_a_bent_one_stays():
    points = [(0, 0, 0), (60, 0, 0), (60, 40, 0), (0, 40, 0), (60, -30, 20), (0, -30, 20), (30, 0, 0)]
    corners = np.array([0, 6, 1, 2, 3, 1, 6, 0, 5, 4])
    straight = RawMesh("two.obj", np.array(points, dtype=float), corners, np.array([5, 5]))
    assert 6 not in triangulate(straight).faces
    points[6] = (30, 1, 0)
    bent = RawMesh("two.obj", np.array(points, dtype=float), corners, np.array([5, 5]))
    assert 6 in triangulate(bent).faces


def test_triangles_pass_through_untouched():
    corners = np.array([2, 0, 1, 1, 3, 2])
    raw = RawMesh("plain.obj", np.arange(12.0).reshape(4, 3) ** 1.5, corners, np.array([3, 3]))
    mesh = triangulate(raw)
    assert mesh.faces.tolist() == [[2, 0, 1], [1, 3, 2]]
    assert mesh.notices == ()
    assert mesh.vertices is raw.vertices
