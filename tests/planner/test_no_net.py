"""What is said where no net was found: what was tried, and cures in their order."""

from __future__ import annotations

import re

import pytest

from planner.cured_net import make_net_with_cures
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.make_net import make_net
from planner.net_methods import net_method
from tests.planner.goal_shapes import load_obj, random_hull, rough_ball
from tests.planner.no_net_shapes import overlapping_fan


@pytest.fixture
def spiked(shared_meshes):
    return load_obj(shared_meshes / "proc" / "spiketet36_a.obj")


def refusal(goal, **options) -> str:
    with pytest.raises(NetError) as caught:
        make_net(goal, **options)
    return str(caught.value)


def test_all_that_was_tried_is_told(spiked) -> None:
    words = refusal(spiked, seed=3)
    for part in (
        "'nb'",
        "steepest, dijkstra, bfs",
        "base faces",
        "seed 3",
        "tested for overlap",
        "overlap (",
    ):
        assert part in words
    places = [words.index(cure) for cure in ("--budget", "--mesh-edit", "--leave-out")]
    assert places == sorted(places)


def test_a_budget_that_is_used_up_is_told(spiked) -> None:
    assert "the budget is used up" in refusal(spiked, budget_s=0.01)


def test_another_base_is_named_if_it_has_a_net() -> None:
    goal = rough_ball(14, 0, 0.3)
    graph = DualGraph(goal)
    plain = net_method("dijkstra")
    tried = [plain(graph, face, 0, 1.0) for face in range(len(goal.faces))]
    bad = next(face for face, attempt in enumerate(tried) if len(attempt.overlapping))
    assert any(attempt.is_net for attempt in tried)
    words = refusal(goal, method="dijkstra", base_face=bad)
    named = re.search(r"with --base (\d+) there is a net", words)
    assert words.index("--base") < words.index("--mesh-edit")
    assert named
    make_net(goal, method="dijkstra", base_face=int(named[1]))


def test_a_base_of_a_convex_body_is_named() -> None:
    goal = random_hull(12, 3)
    graph = DualGraph(goal)
    closed = [f for f in range(len(goal.faces)) if not net_method("steepest")(graph, f, 0, 1.0).is_net]
    assert all("face" in refusal(goal, method="steepest", base_face=face) for face in closed[:2])


def test_nothing_is_cured_unasked() -> None:
    with pytest.raises(NetError, match="one flat pattern only"):
        make_net_with_cures(overlapping_fan(366.0))


def test_the_mesh_is_changed_before_faces_are_left_out() -> None:
    goal = overlapping_fan(366.0)
    changed = make_net_with_cures(goal, mesh_edit_mm=3.0, leave_out=True)
    assert changed.edit is not None
    assert len(changed.net.goal.left_out) == 0
    assert changed.net.goal is changed.edit.goal
    thinned = make_net_with_cures(goal, mesh_edit_mm=0.001, leave_out=True)
    assert thinned.edit is None
    assert len(thinned.net.goal.left_out) == 1
    assert thinned.net.goal.original is goal


def test_where_there_is_a_net_nothing_is_changed() -> None:
    goal = random_hull(10, 1)
    cured = make_net_with_cures(goal, mesh_edit_mm=3.0, leave_out=True)
    assert cured.edit is None
    assert cured.net.goal is goal
    assert cured.net.sha256 == make_net(goal).sha256
