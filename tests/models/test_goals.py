"""The shipped goal shapes: made by the script, well formed, and named."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from models.goals import goal_names, goal_path
from models.goals.folded_panels import PanelModel
from models.goals.make_goals import LONGEST_SIDE_MM, SHAPES, goal_text, make_goals

CLOSED = {"creature_coarse", "creature_fine"}
EULER = {"crown": 0} | dict.fromkeys(CLOSED, 2)  # all others are discs
TREES = ("antenna", "bracket", "bug_robot", "drone_frame", "flower")


def load(name: str) -> trimesh.Trimesh:
    return trimesh.load(goal_path(name), process=False)


def test_the_folder_holds_what_the_script_makes(tmp_path):
    made = make_goals(tmp_path)
    assert [path.stem for path in made] == sorted(SHAPES) == list(goal_names())
    for path in made:
        assert path.read_bytes() == goal_path(path.stem).read_bytes(), path.stem


@pytest.mark.parametrize("name", SHAPES)
def test_shape_is_one_oriented_manifold_piece_of_the_stated_size(name):
    mesh = load(name)
    assert mesh.is_winding_consistent
    assert mesh.is_watertight == (name in CLOSED)
    assert mesh.euler_number == EULER.get(name, 1)
    assert len(mesh.split(only_watertight=False)) == 1
    assert max(Counter(map(tuple, np.sort(mesh.edges, axis=1))).values()) <= 2
    assert set(mesh.faces.ravel()) == set(range(len(mesh.vertices)))
    assert len(np.unique(np.round(mesh.vertices, 4), axis=0)) == len(mesh.vertices)
    assert mesh.extents.max() == pytest.approx(LONGEST_SIDE_MM, abs=2e-6)
    assert mesh.bounds[0][2] == 0.0
    if name in CLOSED:
        assert mesh.volume > 0


@pytest.mark.parametrize("name", SHAPES)
def test_triangles_are_well_shaped(name):
    mesh = load(name)
    assert np.degrees(mesh.face_angles).min() > 5.0
    assert mesh.edges_unique_length.min() > 1.5
    heights = 2 * mesh.area_faces / mesh.edges_unique_length[mesh.faces_unique_edges].max(axis=1)
    assert heights.min() > 1.0


@pytest.mark.parametrize("name", SHAPES)
def test_no_face_crosses_another(name):
    fcl = pytest.importorskip("fcl")
    mesh = load(name)
    # Each face is shrunk by a millionth about its centre, so that neighbours do not count as touching.
    triangles = mesh.triangles
    centre = triangles.mean(axis=1, keepdims=True)
    triangles = centre + (triangles - centre) * (1 - 1e-6)
    objects = []
    for triangle in triangles:
        model = fcl.BVHModel()
        model.beginModel(3, 1)
        model.addSubModel(triangle, np.array([[0, 1, 2]]))
        model.endModel()
        objects.append(fcl.CollisionObject(model))
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    crossing = []
    for i in range(len(objects)):
        near = np.flatnonzero(((low[i] <= high) & (low <= high[i])).all(axis=1))
        crossing += [(i, int(j)) for j in near[near > i] if fcl.collide(objects[i], objects[j]) > 0]
    assert crossing == []


@pytest.mark.parametrize("name", TREES)
def test_tree_shapes_have_one_flat_pattern(name):
    mesh = load(name)
    joined = Counter(map(tuple, np.sort(mesh.edges, axis=1)))
    assert sum(count == 2 for count in joined.values()) == len(mesh.faces) - 1


def test_an_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(LookupError, match=r"'bugrobot'.*choose bug_robot"):
        goal_path("bugrobot")
    with pytest.raises(LookupError, match="antenna, box_with_lid, bracket"):
        goal_path("zzz")


def test_text_has_no_negative_zero_and_no_exponent():
    for name in SHAPES:
        for line in goal_text(name).splitlines()[1:]:
            assert "e" not in line
            assert "-0" not in [
                word for word in line.split() if float(word if word[0] not in "vf" else 0) == 0
            ]


angles = st.floats(-170.0, 170.0)


@given(first=angles, second=angles, turned=angles)
def test_folding_panels_keeps_every_panel_rigid(first, second, turned):
    model = PanelModel([(0, 0), (9, 0), (9, 5), (0, 5)])
    arm = model.attach(0, 1, [(1, 4), (4, 4)], first)
    model.attach(arm, 2, [(1.5, 6)], second)
    flat = PanelModel([(0, 0), (9, 0), (9, 5), (0, 5)])
    flat.attach(flat.attach(0, 1, [(1, 4), (4, 4)], 0.0), 2, [(1.5, 6)], 0.0)
    (folded, faces), (lain, flat_faces) = model.mesh(turned_deg=turned), flat.mesh()
    assert (faces == flat_faces).all()
    for k in range(3):
        a, b = faces[:, k], faces[:, (k + 1) % 3]
        assert np.linalg.norm(folded[a] - folded[b], axis=1) == pytest.approx(
            np.linalg.norm(lain[a] - lain[b], axis=1), abs=1e-9
        )
    assert (
        np.cross(lain[faces[:, 1]] - lain[faces[:, 0]], lain[faces[:, 2]] - lain[faces[:, 0]])[:, 2] > 0
    ).all()


@given(angle=st.floats(1.0, 170.0), sign=st.sampled_from([-1.0, 1.0]))
def test_a_positive_angle_folds_towards_the_outer_side(angle, sign):
    model = PanelModel([(0, 0), (9, 0), (9, 5), (0, 5)])
    model.attach(0, 1, [(0, 4), (5, 4)], sign * angle)
    vertices, _ = model.mesh()
    assert np.sign(vertices[4:, 2]).tolist() == [sign, sign]
    assert vertices[4:, 2] == pytest.approx(sign * 4 * np.sin(np.radians(angle)))


@given(st.lists(st.floats(0.5, 5.0), min_size=3, max_size=12))
def test_any_star_shaped_outline_is_cut_into_triangles_of_the_same_area(radii):
    angle = np.arange(len(radii)) * 2 * np.pi / len(radii)
    outline = np.column_stack([radii * np.cos(angle), radii * np.sin(angle)])
    vertices, faces = PanelModel([tuple(p) for p in outline]).mesh()
    u, v = vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]]
    areas = np.cross(u, v)[:, 2] / 2
    closed = np.vstack([outline, outline[:1]])
    whole = sum(a[0] * b[1] - a[1] * b[0] for a, b in pairwise(closed)) / 2
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(whole)
    assert len(faces) == len(radii) - 2
