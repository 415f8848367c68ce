"""Random changes of a net: the axis stays where it lies, and sharp folds are joined less often."""

import math
from dataclasses import replace

import numpy as np
import pytest

from models.goals import goal_path
from planner.candidate import flat_tree, judge
from planner.dual_graph import DualGraph
from planner.fold_plan import MachineLimits
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.nearly_blooming import nearly_blooming
from planner.read_goal import read_goal
from planner.search_moves import (
    EASY_FOLD_RAD,
    MOST_BACK_RAD,
    SHARP_FOLD_RAD,
    Trial,
    _gentle_first,
    _held_back,
    _other_base,
)

GOAL = read_goal(goal_path("creature_coarse"))
GRAPH = DualGraph(GOAL)


@pytest.fixture(scope="module")
def layout():
    attempts = (nearly_blooming(GRAPH, base, seed=0) for base in range(len(GOAL.faces)))
    return next(attempt.layout for attempt in attempts if attempt.is_net)


def test_another_base_leaves_the_axis_where_it_is(layout):
    rng = np.random.default_rng(3)
    moves = [_other_base(Trial(layout, 0.7, None), rng) for _ in range(20)]
    moves = [move for move in moves if move is not None]
    assert len({move.layout.base for move in moves}) > 3
    for move in moves:
        assert flat_tree(move.layout, move.axis_rad).axis == pytest.approx(
            flat_tree(layout, 0.7).axis, abs=1e-9
        )


def test_sharp_folds_lead_less_often_by_the_stated_factor(layout):
    angle = np.abs(GRAPH.fold_angle)
    flattest, sharpest = int(np.argmin(angle)), int(np.argmax(angle))
    assert angle[flattest] < EASY_FOLD_RAD < angle[sharpest]
    rng = np.random.default_rng(0)
    edges = np.array([flattest, sharpest])
    leads = np.array([_gentle_first(edges, layout, rng)[0] == sharpest for _ in range(4000)]).mean()
    factor = math.exp(-(angle[sharpest] - EASY_FOLD_RAD) / SHARP_FOLD_RAD)
    assert leads == pytest.approx(factor / (1.0 + factor), abs=4.0 * math.sqrt(0.25 / 4000))


def test_what_carries_the_blocker_is_held_back_and_let_go_again(layout):
    rng = np.random.default_rng(5)
    tree = flat_tree(layout, 0.0)
    ends = [int(f) for f in tree.order.tolist() if f not in tree.parent]
    face, other = ends[0], ends[-1]
    ways = []
    for end in (face, other):
        ways.append({end})
        while tree.parent[end] >= 0:
            end = int(tree.parent[end])
            ways[-1].add(end)
    carriers = {int(layout.crease[f]) for f in ways[1] - ways[0]}
    now, held, least = Trial(layout, 0.0, None), set(), math.inf
    for _ in range(60):
        move = _held_back(now, face, other, rng)
        assert move.layout is layout
        (changed,) = np.flatnonzero(move.back)
        held.add(int(changed))
        least = min(least, move.back[changed])
        assert 0.0 < move.back[changed] <= MOST_BACK_RAD
    assert held == {edge for edge in carriers if not GRAPH.flat[edge]}
    assert least < 0.05 * MOST_BACK_RAD
    now, gone = replace(now, back=move.back), 0
    for _ in range(60):
        less = _held_back(now, face, other, rng).back
        assert ((less >= 0.0) & (less != now.back)).sum() == 1
        gone += not less.any()
    assert gone > 0
    assert now.back.sum() == move.back.sum()  # moves leave what they start from


def test_nothing_is_held_back_where_nothing_carries_the_blocker(layout):
    rng = np.random.default_rng(5)
    face = int(layout.order[-1])
    for blocker in (face, int(layout.parent[face]), layout.base):
        assert _held_back(Trial(layout, 0.0, None), face, blocker, rng) is None


def test_a_net_that_no_tilt_shows_is_refused_unfolded(layout):
    limits = MachineLimits(max_tilt_rad=0.0)
    insets = edge_insets(layout.to_net(), limits.thickness, limits.clearance)
    problem = FoldProblem(GOAL, insets, limits)
    whole = judge(layout, problem, 0.0)
    steep = np.abs(whole.tree.target) > math.radians(90.5)
    assert steep.any()
    bound = (np.abs(whole.tree.target[steep]) - math.radians(90.5)).sum() / np.abs(whole.tree.target).sum()
    assert bound < whole.cost
    refused = judge(layout, problem, 0.0, give_up=0.5 * bound)
    assert len(refused.result.steps) == 0
    assert refused.cost > 0.5 * bound
    assert (refused.result.cause != 0).any()
    kept = judge(layout, problem, 0.0, give_up=2.0 * whole.cost)
    assert kept.cost == whole.cost
