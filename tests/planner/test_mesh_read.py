"""All formats give the same mesh, and damaged files of every format end in a MeshError."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from planner.errors import MeshError
from planner.mesh_read import MESH_SUFFIXES, read_mesh
from planner.read_goal import read_goal

CORNERS = np.array([[0, 0, 0], [60, 0, 0], [0, 40, 0], [0, 0, 20]], dtype=float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def as_text(suffix: str) -> str:
    """The tetrahedron as a text file, written without a library."""
    points = [f"{x:g} {y:g} {z:g}" for x, y, z in CORNERS]
    if suffix == ".obj":
        return "".join(f"v {p}\n" for p in points) + "".join(
            f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES
        )
    if suffix == ".off":
        return "OFF\n4 4 6\n" + "\n".join([*points, *(f"3 {a} {b} {c}" for a, b, c in FACES)]) + "\n"
    if suffix == ".ply":
        head = (
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        )
        head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
        return head + "\n".join([*points, *(f"3 {a} {b} {c}" for a, b, c in FACES)]) + "\n"
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"vertex {points[k]}\n" for k in face)
        + "endloop\nendfacet\n"
        for face in FACES
    ]
    return "solid a name\n" + "".join(facets) + "endsolid a name\n"


def as_bytes(suffix: str) -> bytes:
    """The tetrahedron as written by trimesh in a binary format."""
    import trimesh

    mesh = trimesh.Trimesh(CORNERS if suffix != ".glb" else CORNERS / 1000.0, FACES, process=False)
    return mesh.export(file_type=suffix[1:])


ALL = {
    **{f"text{s}": (as_text, s) for s in (".obj", ".off", ".ply", ".stl")},
    **{f"binary{s}": (as_bytes, s) for s in (".stl", ".ply", ".glb")},
}


def content(kind: str) -> tuple[bytes, str]:
    maker, suffix = ALL[kind]
    made = maker(suffix)
    return made.encode() if isinstance(made, str) else made, suffix


@pytest.mark.parametrize("kind", ALL)
def test_every_format_gives_the_same_faces_in_the_same_order(tmp_path, kind):
    data, suffix = content(kind)
    path = tmp_path / f"tetrahedron{suffix.upper()}"
    path.write_bytes(data)
    goal = read_goal(path)
    assert np.allclose(goal.vertices[goal.faces], CORNERS[FACES], atol=1e-5)
    assert len(goal.vertices) == 4
    if suffix in (".obj", ".off", ".ply"):
        assert np.array_equal(goal.faces, FACES)
    assert all("metres" in n for n in goal.notices)
    assert bool(goal.notices) == (suffix == ".glb")


def test_gltf_with_its_buffer_beside_it_and_without(tmp_path):
    import trimesh

    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(1.0, [1, 2, 3], [4, 5, 6])
    scene.add_geometry(trimesh.Trimesh(CORNERS, FACES, process=False), transform=turn)
    for name, part in trimesh.exchange.gltf.export_gltf(scene).items():
        (tmp_path / name).write_bytes(part)
    goal = read_goal(tmp_path / "model.gltf", scale=1.0)
    assert np.allclose(goal.vertices[goal.faces], trimesh.transform_points(CORNERS, turn)[FACES], atol=1e-4)
    text = (tmp_path / "model.gltf").read_text()
    count = json.loads(text)["accessors"][0]["count"]
    (tmp_path / "lying.gltf").write_text(text.replace(f'"count":{count}', '"count":9999999999'))
    with pytest.raises(MeshError, match="announces 9999999999"):
        read_goal(tmp_path / "lying.gltf")
    for buffer in tmp_path.glob("*.bin"):
        buffer.unlink()
    with pytest.raises(MeshError, match="cannot be read as glTF"):
        read_goal(tmp_path / "model.gltf")


@pytest.mark.parametrize("kind", ALL)
def test_cut_off_anywhere_it_is_refused(tmp_path, kind):
    """A prefix that ends before the last face is never taken for the whole mesh."""
    data, suffix = content(kind)
    path = tmp_path / f"part{suffix}"
    for end in range(0, len(data), max(1, len(data) // 150)):
        path.write_bytes(data[:end])
        try:
            raw, _ = read_mesh(path)
        except MeshError as error:
            assert str(error).startswith(f"{path}: ")
            continue
        # text formats without a face count cannot tell that lines are missing; a cut number or face they can
        assert suffix == ".obj" or len(raw.sizes) == 4


@pytest.mark.parametrize("kind", ALL)
@given(changes=st.lists(st.tuples(st.integers(0, 2000), st.integers(0, 255)), min_size=1, max_size=8))
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_changed_bytes_end_in_a_mesh_or_a_mesh_error(tmp_path, kind, changes):
    data, suffix = content(kind)
    damaged = bytearray(data)
    for at, value in changes:
        damaged[at % len(damaged)] = value
    path = tmp_path / f"damaged{suffix}"
    path.write_bytes(damaged)
    try:
        goal = read_goal(path)
    except MeshError as error:
        assert str(error).startswith(f"{path}: ")
    else:
        assert np.isfinite(goal.vertices).all()


@given(data=st.binary(max_size=300), suffix=st.sampled_from(MESH_SUFFIXES))
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_end_in_a_mesh_error(tmp_path, data, suffix):
    path = tmp_path / f"any{suffix}"
    path.write_bytes(data)
    with pytest.raises(MeshError, match="any"):
        read_goal(path)


@pytest.mark.parametrize(
    ("suffix", "text", "says"),
    [
        (".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 0\n", "line 4: vertex number 0 does not exist"),
        (".obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "line 4: vertex number -4 does not exist"),
        (".obj", "v 0 0\nf 1 1 1\n", "line 1: a vertex has three coordinates"),
        (".obj", "v 0 0 0\nf 1 a 1\n", "line 2: expected a vertex number"),
        (".off", "OFF\n3 1 0\n0 0 0\n60 0 0\n0 40 0\n3 0 1 3\n", "face 1 (line 6) refers to vertex 3 of 3"),
        (".off", "OFF\n9999999 1 0\n", "announces 9999999"),
        (".off", "OFF\n3 1 0\n0 0 0\n60 0\n", "line 4: expected three coordinates"),
        (".ply", "ply\nformat ascii 1.0\nelement vertex 1000000000000\n" + "end_header\n", "line 3"),
        (".ply", "ply\nformat utf8 1.0\nend_header\n", "line 2"),
        (".ply", "ply\nelement vertex 0\nend_header\n", "no line 'format'"),
        (
            ".ply",
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int x\nend_header\n",
            "repeats a property",
        ),
        (".stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0\n", "line 4: expected three numbers"),
        (".stl", "solid x\nvertex 0 0 0\n", "line 2: expected 'facet'"),
        (".stl", "solid x\nendsolid\nmore\n", "line 3: expected 'solid'"),
    ],
)
def test_messages_name_the_line_and_what_was_expected(tmp_path, suffix, text, says):
    path = tmp_path / f"wrong{suffix}"
    path.write_text(text)
    with pytest.raises(MeshError) as caught:
        read_goal(path)
    assert says in str(caught.value)


def test_ply_with_other_elements_lists_of_mixed_length_and_big_endian(tmp_path):
    header = (
        "ply\nformat binary_big_endian 1.0\ncomment x\nelement vertex 5\nproperty double x\n"
        "property double y\nproperty double z\nproperty uchar red\nelement face 2\nproperty uchar flags\n"
        "property list uchar uint vertex_index\nelement edge 1\nproperty int a\nend_header\n"
    )
    vertex = np.zeros(5, dtype=[("p", ">f8", 3), ("red", "u1")])
    vertex["p"] = [[0, 0, 0], [60, 0, 0], [60, 40, 0], [0, 40, 0], [30, 60, 9]]
    rows = (
        b"\x07\x04"
        + np.array([0, 1, 2, 3], ">u4").tobytes()
        + b"\x07\x03"
        + np.array([3, 2, 4], ">u4").tobytes()
    )
    path = tmp_path / "mixed.ply"
    path.write_bytes(header.encode() + vertex.tobytes() + rows + b"\0\0\0\1")
    raw, _ = read_mesh(path)
    assert raw.sizes.tolist() == [4, 3]
    assert raw.corners.tolist() == [0, 1, 2, 3, 3, 2, 4]
    assert np.array_equal(raw.vertices, vertex["p"])
    assert len(read_goal(path).faces) == 3


def test_obj_corner_forms_continued_lines_and_unknown_words(tmp_path):
    path = tmp_path / "forms.obj"
    path.write_text(
        "\ufeff# comment\nmtllib none.mtl\no part\nv 0 0 0 1.0\nv 60 0 0 0.5 0.5 0.5\nv 60 40 0\nv 0 40 0\n"
        "vt 0 0\nvn 0 0 1\nusemtl x\nfrobnicate 7\nf 1/1/1 2//1 \\\n 3/1\nf -4 -2 -1 # back\n"
    )
    goal = read_goal(path)
    assert goal.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert goal.notices == ("passed over unknown keyword 'frobnicate' (line 11)",)
