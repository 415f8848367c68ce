"""Fewest edits: the same as by trying every spanning tree, whatever way the goal is written down."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner import fewest_edits
from planner.blooming_trees import BLOOMING_TREES, TreeName, blooming_tree
from planner.dual_graph import DualGraph
from planner.fewest_edits import ProvenNet, prove_net
from planner.goal_mesh import GoalMesh
from planner.make_net import make_net
from planner.net_methods import NET_METHODS
from planner.no_goods import never_free
from planner.overlap import overlapping_triangles
from planner.proof_check import check_net, check_proof
from tests.planner.all_spanning_trees import lay_all_trees
from tests.planner.goal_shapes import block_with_hole, helix_strip, plate, rough_ball, torus
from tests.planner.hand_nets import box_goal

names = st.sampled_from(BLOOMING_TREES)


def spiky(count: int, seed: int) -> GoalMesh:
    """A body of few, thin, deep faces: its trees overlap often."""
    goal = rough_ball(count, seed, 0.85)
    return GoalMesh(goal.vertices * [1.0, 0.6, 1.7], goal.faces, name=goal.name)


def confirm(proven: ProvenNet, graph: DualGraph, base: int, name: TreeName) -> None:
    """What must hold of every answer: a net, honest counts, a proof that a checker accepts."""
    attempt, tree = proven.attempt, blooming_tree(graph, base, name)
    assert attempt.is_net
    assert attempt.held
    assert not overlapping_triangles(attempt.layout.corners)
    assert attempt.edits == np.count_nonzero(attempt.layout.tree & ~tree)
    assert proven.lower_bound == proven.proof.bound <= attempt.edits
    assert proven.optimal == (proven.lower_bound == attempt.edits)
    bound, no_goods, problems = check_proof(graph, base, tree, proven.proof)
    assert problems == []
    assert bound == proven.lower_bound
    assert no_goods == len(proven.proof.no_goods)
    check = check_net(attempt.to_net("exact"))
    assert check.problems == ()
    assert (check.edits, check.lower_bound, check.optimal) == (attempt.edits, bound, proven.optimal)


@settings(max_examples=10)
@given(st.integers(5, 7), st.integers(0, 10_000), names)
def test_as_few_as_by_trying_every_tree(count: int, seed: int, name: TreeName) -> None:
    graph = DualGraph(spiky(count, seed))
    base = seed % len(graph.goal.faces)
    proven = prove_net(graph, base, tree=name, seed=seed, seconds=60.0)
    confirm(proven, graph, base, name)
    fewest = lay_all_trees(graph, base, blooming_tree(graph, base, name)).fewest_held_edits
    assert proven.optimal
    assert proven.attempt.edits == fewest


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_as_few_as_by_trying_every_tree_of_fourteen_faces(seed: int) -> None:
    graph = DualGraph(spiky(9, seed))
    assert len(graph.goal.faces) == 14
    for name in BLOOMING_TREES:
        proven = prove_net(graph, seed, tree=name, seconds=60.0)
        assert proven.optimal
        assert (
            proven.attempt.edits
            == lay_all_trees(graph, seed, blooming_tree(graph, seed, name)).fewest_held_edits
        )


def test_overlaps_are_needed_for_the_comparison_to_mean_something() -> None:
    needed = []
    for seed in range(30):
        graph = DualGraph(spiky(8, seed))
        tree = blooming_tree(graph, 0, "bfs")
        needed.append(lay_all_trees(graph, 0, tree).fewest_held_edits)
    assert max(edits for edits in needed if edits is not None) >= 2


def test_the_hold_of_the_base_costs_an_edit() -> None:
    graph = DualGraph(box_goal())
    proven = prove_net(graph, 0, tree="bfs")
    confirm(proven, graph, 0, "bfs")
    assert proven.optimal
    assert proven.attempt.edits == 1
    assert [item.why for item in proven.proof.no_goods] == ["hold"]


def test_nothing_to_do_needs_no_proof() -> None:
    graph = DualGraph(plate())
    proven = prove_net(graph, 3)
    confirm(proven, graph, 3, "steepest")
    assert proven.optimal
    assert (proven.attempt.edits, proven.lower_bound, proven.proof.no_goods) == (0, 0, ())


@pytest.mark.parametrize("name", BLOOMING_TREES)
def test_genus_one(name: TreeName) -> None:
    graph = DualGraph(torus(9, 4))
    proven = prove_net(graph, 3, tree=name, seconds=60.0)
    confirm(proven, graph, 3, name)
    assert proven.optimal


def test_an_open_surface_with_two_boundary_loops() -> None:
    ball = rough_ball(26, 4, 0.6)
    faces = np.delete(ball.faces, [0, len(ball.faces) - 1], axis=0)
    graph = DualGraph(GoalMesh(ball.vertices, faces, name="open"))
    for name in BLOOMING_TREES:
        proven = prove_net(graph, 5, tree=name, seconds=60.0)
        confirm(proven, graph, 5, name)
        assert proven.optimal


def test_a_ring_of_flat_faces_may_be_cut_and_the_proof_says_so() -> None:
    graph = DualGraph(block_with_hole())
    outside = next(f for f in range(len(graph.goal.faces)) if abs(graph.goal.face_normals[f, 2]) < 0.5)
    proven = prove_net(graph, outside, seconds=60.0)
    confirm(proven, graph, outside, "steepest")
    assert not proven.proof.whole_panels


def test_bodies_of_some_size() -> None:
    for seed in range(4):
        graph = DualGraph(rough_ball(40, seed, 0.7))
        for name in BLOOMING_TREES:
            proven = prove_net(graph, 2, tree=name, seconds=60.0)
            confirm(proven, graph, 2, name)
            assert proven.optimal


def test_without_time_the_bound_is_small_but_true() -> None:
    graph = DualGraph(rough_ball(60, 3, 0.7))
    proven = prove_net(graph, 2, seconds=0.0)
    confirm(proven, graph, 2, "steepest")
    assert proven.lower_bound == 0
    assert not proven.optimal


def test_that_there_is_no_net_is_proven() -> None:
    proven = prove_net(DualGraph(helix_strip()), 4, seconds=60.0)
    assert not proven.attempt.is_net
    assert proven.impossible
    assert proven.impossible_for_any_base
    assert not proven.optimal


def test_a_base_that_can_have_no_free_side_is_held_at_a_corner() -> None:
    ball = rough_ball(12, 1, 0.2)
    used, corners = np.unique(ball.faces[neighbourhood(ball, 0)], return_inverse=True)
    graph = DualGraph(GoalMesh(ball.vertices[used], corners.reshape(-1, 3), name="star"))
    assert never_free(graph, 0)
    assert not never_free(DualGraph(ball), 0)
    held = prove_net(graph, 0, seconds=60.0)
    assert held.attempt.is_net
    assert held.attempt.layout.free_edges() == 0
    assert held.optimal
    assert check_net(held.attempt.to_net("exact")).holds


def neighbourhood(goal: GoalMesh, face: int) -> list[int]:
    """A face and the faces across its sides: laid flat, every side of the first is a crease."""
    shared = [len(set(row) & set(goal.faces[face].tolist())) for row in goal.faces.tolist()]
    return [face, *(f for f, count in enumerate(shared) if count == 2)]


def test_progress_only_gets_better() -> None:
    graph = DualGraph(rough_ball(60, 5, 0.7))
    told: list[tuple[int, int, float]] = []
    proven = prove_net(graph, 2, tree="bfs", seconds=60.0, progress=lambda *now: told.append(now))
    assert told[-1][:2] == (proven.attempt.edits, proven.lower_bound)
    assert [row[0] for row in told] == sorted((row[0] for row in told), reverse=True)
    assert [row[1] for row in told] == sorted(row[1] for row in told)
    assert [row[2] for row in told] == sorted(row[2] for row in told)


def test_same_input_same_proof() -> None:
    one, two = (
        prove_net(DualGraph(rough_ball(50, 6, 0.7)), 1, tree="dijkstra", seconds=60.0) for _ in range(2)
    )
    assert one.optimal
    assert one.proof == two.proof
    assert np.array_equal(one.attempt.layout.tree, two.attempt.layout.tree)


def same_face(goal: GoalMesh, other: GoalMesh, face: int, place: np.ndarray) -> int:
    """The face of ``other`` whose corners are the images of those of ``face``."""
    wanted = sorted(place[goal.faces[face]].tolist())
    return next(f for f, row in enumerate(other.faces.tolist()) if sorted(row) == wanted)


@settings(max_examples=10)
@given(
    st.integers(12, 24), st.integers(0, 10_000), names,
    st.sampled_from(["motion", "scale", "mirror", "faces", "corners", "vertices"]),
)  # fmt: skip
def test_the_number_does_not_depend_on_how_the_goal_is_written(
    count: int, seed: int, name: TreeName, change: str
) -> None:
    goal = rough_ball(count, seed, 0.7)
    rng = np.random.default_rng(seed)
    points, faces = goal.vertices, goal.faces
    place = np.arange(len(points))
    if change == "motion":
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        points = points @ (turn * np.linalg.det(turn)) + rng.normal(size=3) * 50.0
    elif change == "scale":
        points = points * 3.0
    elif change == "mirror":
        points, faces = points * [-1.0, 1.0, 1.0], faces[:, ::-1]
    elif change == "faces":
        faces = faces[rng.permutation(len(faces))]
    elif change == "corners":
        faces = np.array(
            [np.roll(row, k) for row, k in zip(faces, rng.integers(0, 3, len(faces)), strict=True)]
        )
    else:
        place = rng.permutation(len(points))
        shuffled = np.empty_like(points)
        shuffled[place] = points
        points, faces = shuffled, place[faces]
    changed = GoalMesh(points, faces, name=goal.name)
    base = seed % len(goal.faces)
    numbers = [
        prove_net(DualGraph(shape), face, tree=name, seconds=60.0)
        for shape, face in ((goal, base), (changed, same_face(goal, changed, base, place)))
    ]
    assert all(number.optimal for number in numbers)
    assert numbers[0].attempt.edits == numbers[1].attempt.edits


def test_a_search_that_stops_early_can_be_told_from_its_proof(monkeypatch: pytest.MonkeyPatch) -> None:
    graph = DualGraph(rough_ball(60, 3, 0.7))
    whole = prove_net(graph, 2, tree="bfs", seconds=60.0)
    monkeypatch.setattr(fewest_edits._Search, "_most_promising", lambda _: None)
    monkeypatch.setattr(fewest_edits._Search, "_branch", lambda *_: None)
    early = prove_net(graph, 2, tree="bfs", seconds=60.0)
    confirm(early, graph, 2, "bfs")
    assert early.lower_bound <= whole.lower_bound
    assert len(early.proof.branches) == 1


def test_method_exact_needs_no_more_edits_than_nb() -> None:
    goal = rough_ball(30, 9, 0.7)
    exact, quick = make_net(goal, method="exact", base_face=3), make_net(goal, method="nb", base_face=3)
    assert exact.certificate.method == "exact"
    assert exact.certificate.optimal
    assert exact.certificate.edits <= quick.certificate.edits
    assert check_net(exact).holds
    assert check_net(quick).holds


@pytest.mark.parametrize("method", sorted(NET_METHODS))
def test_every_method_makes_certificates_that_hold(method: str) -> None:
    for goal in (box_goal(), plate(), rough_ball(14, 3, 0.3)):
        attempt = NET_METHODS[method](DualGraph(goal), 2, 7, 2.0)
        if attempt.is_net:
            assert check_net(attempt.to_net(method)).problems == ()
