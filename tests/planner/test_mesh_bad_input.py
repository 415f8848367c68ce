"""Every bad or awkward input is refused with a cure, repaired with a notice, or accepted."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

from planner.errors import MeshError
from planner.goal_mesh import GoalMesh
from planner.mesh_check import require_foldable
from planner.mesh_edges import edge_table
from planner.raw_mesh import RawMesh, TriangleMesh
from planner.read_goal import read_goal

EXPECTED_CASES = 66

# What a message must say, besides the file's name: the place or the kind of the fault.
SAYS = {
    "truncated_ascii.stl": "ends after 9 facets",
    "wrong_count.stl": "2147483647 facets",
    "html_error_page.obj": "not an OBJ file",
    "index_out_of_range.obj": "face 81 (line 123) refers to vertex 93 of 42",
    "nonmanifold_edge.obj": "more than two faces, the first at face 1 (line 6)",
    "nonmanifold_vertex.obj": "without a common edge",
    "self_intersecting_spike.obj": "passes through",
    "self_intersecting_tube.obj": "passes through",
    "nan_vertex.obj": "face 7 (line 49)",
    "inf_vertex.obj": "face 7 (line 49)",
    "not_a_number.obj": "line 1: expected three numbers",
    "comma_decimals.obj": "decimal points",
    "two_components.obj": "2 separate pieces",
    "nested_shells.obj": "2 separate pieces",
    "metres.obj": "60 mm in metres",
    "inches.obj": "60 mm in inches",
    "huge_coords.obj": "--size",
    "far_from_origin.stl": "single-precision",
    "degree2_pillow.obj": "hem",
    "folded_flat_180.obj": "hem",
    "moebius.obj": "one-sided",
    "klein_bottle.obj": "one-sided",
    "projective_plane6.obj": "one-sided",
    "is_a_directory.obj": "folder",
    "no_extension": "no extension",
}


def assert_sound(goal: GoalMesh) -> None:
    """The goal is what its class promises, checked without the code that made it so."""
    edges = {}
    for a, b, c in goal.faces.tolist():
        assert len({a, b, c}) == 3
        for edge in ((a, b), (b, c), (c, a)):
            assert edge not in edges, "windings agree and no edge has three faces"
            edges[edge] = True
    assert set(goal.faces.ravel().tolist()) == set(range(len(goal.vertices)))
    assert np.isfinite(goal.vertices).all()
    if all((b, a) in edges for a, b in edges):
        a, b, c = (goal.vertices[goal.faces[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a - goal.vertices[0], np.cross(b - a, c - a)) > 0.0


def test_every_listed_case(shared_meshes, tmp_path):
    cases = json.loads((shared_meshes / "bad" / "expected.json").read_text(encoding="utf-8"))["cases"]
    assert len(cases) == EXPECTED_CASES
    wrong = []
    for case in cases:
        path = shared_meshes / case["file"]
        if "as" in case:
            path = tmp_path / case["as"]
            shutil.copy(shared_meshes / case["file"], path)
        try:
            goal = read_goal(path)
        except MeshError as error:
            text = str(error)
            if case["expect"] == "accept":
                wrong.append(text)
            if not text.startswith(f"{path}: ") or "; " not in text or "\n" in text:
                wrong.append(f"not file, fault and cure: {text}")
            if SAYS.get(path.name, "") not in text:
                wrong.append(f"does not say {SAYS[path.name]!r}: {text}")
        else:
            assert_sound(goal)
            assert goal.name == path.stem
            if case["expect"] == "reject":
                wrong.append(f"{case['file']} was accepted")
            if case["expect"] == "repair_or_reject" and not goal.notices:
                wrong.append(f"{case['file']} was accepted without a notice")
    assert wrong == []


@pytest.mark.parametrize(
    ("name", "faces"),
    [
        ("duplicate_vertices_soup.obj", 80),
        ("near_duplicate_vertices.stl", 80),
        ("inconsistent_winding.obj", 80),
        ("inverted.obj", 80),
        ("duplicate_faces.obj", 80),
        ("debris_component.obj", 80),
        ("unused_vertices.obj", 80),
        ("repeated_index_face.obj", 80),
        ("binary_starting_with_solid.stl", 80),
        ("ascii_good.STL", 80),
        ("negative_indices.obj", 80),
        ("missing_mtl.obj", 80),
        ("far_from_origin.obj", 80),
    ],
)
def test_repairs_of_one_shape_all_give_that_shape(shared_meshes, name, faces):
    whole = read_goal(shared_meshes / "bad" / "missing_mtl.obj")
    goal = read_goal(shared_meshes / "bad" / name)
    assert len(goal.faces) == faces
    assert len(goal.vertices) == 42

    def sides(mesh: GoalMesh) -> np.ndarray:
        ends = mesh.vertices[edge_table(mesh.faces).edges]
        return np.sort(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    assert np.allclose(sides(goal), sides(whole), atol=2e-3 if name.endswith(("stl", "STL")) else 2e-5)


def test_size_makes_sense_of_other_units(shared_meshes):
    for name, scale in (("metres.obj", 1000.0), ("inches.obj", 25.4)):
        by_size = read_goal(shared_meshes / "bad" / name, size_mm=60.0)
        assert by_size.longest_side_mm == pytest.approx(60.0, abs=1e-9)
        by_scale = read_goal(shared_meshes / "bad" / name, scale=scale)
        assert by_scale.longest_side_mm == pytest.approx(60.0, abs=0.01)
        assert "scaled by" in by_size.notices[-1]


def test_what_is_all_kerf_is_refused_even_if_the_size_is_meant(shared_meshes):
    with pytest.raises(MeshError, match="kerf"):
        read_goal(shared_meshes / "bad" / "tiny_faces.obj", scale=1.0)


@pytest.mark.parametrize(
    "arguments",
    [
        {"size_mm": 0.0},
        {"size_mm": float("nan")},
        {"scale": -1.0},
        {"scale": float("inf")},
        {"size_mm": 60.0, "scale": 2.0},
        {"size_mm": 1e6},
        {"max_faces": 0},
        {"max_faces": 3},
    ],
)
def test_senseless_sizes_and_budgets_are_refused(shared_meshes, arguments):
    with pytest.raises(MeshError, match="; "):
        read_goal(shared_meshes / "bad" / "quads.obj", **arguments)


def test_a_missing_file_and_an_unreadable_one(tmp_path):
    with pytest.raises(MeshError, match="no such file"):
        read_goal(tmp_path / "none.obj")
    with pytest.raises(MeshError, match=r"unknown kind of file '\.step'"):
        (tmp_path / "a.step").write_text("x")
        read_goal(tmp_path / "a.step")


def test_a_huge_file_is_refused_before_anything_is_built(shared_meshes, tmp_path):
    """100,000 faces take the path of a million: counted, refused, and with a budget reduced."""
    path = tmp_path / "huge.stl"
    maker = shared_meshes / "bad" / "make_huge.py"
    subprocess.run([sys.executable, str(maker), str(path), "100000"], check=True, capture_output=True)
    with pytest.raises(MeshError, match=r"99856 faces .* --faces"):
        read_goal(path)
    goal = read_goal(path, max_faces=150)
    assert_sound(goal)
    assert 100 <= len(goal.faces) <= 150
    assert "coarsened from 99856" in " ".join(goal.notices)


def test_every_prefix_of_good_files_is_refused_or_sound(shared_meshes, tmp_path):
    """Truncation anywhere ends in a MeshError or in a sound mesh, never in another error."""
    for name in ("quads.obj", "degree2_ngon.obj"):
        text = (shared_meshes / "bad" / name).read_bytes()
        for end in range(0, len(text), 3):
            path = tmp_path / "part.obj"
            path.write_bytes(text[:end])
            try:
                assert_sound(read_goal(path))
            except MeshError as error:
                assert str(error).startswith(str(path))


def test_a_thin_face_is_refused_where_nothing_repaired_it():
    vertices = np.array([[0, 0, 0], [60, 0, 0], [30, 1e-3, 0.0]])
    raw = RawMesh("thin.obj", vertices, np.arange(3), np.array([3]), np.array([4]))
    mesh = TriangleMesh(vertices, np.array([[0, 1, 2]]), np.array([0]), raw)
    with pytest.raises(
        MeshError, match=r"thin.obj: 1 face less than a tenth of the kerf .* face 1 \(line 4\)"
    ):
        require_foldable(mesh, 0.1)
