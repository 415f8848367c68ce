"""Repairs: each undoes the damage that was done to a good mesh, and leaves a good mesh alone."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import MeshError
from planner.mesh_check import oriented_surface
from planner.mesh_edges import edge_table
from planner.mesh_repair import repair
from planner.raw_mesh import RawMesh, TriangleMesh

TINY = 0.01


def sheet(rows: int = 3, columns: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """An uneven open sheet of 2 x rows x columns triangles."""
    y, x = np.mgrid[0 : rows + 1, 0 : columns + 1] * 10.0
    vertices = np.column_stack([x.ravel(), y.ravel(), (0.2 * (x - 15.0) ** 2 / 10.0 + y * 0.3).ravel()])
    faces = []
    for r in range(rows):
        for c in range(columns):
            a = r * (columns + 1) + c
            b, d = a + 1, a + columns + 1
            faces += [[a, b, d + 1], [a, d + 1, d]]
    return vertices, np.array(faces)


def mesh_of(vertices, faces, *, soup: bool = False) -> TriangleMesh:
    vertices, faces = np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64)
    count = len(faces)
    raw = RawMesh("m.obj", vertices, faces.ravel(), np.full(count, 3), np.arange(1, count + 1), soup=soup)
    return TriangleMesh(vertices, faces, np.arange(count), raw)


def open_edges(mesh: TriangleMesh) -> int:
    return int((edge_table(mesh.faces).count == 1).sum())


def test_a_good_mesh_is_returned_as_it_is():
    mesh = mesh_of(*sheet())
    fixed = oriented_surface(repair(mesh, TINY))
    assert fixed.vertices is mesh.vertices
    assert fixed.faces is mesh.faces
    assert fixed.notices == ()


@given(seed=st.integers(0, 2**32 - 1), soup=st.booleans())
@settings(max_examples=40)
def test_scattered_repeated_turned_and_noisy_faces_come_back(seed, soup):
    rng = np.random.default_rng(seed)
    vertices, faces = sheet()
    order = rng.permutation(len(faces))
    flips = rng.random(len(faces)) < 0.2
    scattered = np.where(flips[:, None], faces[order][:, ::-1], faces[order])
    points = vertices[scattered].reshape(-1, 3) + rng.uniform(-1e-4, 1e-4, (3 * len(faces), 3))
    soup_faces = np.arange(len(points)).reshape(-1, 3)
    listed = np.concatenate([soup_faces, soup_faces[:2]])
    fixed = oriented_surface(repair(mesh_of(points, listed, soup=soup), TINY))
    assert len(fixed.faces) == len(faces)
    assert len(fixed.vertices) == len(vertices)
    assert open_edges(fixed) == 14
    normals = np.cross(
        *(fixed.vertices[fixed.faces[:, k]] - fixed.vertices[fixed.faces[:, 0]] for k in (1, 2))
    )
    assert abs(np.sign(normals[:, 2]).sum()) == len(faces)
    assert fixed.origin.tolist() == list(range(len(faces)))
    assert any("listed before" in n for n in fixed.notices)


@pytest.mark.parametrize("shares", [(0.5,), (0.25, 0.5, 0.75), (0.1, 0.4)])
def test_t_junctions_with_several_vertices_are_joined(shares):
    start, end = np.array([0.0, 0, 0]), np.array([60.0, 0, 0])
    inner = [start + s * (end - start) for s in shares]
    vertices = [start, end, (30, 40, 0), (30, -40, 20), *inner]
    run = [0, *range(4, 4 + len(inner)), 1]
    faces = [[0, 1, 2], *([b, a, 3] for a, b in pairwise(run))]
    fixed = oriented_surface(repair(mesh_of(vertices, faces), TINY))
    assert len(fixed.faces) == 2 * (len(inner) + 1)
    assert open_edges(fixed) == 4
    assert fixed.notices == (f"joined {len(inner)} T-junction{'s' if len(inner) > 1 else ''}",)


def test_an_edge_that_only_touches_another_is_left_open():
    vertices = [(0, 0, 0), (60, 0, 0), (30, 40, 0), (10, 0, 0), (30, 0, 0), (20, -30, 9), (0, -30, 0)]
    faces = [[0, 1, 2], [4, 3, 5], [0, 6, 5], [0, 5, 3]]
    joined = repair(mesh_of(vertices, faces), TINY)
    assert len(joined.faces) == 4  # the chain 0-3-4 ends before corner 1
    assert joined.notices == ()


def test_a_needle_shrinks_and_a_cap_is_taken_out():
    vertices, faces = sheet()
    # a needle pair: vertex 6 doubled at a distance below the limit, one fan of faces moved to the copy
    copy = len(vertices)
    points = np.vstack([vertices, vertices[6] + [0.003, 0.001, 0.0]])
    fan = [f for f in range(len(faces)) if 6 in faces[f]]
    ring = {f: np.roll(faces[f], -int(np.flatnonzero(faces[f] == 6)[0])) for f in fan}
    after = {int(r[1]): f for f, r in ring.items()}
    chain = [fan[0]]
    while len(chain) < 3:
        chain.append(after[int(ring[chain[-1]][2])])
    changed = faces.copy()
    for f in chain:
        changed[f] = [copy, *ring[f][1:]]
    first, last = int(ring[chain[0]][1]), int(ring[chain[-1]][2])
    changed = np.vstack([changed, [6, first, copy][::-1], [6, copy, last][::-1]])
    broken = mesh_of(points, changed)
    assert open_edges(broken) == 14
    fixed = oriented_surface(repair(broken, TINY))
    assert len(fixed.faces) == len(faces)
    assert open_edges(fixed) == 14
    assert "removed 2 needle faces" in fixed.notices[0]


def test_needles_that_would_leave_a_gap_are_refused():
    # two caps that share their long edge: taking both out tears the sheet open
    vertices = [(0, 0, 0), (60, 0, 0), (20, 0.002, 0), (40, -0.002, 0), (30, 30, 9), (30, -30, 9)]
    faces = [[0, 1, 2], [1, 0, 3], [0, 2, 4], [2, 1, 4], [3, 0, 5], [1, 3, 5]]
    with pytest.raises(MeshError, match="would leave gaps"):
        repair(mesh_of(vertices, faces), TINY)


def test_a_double_layer_is_not_mistaken_for_a_repeated_face():
    pillow = mesh_of([(0, 0, 0), (60, 0, 0), (30, 40, 0)], [[0, 1, 2], [2, 1, 0]])
    assert len(repair(pillow, TINY).faces) == 2


def test_a_repeated_face_of_opposite_winding_inside_a_surface_goes():
    vertices, faces = sheet()
    table = edge_table(faces)
    inner = faces[(table.count[table.of_face] == 2).all(axis=1)][0]
    fixed = oriented_surface(repair(mesh_of(vertices, np.vstack([faces, inner[::-1]])), TINY))
    assert len(fixed.faces) == len(faces)


def test_two_equal_pieces_are_no_debris():
    vertices, faces = sheet(1, 1)
    both = mesh_of(np.vstack([vertices, vertices + 100.0]), np.vstack([faces, faces + len(vertices)]))
    with pytest.raises(MeshError, match="2 separate pieces"):
        oriented_surface(repair(both, TINY))
