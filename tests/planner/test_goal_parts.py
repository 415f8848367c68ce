"""Goals with faces left out: what is left remembers the whole, in memory, in files and in figures."""

from __future__ import annotations

import functools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dual_graph import DualGraph
from planner.errors import FormatError
from planner.fold_file import read_fold, write_fold
from planner.goal_mesh import GoalMesh
from planner.kinematics import folded_triangles, rigid_fit
from planner.lost_folds import foldable_share, left_out_words, lost_fold_rad
from planner.make_net import make_net
from planner.net import Net
from tests.planner.goal_shapes import even_ball
from tests.planner.hand_nets import box_goal

BALL = even_ball(12)


@functools.cache
def ball_net() -> Net:
    return make_net(BALL)


@given(st.sets(st.integers(0, len(BALL.faces) - 1), max_size=len(BALL.faces) - 1))
def test_the_rest_has_the_same_faces_in_the_same_order(left_out: set[int]) -> None:
    rest = BALL.without(left_out)
    assert rest.original is BALL
    assert rest.left_out.tolist() == sorted(left_out)
    assert np.array_equal(rest.faces_goal, [f for f in range(len(BALL.faces)) if f not in left_out])
    assert np.array_equal(rest.vertices[rest.faces], BALL.vertices[BALL.faces[rest.faces_goal]])
    assert np.array_equal(np.unique(rest.faces), np.arange(len(rest.vertices)))


@given(st.lists(st.integers(0, 15), min_size=1, max_size=4))
def test_leaving_out_one_by_one_is_leaving_out_at_once(turns: list[int]) -> None:
    rest, gone = BALL, set[int]()
    for turn in turns:
        gone.add(int(rest.faces_goal[turn]))
        rest = rest.without([turn])
    at_once = BALL.without(gone)
    assert rest.sha256 == at_once.sha256
    assert rest.original is BALL
    assert np.array_equal(rest.faces_goal, at_once.faces_goal)


@pytest.mark.parametrize("wrong", [[-1], [20], range(20)])
def test_what_cannot_be_left_out(wrong) -> None:
    with pytest.raises(ValueError, match="face"):
        BALL.without(wrong)


def test_nothing_left_out_is_the_same_goal() -> None:
    assert BALL.without([]) is BALL
    assert lost_fold_rad(BALL) == 0.0
    assert foldable_share(ball_net()) == 1.0
    assert left_out_words(BALL) == ""


def test_the_certificate_and_the_words_tell() -> None:
    net = make_net(box_goal().without([0, 5]))
    assert net.certificate.faces_left_out == 2
    words = left_out_words(net.goal)
    assert "faces 0, 5 of goal.ply (2 of 12" in words
    assert "not folded" in words


def rest_net() -> tuple[GoalMesh, Net]:
    whole = box_goal()
    return whole, make_net(whole.without([3, 8]))


def test_a_file_with_missing_faces_opens_again_unchanged(tmp_path) -> None:
    whole, net = rest_net()
    write_fold(net, tmp_path / "net.fold")
    data = json.loads((tmp_path / "net.fold").read_text())
    assert data["blossom:faces_goal"] == net.goal.faces_goal.tolist()
    assert data["blossom:goal_sha256"] == whole.sha256
    back = read_fold(tmp_path / "net.fold", whole)
    assert back.sha256 == net.sha256
    assert back.goal.original is whole
    assert back.certificate == net.certificate
    write_fold(back, tmp_path / "again.fold")
    assert (tmp_path / "again.fold").read_bytes() == (tmp_path / "net.fold").read_bytes()


@pytest.mark.parametrize(
    "change",
    [
        {"faces_left_out": 0},
        {"faces_left_out": 1},
        {"faces_goal": None},
        {"faces_goal": "none"},
        {"faces_goal": [0, 1, 2, 4, 5, 6, 7, 9, 10, 12]},
        {"faces_goal": [1, 0, 2, 4, 5, 6, 7, 9, 10, 11]},
        {"faces_goal": [0, 0, 2, 4, 5, 6, 7, 9, 10, 11]},
        {"faces_goal": [0, 1, 2, 3, 5, 6, 7, 9, 10, 11]},
    ],
)
def test_faces_are_never_missing_silently(change, tmp_path) -> None:
    whole, net = rest_net()
    path = tmp_path / "net.fold"
    write_fold(net, path)
    data = json.loads(path.read_text())
    for key, value in change.items():
        where = data["blossom:certificate"] if key == "faces_left_out" else data
        where[key if key == "faces_left_out" else f"blossom:{key}"] = value
    path.write_text(json.dumps(data))
    with pytest.raises(FormatError, match=r"faces_goal|faces_vertices|edges_vertices"):
        read_fold(path, whole)


def test_what_is_there_folds_to_its_part_of_the_goal() -> None:
    whole, net = rest_net()
    corners = folded_triangles(net, net.fold_angle).reshape(-1, 3)
    target = whole.vertices[whole.faces[net.goal.faces_goal]].reshape(-1, 3)
    turn, shift = rigid_fit(corners, target)
    assert np.abs(corners @ turn.T + shift - target).max() < 1e-9


@given(st.sets(st.integers(0, len(BALL.faces) - 1), min_size=1, max_size=6))
def test_no_net_of_the_whole_loses_more_folding(left_out: set[int]) -> None:
    """The loss is the heaviest forest that hangs the missing faces on: no net of the whole has a heavier."""
    rest = BALL.without(left_out)
    graph = DualGraph(BALL)
    angle = np.where(graph.flat, 0.0, np.abs(graph.fold_angle))
    lost = lost_fold_rad(rest)
    touching = np.isin(graph.faces, sorted(left_out)).any(axis=1)
    assert lost <= np.sort(angle[touching])[::-1][: len(left_out)].sum() + 1e-12
    net = ball_net()
    hung = [f for f in sorted(left_out) if net.parent[f] >= 0]
    assert lost >= np.abs(net.fold_angle[net.crease_of[hung]]).sum() - 1e-12
