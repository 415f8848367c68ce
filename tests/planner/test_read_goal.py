"""Good meshes stay as they are, their rewritings mean the same, and the figures match the common list's."""

from __future__ import annotations

import hashlib
import json

import numpy as np
import pytest

from planner.errors import MeshError
from planner.fold_plan import MachineLimits
from planner.mesh_facts import describe_mesh
from planner.read_goal import read_goal

COARSE = "surface moved by up to"


def plain_obj(path):
    """Vertices and faces of a triangle OBJ file, read in the plainest way."""
    vertices, faces = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ["f"]:
            faces.append([int(w.split("/")[0]) - 1 for w in words[1:]])
    return np.array(vertices), np.array(faces)


def test_every_good_mesh_is_accepted_unchanged_and_described_as_listed(shared_meshes):
    listed = {m["file"]: m for m in json.loads((shared_meshes / "manifest.json").read_text())["meshes"]}
    paths = sorted([*shared_meshes.glob("real/*.obj"), *shared_meshes.glob("proc/*.obj")])
    assert len(paths) > 100
    for path in paths:
        goal = read_goal(path)
        vertices, faces = plain_obj(path)
        assert np.array_equal(goal.vertices, vertices), path.name
        assert np.array_equal(goal.faces, faces), path.name
        assert all("smaller than the kerf" in n for n in goal.notices), path.name
        assert goal.source_sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
        facts, truth = describe_mesh(goal), listed[f"{path.parent.name}/{path.name}"]
        assert facts["closed"] == truth["watertight"], path.name
        for key in ("faces", "vertices", "edges", "genus", "boundary_loops", "boundary_edges"):
            assert facts[key] == truth[key], (path.name, key)
        for key in ("area_mm2", "min_edge_mm", "max_edge_mm", "min_height_mm", "volume_mm3"):
            if truth[key] is None:
                assert facts[key] is None
            else:
                assert facts[key] == pytest.approx(truth[key], rel=1e-3, abs=2e-3), (path.name, key)
        fold = max(abs(truth["fold_min_deg"] or 0.0), abs(truth["fold_max_deg"] or 0.0))
        assert facts["steepest_fold_deg"] == pytest.approx(fold, abs=0.01), path.name
        counted = (
            facts["convex_edges"] + facts["reflex_edges"] + facts["flat_edges"] + facts["boundary_edges"]
        )
        assert counted == facts["edges"]
        json.dumps(facts, allow_nan=False)


def test_convex_edges_are_those_of_convex_bodies(shared_meshes):
    for name in ("tetrahedron", "randhull36", "dodecahedron", "icosphere80"):
        facts = describe_mesh(read_goal(shared_meshes / "proc" / f"{name}.obj"))
        assert facts["reflex_edges"] == 0
        assert facts["convex_edges"] > 0


def sides_by_face(goal) -> np.ndarray:
    """(F, 3) side lengths of every face from its shortest on, in winding order, sorted as rows."""
    corners = goal.vertices[goal.faces]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).round(4)
    first = sides.argmin(axis=1)
    rolled = sides[np.arange(len(sides))[:, None], (first[:, None] + np.arange(3)) % 3]
    return rolled[np.lexsort(rolled.T)]


@pytest.mark.parametrize(
    ("name", "factor", "tolerance"),
    [
        ("bunny-128-ascii.stl", 1.0, 1e-3),
        ("bunny-128-binary.stl", 1.0, 1e-3),
        ("bunny-128-rotated.obj", 1.0, 1e-3),
        ("bunny-128-shuffled.obj", 1.0, 1e-3),
        ("bunny-128-twice.obj", 2.0, 1e-3),
        ("bunny-128.ply", 1.0, 1e-3),
    ],
)
def test_rewritings_of_one_mesh_give_that_mesh(shared_meshes, name, factor, tolerance):
    original = read_goal(shared_meshes / "real" / "bunny-128.obj")
    goal = read_goal(shared_meshes / "variants" / name)
    assert goal.notices == ()
    assert len(goal.vertices) == len(original.vertices)
    assert np.allclose(sides_by_face(goal), factor * sides_by_face(original), atol=tolerance)
    assert describe_mesh(goal)["volume_mm3"] == pytest.approx(
        factor**3 * describe_mesh(original)["volume_mm3"], rel=1e-5
    )


