"""What could hold a base, estimated on cells: hand-made nets, and the sheets of nets that were searched."""

import math
from dataclasses import replace

import numpy as np
import pytest

from models.goals import goal_path
from planner.base_faces import rank_bases
from planner.candidate import hold_cost, judge
from planner.dual_graph import DualGraph
from planner.fold_plan import MachineLimits
from planner.fold_problem import FlatTree, FoldProblem
from planner.goal_mesh import GoalMesh
from planner.hold_gap import CELL_MM, hold_gap
from planner.insets import edge_insets
from planner.nearly_blooming import nearly_blooming
from planner.placement import place_net
from planner.plan_on_sheet import fold_on_sheet
from planner.read_goal import read_goal
from planner.substrate import make_sheet

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0))


def strip(angles_deg):
    """A row of right triangles 20 mm wide, two to a square, folded across; the base is the first."""
    count = len(angles_deg) + 1
    corners = np.zeros((2 * count, 3, 2))
    for k in range(count):
        y = 20.0 * k
        corners[2 * k] = [[0.0, y], [20.0, y], [0.0, y + 20.0]]
        corners[2 * k + 1] = [[20.0, y], [20.0, y + 20.0], [0.0, y + 20.0]]
    parent = np.arange(-1, 2 * count - 1)
    slot = np.where(np.arange(2 * count) % 2 == 1, 2, 0)
    slot[0] = -1
    target = np.zeros(2 * count)
    target[2::2] = np.radians(angles_deg)
    return FlatTree(0, parent, slot, np.arange(2 * count), corners, target, np.array([1.0, 0.0]))


def problem_of(tree):
    """A problem whose goal has as many faces; only its limits count here."""
    corners = np.concatenate([tree.corners, np.zeros((len(tree.corners), 3, 1))], axis=2)
    faces = np.arange(3 * len(corners)).reshape(-1, 3)
    goal = GoalMesh(corners.reshape(-1, 3), faces, "strip")
    return FoldProblem(goal, np.full((len(corners), 3), 0.1), LIMITS)


def test_a_flap_that_stays_on_its_side_leaves_the_sheet_alone():
    tree = strip([80.0])
    assert hold_gap(tree, problem_of(tree).fold(tree), problem_of(tree)) == 0


def test_a_net_around_the_base_leaves_no_way():
    tree = strip([80.0])
    ring = np.array([[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]])
    middle = ring.mean(axis=0)
    outer = [middle + 3.0 * (ring - middle)]
    assert np.linalg.norm(outer[0][1] - ring[1]) > 3.0 * CELL_MM
    around = [np.array([outer[0][k], outer[0][(k + 1) % 3], ring[k]]) for k in range(3)] + [
        np.array([ring[k], outer[0][(k + 1) % 3], ring[(k + 1) % 3]]) for k in range(3)
    ]
    corners = np.array([ring, *around])
    parent = np.array([-1, 4, 5, 6, 0, 0, 0])
    slot = np.array([-1, 1, 1, 1, 2, 2, 2])
    closed = FlatTree(
        0, parent, slot, np.array([0, 4, 5, 6, 1, 2, 3]), corners, np.array([0.0, *[0.5] * 6]), tree.axis
    )  # fmt: skip
    problem = problem_of(closed)
    result = replace(problem.fold(closed), steps=np.zeros((0, 3)))
    assert hold_gap(closed, result, problem) == -1
    whole = replace(closed, target=np.zeros(7))  # one panel: its own outer sides are free
    assert hold_gap(whole, result, problem) == 0


def test_a_side_with_a_petal_on_it_is_not_free():
    # the petals are so slim at their ends that 2 mm beside the base there is sheet
    base = np.array([[0.0, 0.0], [20.0, 0.0], [0.0, 20.0]])
    corners = [base]
    for k in range(3):
        a, b = base[k], base[(k + 1) % 3]
        along = b - a
        corners.append(np.array([b, a, 0.5 * (a + b) + 0.3 * np.array([along[1], -along[0]])]))
    parent, slot = np.array([-1, 0, 0, 0]), np.array([-1, 0, 0, 0])
    target = np.array([0.0, 0.5, 0.5, 0.5])
    slim = FlatTree(0, parent, slot, np.arange(4), np.array(corners), target, np.array([1.0, 0.0]))
    problem = problem_of(slim)
    still = replace(problem.fold(slim), steps=np.zeros((0, 3)))
    assert hold_gap(slim, still, problem) == -1
    two = FlatTree(0, parent[:3], slot[:3], np.arange(3), slim.corners[:3], target[:3], slim.axis)
    assert hold_gap(two, still, problem_of(two)) == 0


def test_a_base_between_petals_is_held_by_necks():
    graph = DualGraph(read_goal(goal_path("flower")))
    layout = nearly_blooming(graph, rank_bases(graph, 1, seed=0)[0].face, seed=0).layout
    net = layout.to_net()
    problem = FoldProblem(net.goal, edge_insets(net, LIMITS.thickness, LIMITS.clearance), LIMITS)
    flat = judge(layout, problem, 0.0).tree
    result = replace(problem.fold(flat), steps=np.zeros((0, 3)))
    assert hold_gap(flat, result, problem) == -1
    assert hold_gap(flat, result, problem, layout) == 0
    wide = FoldProblem(net.goal, problem.insets, replace(LIMITS, kerf=2.0))  # no neck is so wide
    assert hold_gap(flat, result, wide, layout) == -1


def test_the_cost_grows_with_the_gap():
    assert hold_cost(0) == 0.0
    costs = [hold_cost(gap) for gap in (1, 2, 5, 12)]
    assert costs == sorted(costs)
    assert costs[0] > 0.0
    assert hold_cost(-1) == hold_cost(40) == costs[-1]


@pytest.mark.parametrize("name", ["creature_coarse"])
def test_where_it_finds_a_way_the_sheet_costs_little(name):
    goal = read_goal(goal_path(name))
    graph = DualGraph(goal)
    ranked = rank_bases(graph, 24, seed=0)
    attempts = [nearly_blooming(graph, rank.face, tree=rank.tree, seed=0) for rank in ranked]
    layouts = [attempt.layout for attempt in attempts if attempt.is_net]
    insets = edge_insets(layouts[0].to_net(), LIMITS.thickness, LIMITS.clearance)
    problem = FoldProblem(goal, insets, LIMITS, without=("held",))
    costs = {True: [], False: []}
    for layout in layouts:
        plan = judge(layout, problem, 0.0)
        net = layout.to_net()
        start, end = net.vertices[net.faces[net.base_face, :2]]
        placed = place_net(net, LIMITS, math.atan2(end[1] - start[1], end[0] - start[0]))
        folded = fold_on_sheet(placed, make_sheet(placed, LIMITS), problem, ())
        lost = plan.result.completion - folded.result.completion
        costs[hold_gap(plan.tree, plan.result, problem) == 0].append(lost)
    assert len(costs[True]) > 3
    assert len(costs[False]) > 3
    assert np.mean(costs[True]) < 0.5 * np.mean(costs[False])
