"""FOLD files: the same net comes back, the same bytes go out, and what does not belong is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import weighted_tree
from planner.dual_graph import DualGraph
from planner.errors import FormatError
from planner.flat_layout import FlatLayout
from planner.fold_file import read_fold, write_fold
from planner.goal_mesh import GoalMesh
from planner.net import Net, NetCertificate
from tests.planner.goal_shapes import block_with_hole, bodies, plate
from tests.planner.hand_nets import box_goal, cross_net


def random_net(goal: GoalMesh, seed: int) -> Net:
    graph = DualGraph(goal)
    rng = np.random.default_rng(seed)
    tree = weighted_tree(graph, rng.random(len(graph.faces)))
    layout = FlatLayout(graph, tree, int(rng.integers(len(goal.faces))))
    return layout.to_net(NetCertificate(7, 3, 1, False, method="nb", tree="bfs"))


def same(one: Net, two: Net) -> bool:
    return (
        one.sha256 == two.sha256
        and np.array_equal(one.crease_of, two.crease_of)
        and (one.certificate == two.certificate)
    )


@settings(max_examples=20)
@given(bodies, st.integers(0, 1000))
def test_round_trip_is_exact(tmp_path_factory: pytest.TempPathFactory, goal: GoalMesh, seed: int) -> None:
    path = tmp_path_factory.mktemp("fold") / "net.fold"
    net = random_net(goal, seed)
    write_fold(net, path)
    first = path.read_bytes()
    back = read_fold(path, goal)
    assert same(net, back)
    write_fold(back, path)
    assert path.read_bytes() == first


@pytest.mark.parametrize("goal", [box_goal(), plate(), block_with_hole()], ids=lambda goal: goal.name)
def test_flat_joints_and_boundaries_come_back(tmp_path: Path, goal: GoalMesh) -> None:
    net = random_net(goal, 4)
    turn = np.array([[0.28, -0.96], [0.96, 0.28]])
    placed = replace(net, vertices=net.vertices @ turn.T + [12.3, -4.56])
    write_fold(placed, tmp_path / "net.fold")
    assert same(placed, read_fold(tmp_path / "net.fold", goal))


def test_what_the_file_says(tmp_path: Path) -> None:
    net = cross_net()
    write_fold(net, tmp_path / "net.fold")
    data = json.loads((tmp_path / "net.fold").read_text(encoding="utf-8"))
    assert data["file_spec"] == 1.2
    assert data["file_classes"] == ["singleModel"]
    assert data["frame_classes"] == ["creasePattern"]
    assert np.array_equal(data["vertices_coords"], net.vertices)
    assert data["faces_vertices"] == net.faces.tolist()
    assert data["blossom:faces_goal"] == list(range(12))
    assert data["blossom:base_face"] == net.base_face
    assert set(data["blossom:certificate"]) >= {
        "blooming_overlaps", "edits", "lower_bound", "optimal", "faces_left_out",
    }  # fmt: skip
    letters = data["edges_assignment"]
    assert letters.count("V") == 0
    assert letters.count("M") + letters.count("F") == 11
    for letter, angle in zip(letters, data["edges_foldAngle"], strict=True):
        assert angle == (pytest.approx(-90.0) if letter == "M" else 0.0)


def written(tmp_path: Path, net: Net, **changes: object) -> Path:
    path = tmp_path / "net.fold"
    write_fold(net, path)
    data = json.loads(path.read_text(encoding="utf-8"))
    for key, value in changes.items():
        key = key.replace("__", ":")
        if value is None:
            del data[key]
        else:
            data[key] = value
    path.write_text(json.dumps(data), encoding="utf-8")
    return path


NET = random_net(box_goal(), 1)
CREASE = int(np.flatnonzero(NET.assignment == "M")[0])
CUT = int(np.flatnonzero(NET.assignment == "B")[0])


def changed(values: np.ndarray, at: object, value: object) -> list[object]:
    copy = values.tolist()
    if isinstance(at, tuple):
        copy[at[0]][at[1]] = value
    else:
        copy[at] = value
    return copy


DEGREES = np.degrees(NET.fold_angle)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vertices_coords": None}, "vertices_coords: is missing"),
        ({"vertices_coords": changed(NET.vertices, (0, 0), 1e3)}, "faces_vertices: face .* differs"),
        ({"vertices_coords": (NET.vertices * [-1.0, 1.0]).tolist()}, "not counter-clockwise"),
        ({"vertices_coords": changed(NET.vertices, (0, 1), float("nan"))}, "item 0 is not a finite number"),
        ({"vertices_coords": "text"}, "vertices_coords: expected rows of 2 numbers"),
        ({"faces_vertices": changed(NET.faces, (2, 1), 400)}, "item 2 names a vertex outside"),
        ({"faces_vertices": changed(NET.faces, (2, 1), -1)}, "item 2 names a vertex outside"),
        ({"faces_vertices": NET.faces[:-1].tolist()}, "expected the 12 faces of box"),
        ({"faces_vertices": changed(NET.faces, 3, [0, 1])}, "faces_vertices: expected rows of 3 numbers"),
        ({"edges_vertices": changed(NET.edges, (1, 0), 1.5)}, "edges_vertices: expected whole numbers"),
        ({"edges_assignment": changed(NET.assignment, 3, "U")}, "expected one of V, M, F, B"),
        ({"edges_assignment": changed(NET.assignment, CREASE, "B")}, f"edge {CREASE} is B but has 2 faces"),
        ({"edges_assignment": changed(NET.assignment, CUT, "M")}, f"edge {CUT} is M but has 1 faces"),
        ({"edges_assignment": changed(NET.assignment, CREASE, "V")}, f"edge {CREASE} is V but folds by -90"),
        (
            {"edges_foldAngle": changed(DEGREES, CREASE, -80.0)},
            f"edge {CREASE} has -80 degrees, but the goal -90",
        ),
        ({"edges_foldAngle": DEGREES[:-1].tolist()}, "edges_foldAngle: expected .* angles"),
        ({"blossom__base_face": 12}, "blossom:base_face: expected a face from 0 to 11"),
        ({"blossom__base_face": None}, "blossom:base_face"),
        ({"blossom__goal_sha256": "0" * 64}, "made from another goal"),
        ({"blossom__certificate": {"edits": -1}}, "edits is a count"),
        ({"blossom__certificate": []}, "blossom:certificate: expected an object"),
        ({"blossom__faces_goal": [1, 0, *range(2, 12)]}, "blossom:faces_goal"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    path = written(tmp_path, NET, **changes)
    with pytest.raises(FormatError, match=rf"net\.fold: .*{message}|net\.fold: {message}"):
        read_fold(path, NET.goal)


def test_nulls_and_missing_extras_are_read(tmp_path: Path) -> None:
    angles = [None if letter == "B" else angle for letter, angle in zip(NET.assignment, DEGREES, strict=True)]
    path = written(tmp_path, NET, edges_foldAngle=angles, blossom__goal_sha256=None, blossom__faces_goal=None)
    assert same(NET, read_fold(path, NET.goal))


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "3", "\x00\x01"])
def test_files_that_are_no_fold_file(tmp_path: Path, text: str) -> None:
    path = tmp_path / "net.fold"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FormatError, match=r"net\.fold: .*FOLD file"):
        read_fold(path, NET.goal)


def test_a_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_fold(tmp_path / "none.fold", NET.goal)