def test_a_mirrored_mesh_stays_mirrored(shared_meshes):
    original = read_goal(shared_meshes / "real" / "bunny-128.obj")
    mirrored = read_goal(shared_meshes / "variants" / "bunny-128-mirrored.obj")
    assert mirrored.notices == ()
    assert not np.allclose(sides_by_face(mirrored), sides_by_face(original), atol=1e-3)
    assert describe_mesh(mirrored)["volume_mm3"] == pytest.approx(
        describe_mesh(original)["volume_mm3"], rel=1e-5
    )


@pytest.mark.parametrize(
    ("name", "budget"),
    [
        ("real/bunny-5000", 150), ("real/fish_t-950", 300), ("real/gear-508", 200), ("proc/halfsphere", 40),
        ("proc/icosphere5120", 100), ("real/snail-574", 100), ("proc/bugbot6", 20), ("bad/torus_genus1", 60),
        ("bad/sphere_many_handles", 150),
    ],
)  # fmt: skip
def test_coarsening_keeps_topology_and_size_and_is_repeatable(shared_meshes, name, budget):
    path = shared_meshes / f"{name}.obj"
    fine = describe_mesh(read_goal(path))
    goal = read_goal(path, max_faces=budget, size_mm=60.0)
    coarse = describe_mesh(goal)
    assert 4 <= coarse["faces"] <= budget
    for key in ("genus", "boundary_loops", "closed"):
        assert coarse[key] == fine[key]
    assert coarse["longest_side_mm"] == pytest.approx(60.0, abs=1e-9)
    assert sum(COARSE in n for n in goal.notices) == 1
    again = read_goal(path, max_faces=budget, size_mm=60.0)
    assert again.sha256 == goal.sha256
    assert again.notices == goal.notices


def test_coarsening_keeps_flat_regions_flat(tmp_path):
    """A finely meshed box comes down to its twelve triangles without moving."""
    import trimesh

    box = trimesh.creation.box((60, 40, 20))
    for _ in range(3):
        box = box.subdivide()
    path = tmp_path / "box.obj"
    path.write_text(trimesh.exchange.obj.export_obj(box, include_normals=False, digits=9))
    facts = describe_mesh(read_goal(path, max_faces=12))
    assert facts["faces"] == 12
    assert facts["volume_mm3"] == pytest.approx(60 * 40 * 20, rel=1e-4)
    assert facts["area_mm2"] == pytest.approx(2 * (60 * 40 + 60 * 20 + 40 * 20), rel=1e-4)


def test_a_budget_that_is_large_enough_changes_nothing(shared_meshes):
    path = shared_meshes / "real" / "bunny-128.obj"
    assert read_goal(path, max_faces=128).sha256 == read_goal(path).sha256


def test_an_unreachable_budget_says_how_far_it_got(shared_meshes):
    with pytest.raises(MeshError, match=r"cannot be reduced|no way to coarsen") as caught:
        read_goal(shared_meshes / "bad" / "sphere_many_handles.obj", max_faces=10)
    assert "--faces" in str(caught.value)


def test_a_part_larger_than_the_sheet_is_refused_and_a_larger_rig_takes_it(shared_meshes):
    path = shared_meshes / "real" / "bunny-128.obj"
    with pytest.raises(MeshError, match="of surface") as caught:
        read_goal(path, size_mm=250.0)
    assert "--size" in str(caught.value)
    large = MachineLimits(work_area=(2000.0, 2000.0))
    assert read_goal(path, size_mm=250.0, limits=large).longest_side_mm == pytest.approx(250.0)


def test_slits_of_an_indexed_mesh_stay_open_and_those_of_a_soup_close(tmp_path):
    """Coinciding edges that an OBJ keeps apart are meant; an STL cannot say so."""
    import trimesh

    vertices = np.array(
        [[0, 0, 0], [60, 0, 0], [30, 20, 0], [0, 40, 0], [60, 40, 5], [60, 40, 5.0], [30, 20, 0]]
    )
    joined = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2], [3, 2, 4]])
    slit = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2], [3, 2, 5]])
    path = tmp_path / "slit.obj"
    path.write_text(
        "".join(f"v {x} {y} {z}\n" for x, y, z in vertices[:6])
        + "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in slit)
    )
    opened = read_goal(path)
    assert describe_mesh(opened)["boundary_edges"] == 6
    assert opened.notices[0].startswith("kept open slits: 1 vertex")
    soup = tmp_path / "slit.stl"
    soup.write_bytes(trimesh.Trimesh(vertices, slit, process=False).export(file_type="stl"))
    goal = read_goal(soup)
    assert describe_mesh(goal)["boundary_edges"] == 4
    assert len(goal.vertices) == len(np.unique(vertices[joined].reshape(-1, 3), axis=0))
