"""Nets of goals: no overlap on any common mesh, a base that can be held, reasons where there is no net."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner import proof_check
from planner.corner_tabs import CORNER_WIDTHS_MM, corner_tabs
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh
from planner.make_net import make_net, starting_layouts
from planner.net import Net
from planner.no_goods import never_free
from planner.overlap import overlapping_faces
from tests.planner.goal_shapes import (
    block_with_hole,
    even_ball,
    helix_strip,
    load_obj,
    plate,
    rough_ball,
    tetrahedron,
    torus,
)
from tests.planner.hand_nets import box_goal
from tests.planner.test_flat_layout import check_net

REAL = ("airplane-48", "angleblock-48", "bunny-48", "bunny-128", "star-24", "spot-48", "halftunnel-128",
        "snail-128", "star_split-216", "gear-508", "bunny-348", "lilium-48", "hammer-128")  # fmt: skip


@pytest.mark.parametrize("name", REAL)
def test_real_meshes_get_a_net(shared_meshes: Path, name: str) -> None:
    goal = load_obj(shared_meshes / "real" / f"{name}.obj")
    net = make_net(goal)
    assert overlapping_faces(net) == []
    check_net(net)
    check_hold(net.goal, net)
    certificate = net.certificate
    assert certificate.faces_left_out == 0
    assert certificate.lower_bound <= certificate.edits < len(goal.faces) / 4
    assert certificate.optimal == (certificate.edits == certificate.lower_bound)


def check_hold(goal: GoalMesh, net: Net) -> None:
    """The base panel has a cut side of 2 mm, or its longest; if none can be cut, room for a neck."""
    graph = DualGraph(goal)
    if never_free(graph, net.base_face):
        assert corner_tabs(net, MachineLimits(), CORNER_WIDTHS_MM[0])
        return
    lengths = graph.side_length[net.base_panel]
    kinds = {frozenset(pair): kind for pair, kind in zip(net.edges.tolist(), net.assignment, strict=True)}
    free = [
        lengths[i, k]
        for i, corners in enumerate(net.faces[net.base_panel].tolist())
        for k in range(3)
        if kinds[frozenset((corners[k], corners[(k + 1) % 3]))] == "B"
    ]
    assert max(free) >= min(2.0, lengths.max()) - 1e-6


def test_generated_meshes_get_a_net(shared_meshes: Path) -> None:
    for path in sorted((shared_meshes / "proc").glob("*.obj")):
        goal = load_obj(path)
        if len(goal.faces) <= 130 and path.stem != "spiketet36_a":
            net = make_net(goal)
            assert overlapping_faces(net) == [], path.name
            check_hold(goal, net)


def test_a_body_without_a_net_is_refused(shared_meshes: Path) -> None:
    """The spiked tetrahedron is built like the polyhedron that Bern et al. (2003) proved to have no net."""
    goal = load_obj(shared_meshes / "proc" / "spiketet36_a.obj")
    with pytest.raises(NetError, match=r"spiketet36_a is not formable from one sheet.*--budget") as caught:
        make_net(goal, base_face=4)
    assert caught.value.faces


@pytest.mark.slow
def test_all_meshes_up_to_1000_faces(shared_meshes: Path) -> None:
    for path in sorted((shared_meshes / "real").glob("*.obj")):
        goal = load_obj(path)
        if len(goal.faces) <= 1000:
            assert overlapping_faces(make_net(goal)) == [], path.name


@pytest.mark.parametrize(
    "goal",
    [tetrahedron(), box_goal(), plate(), torus(), even_ball(40), rough_ball(60, 3), block_with_hole()],
    ids=lambda goal: goal.name,
)
def test_bodies_of_all_kinds(goal: GoalMesh) -> None:
    net = make_net(goal, seed=1)
    assert overlapping_faces(net) == []
    check_net(net)
    check_hold(goal, net)
    assert make_net(goal, seed=1).sha256 == net.sha256


def test_moving_and_scaling_a_goal_changes_nothing_but_the_scale() -> None:
    goal = rough_ball(40, 6, 0.4)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    moved = GoalMesh(goal.vertices @ turn.T + [10.0, -20.0, 5.0], goal.faces)
    one, two = make_net(goal, base_face=3), make_net(moved, base_face=3)
    assert np.array_equal(one.parent, two.parent)
    assert np.allclose(one.vertices, two.vertices, atol=1e-9)
    mirrored = GoalMesh(goal.vertices * [-1.0, 1.0, 1.0], goal.faces[:, ::-1])
    assert overlapping_faces(make_net(mirrored, base_face=3)) == []


def test_the_base_face_is_kept() -> None:
    goal = rough_ball(40, 2)
    for base in (0, 17, 33):
        assert make_net(goal, base_face=base).base_face == base
    with pytest.raises(NetError, match=r"base face 999 does not exist: rough40-2 has faces 0 to \d+"):
        make_net(goal, base_face=999)


def test_goal_with_one_overlapping_pattern_only() -> None:
    goal = helix_strip()
    with pytest.raises(
        NetError, match=r"not formable from one sheet.*one flat pattern only.*faces overlap"
    ) as caught:
        make_net(goal)
    assert caught.value.faces
    assert max(caught.value.faces) < len(goal.faces)


def test_plain_trees_that_overlap_say_so() -> None:
    goal = rough_ball(80, 5, 0.7)
    with pytest.raises(
        NetError, match=r"method 'bfs' with base face 3.*faces overlap.*use --method nb"
    ) as caught:
        make_net(goal, method="bfs", base_face=3)
    assert len(caught.value.faces) >= 2


def three_wings(size: float) -> GoalMesh:
    """A triangle with a wing on each of its sides."""
    middle = np.array([[0, 0, 0], [20, 0, 0], [10, 17, 0]], float)
    tips = np.array([[10, -15, 3], [25, 14, 3], [-5, 14, 3]], float)
    return GoalMesh(
        size * np.concatenate([middle, tips]),
        np.array([[0, 1, 2], [1, 0, 3], [2, 1, 4], [0, 2, 5]]),
        name="three wings",
    )


def test_a_base_that_cannot_be_held() -> None:
    goal = three_wings(0.05)  # too small for a neck at a corner
    with pytest.raises(NetError, match=r"three wings: with base face 0 .*no tab can hold it.*--base"):
        make_net(goal, base_face=0)


def test_a_base_with_a_wing_on_every_side_is_held_at_its_corners() -> None:
    net = make_net(three_wings(1.0), base_face=0)
    assert net.base_face == 0
    assert net.certificate.edits == net.certificate.lower_bound == 0
    assert proof_check.check_net(net).problems == ()
    assert make_net(three_wings(1.0)).base_face == 0


def test_two_pieces_are_refused() -> None:
    box = box_goal()
    both = GoalMesh(
        np.concatenate([box.vertices, box.vertices + 100.0]),
        np.concatenate([box.faces, box.faces + 8]),
        name="two",
    )
    with pytest.raises(NetError, match="two is not formable from one sheet: its faces are 2 pieces"):
        make_net(both)


def test_starting_layouts_differ_and_are_nets() -> None:
    goal = rough_ball(40, 12)
    layouts = starting_layouts(goal, 12, seed=1)
    assert len(layouts) == 12
    assert len({(layout.base, layout.tree.tobytes()) for layout in layouts}) == 12
    for layout in layouts:
        assert not len(layout.overlapping_pairs())
        assert layout.free_edges() > 0
    fixed = starting_layouts(goal, 8, base_face=5, seed=1)
    assert {layout.base for layout in fixed} == {5}
    assert len(fixed) > 1
    again = starting_layouts(goal, 12, seed=1)
    assert all(np.array_equal(a.tree, b.tree) for a, b in zip(layouts, again, strict=True))
    assert len(starting_layouts(plate(), 5)) >= 1
