"""Leaving faces out: the integer programme against trying everything, and nets of bodies that have none."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import BLOOMING_TREES, blooming_tree, weighted_tree
from planner.dual_graph import DualGraph
from planner.errors import NetError
from planner.flat_layout import FlatLayout
from planner.fold_plan import MachineLimits
from planner.goal_mesh import GoalMesh
from planner.leave_out import net_with_faces_left_out
from planner.lightest_branches import face_areas, lightest_branches
from planner.lost_folds import lost_fold_rad
from planner.overlap import overlapping_faces
from planner.plan_folds import plan_folds
from tests.planner.goal_shapes import block_with_hole, helix_strip, load_obj, random_hull, rough_ball
from tests.planner.no_net_shapes import overlapping_fan
from tests.planner.test_flat_layout import check_net


def lightest_by_trying(layout: FlatLayout, pairs: list[tuple[int, int]]) -> float:
    """Least area over all ways to cut branches off that break every pair (small trees only)."""
    areas = face_areas(layout.graph)
    members: dict[int, set[int]] = {f: {f} for f in range(len(areas))}
    for face in layout.order.tolist()[:0:-1]:
        members[int(layout.parent[face])] |= members[face]
    loose = [f for f in range(len(areas)) if layout.depth[f] > 0]
    best = np.inf
    for count in range(4):
        for roots in itertools.combinations(loose, count):
            gone = set().union(*(members[f] for f in roots)) if roots else set()
            if all(a in gone or b in gone for a, b in pairs):
                best = min(best, float(areas[sorted(gone)].sum()))
    return best


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.lists(st.tuples(st.integers(0, 15), st.integers(0, 15)), max_size=3))
def test_the_programme_finds_the_least_area(seed: int, drawn: list[tuple[int, int]]) -> None:
    graph = DualGraph(random_hull(10, seed))
    weight = np.random.default_rng(seed).random(len(graph.faces))
    layout = FlatLayout(graph, weighted_tree(graph, weight, 0), 0)
    pairs = [(a, b) for a, b in drawn if a != b]
    gone = lightest_branches(layout, np.array(pairs, dtype=np.int64).reshape(-1, 2))
    if layout.free_edges():
        assert face_areas(graph)[gone].sum() == pytest.approx(lightest_by_trying(layout, pairs), abs=1e-9)
    for a, b in pairs:
        assert gone[a] or gone[b]
    for face in np.flatnonzero(~gone).tolist():
        assert face == layout.base or not gone[layout.parent[face]]
    assert not gone[layout.base]


def test_a_side_of_the_base_is_freed_for_the_tab() -> None:
    """Around this base all three sides are creases, and nothing overlaps."""
    graph = DualGraph(random_hull(12, 3))
    for base in range(len(graph.goal.faces)):
        layout = FlatLayout(graph, blooming_tree(graph, base, "bfs"), base)
        assert layout.free_edges() == 0
        gone = lightest_branches(layout, np.zeros((0, 2), dtype=np.int64))
        beside = set(graph.faces[graph.face_edges[base]].ravel().tolist()) - {base}
        assert any(gone[face] for face in beside)


def check_rest(goal: GoalMesh, base_face: int | None = None, **options) -> tuple[int, ...]:
    """Faces left out of the net of ``goal``, after all checks of what is left."""
    net = net_with_faces_left_out(goal, base_face=base_face, **options)
    assert overlapping_faces(net) == []
    check_net(net)
    assert net.goal.original is goal
    assert net.certificate.faces_left_out == len(net.goal.left_out)
    if base_face is not None:
        assert net.goal.faces_goal[net.base_face] == base_face
    return tuple(net.goal.left_out.tolist())


@pytest.mark.parametrize("total", [361.0, 372.0, 385.0, 400.0])
def test_as_many_faces_of_a_fan_go_as_have_to(total: float) -> None:
    """Of equal triangles the least number goes that brings the sum of the angles below a full turn."""
    goal = overlapping_fan(total)
    angle = total / len(goal.faces)
    assert len(check_rest(goal)) == int(np.ceil((total - 360.0) / angle - 1e-9))


@pytest.mark.parametrize("base", [0, 30])
def test_a_strip_keeps_its_base(base: int) -> None:
    assert len(check_rest(helix_strip(), base)) == 22


@pytest.mark.parametrize("method", ["nb", *BLOOMING_TREES])
def test_every_method_can_be_thinned_out(method: str) -> None:
    goal = rough_ball(40, 5, 0.7)
    missing = check_rest(goal, 3 if method != "nb" else None, method=method)
    assert (len(missing) == 0) == (method == "nb")


def test_the_spiked_tetrahedron_loses_one_spike(shared_meshes) -> None:
    goal = load_obj(shared_meshes / "proc" / "spiketet36_a.obj")
    missing = check_rest(goal)
    assert len(missing) == 3
    corners = [set(goal.faces[face].tolist()) for face in missing]
    assert set.intersection(*corners)  # one tip


def test_missing_faces_count_as_not_folded() -> None:
    net = net_with_faces_left_out(overlapping_fan(366.0))
    plan = plan_folds(net, MachineLimits(), keep_net=True)
    assert np.array_equal(plan.net.goal.left_out, net.goal.left_out)
    assert plan.net.certificate.faces_left_out == 1
    wanted = np.abs(plan.net.fold_angle)
    reached = np.minimum(np.abs(plan.final_angles), wanted).sum()
    assert reached > 0.0
    whole = wanted.sum() + lost_fold_rad(net.goal)
    assert plan.metrics.fold_completion == pytest.approx(reached / whole)


def test_same_input_same_net() -> None:
    goal = block_with_hole()
    one, two = (net_with_faces_left_out(goal, method="bfs", seed=4) for _ in range(2))
    assert one.sha256 == two.sha256
    assert np.array_equal(one.goal.left_out, two.goal.left_out)


def test_two_pieces_stay_two_pieces() -> None:
    one = random_hull(6, 0)
    far = GoalMesh(
        np.concatenate([one.vertices, one.vertices + 100.0]),
        np.concatenate([one.faces, one.faces + len(one.vertices)]),
        name="two",
    )
    with pytest.raises(NetError, match="2 pieces"):
        net_with_faces_left_out(far)
