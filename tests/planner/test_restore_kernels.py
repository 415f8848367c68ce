"""Restoring edits: nothing is left that one exchange could bring back, and rounds by force only help."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.blooming_trees import BLOOMING_TREES, TreeName, blooming_tree
from planner.dual_graph import DualGraph
from planner.flat_layout import FlatLayout
from planner.goal_mesh import GoalMesh
from planner.nearly_blooming import ROUNDS, nearly_blooming, restore, rounds_for
from planner.overlap import overlapping_triangles
from tests.planner.goal_shapes import even_ball, random_hull, rough_ball
from tests.planner.hand_nets import box_goal


def shuffled(goal: GoalMesh, seed: int, steps: int) -> tuple[FlatLayout, np.ndarray]:
    """A layout without overlaps, ``steps`` random exchanges away from a tree, and the tree."""
    graph = DualGraph(goal)
    base = seed % len(goal.faces)
    start = nearly_blooming(graph, base, seed=seed)
    layout = FlatLayout(graph, start.layout.tree, base)
    rng = np.random.default_rng(seed)
    for _ in range(steps):
        cut = int(rng.choice(np.flatnonzero(layout.tree)))
        join = layout.joinable(cut)
        if len(join):
            layout.exchange(cut, int(rng.choice(join)))
    return FlatLayout(graph, layout.tree, base), blooming_tree(graph, base, "steepest")


@settings(max_examples=20)
@given(st.integers(10, 60), st.integers(0, 10_000), st.floats(0.0, 0.6))
def test_no_single_exchange_is_left(count: int, seed: int, depth: float) -> None:
    """The kernel judges all cuts of a path at once; tried one by one, each that is left hits something."""
    layout, tree = shuffled(rough_ball(count, seed, depth), seed, 60)
    left = restore(layout, tree, False)
    assert left == np.count_nonzero(layout.tree & ~tree)
    afresh = FlatLayout(layout.graph, layout.tree, layout.base)
    assert overlapping_triangles(afresh.corners) == []
    assert np.allclose(np.sort(afresh.parent), np.sort(layout.parent))
    for join in np.flatnonzero(tree & ~afresh.tree).tolist():
        ends = layout.graph.faces[join].tolist()
        for cut in afresh.path(*ends).tolist():
            if not tree[cut] and not layout.graph.flat[cut] and afresh.keeps_hold(cut, join):
                probe = FlatLayout(layout.graph, afresh.tree, layout.base, hold_base=False)
                assert not probe.exchange(cut, join)


@settings(max_examples=20)
@given(st.integers(10, 60), st.integers(0, 10_000), st.floats(0.2, 0.7), st.sampled_from(BLOOMING_TREES))
def test_more_rounds_never_cost_edits(count: int, seed: int, depth: float, name: TreeName) -> None:
    graph = DualGraph(rough_ball(count, seed, depth))
    base = seed % len(graph.goal.faces)
    found = [nearly_blooming(graph, base, tree=name, seed=seed, rounds=n) for n in (0, 10, 60)]
    assert all(attempt.is_net for attempt in found)
    assert found[0].edits >= found[1].edits >= found[2].edits
    assert found[0].roomy <= found[2].roomy
    assert found[0].work <= found[1].work <= found[2].work
    again = nearly_blooming(graph, base, tree=name, seed=seed, rounds=60)
    assert np.array_equal(again.layout.tree, found[2].layout.tree)


def test_rounds_by_force_pay() -> None:
    """Restoring alone stops where a single exchange does; the sum over many nets shows what force adds."""
    sums = np.zeros(2, dtype=np.int64)
    for seed in range(12):
        graph = DualGraph(rough_ball(70, seed, 0.6))
        for place, rounds in enumerate((0, 100)):
            sums[place] += nearly_blooming(graph, seed, tree="bfs", rounds=rounds).edits
    assert sums[1] < 0.97 * sums[0]


def test_flat_joints_and_the_last_free_side_are_kept() -> None:
    for goal in (box_goal(), even_ball(30), random_hull(40, 3)):
        layout, tree = shuffled(goal, 5, 40)
        room = layout.tab_has_room()
        restore(layout, tree, room, rounds=20, seed=1)
        after = FlatLayout(layout.graph, layout.tree, layout.base)
        assert after.overlaps == 0
        assert after.free_edges() > 0
        assert after.tab_has_room() or not room
        assert after.tree[layout.graph.flat_forest].all()


def test_fewer_rounds_for_many_faces() -> None:
    few, many = DualGraph(even_ball(20)), DualGraph(even_ball(600))
    assert rounds_for(few, None) == ROUNDS
    assert rounds_for(many, None) < ROUNDS
    assert rounds_for(many, 7) == 7
