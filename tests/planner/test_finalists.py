"""Finalists on their sheets: what the annealing there returns is real, never worse and repeatable."""

import math

import numpy as np
import pytest

from models.goals import goal_path
from planner.candidate import cost, judge
from planner.dual_graph import DualGraph
from planner.finalists import improve_on_sheet, on_its_sheet
from planner.fold_plan import MachineLimits
from planner.fold_problem import FoldProblem
from planner.fold_search import SearchSettings
from planner.insets import edge_insets
from planner.make_net import make_net
from planner.nearly_blooming import nearly_blooming
from planner.read_goal import read_goal

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0), axis_height=180.0, lens_height=220.0)
GOAL = read_goal(goal_path("creature_coarse"))
PROBLEM = FoldProblem(GOAL, edge_insets(make_net(GOAL), LIMITS.thickness, LIMITS.clearance), LIMITS)


def net_of(candidate):
    net = candidate.layout.to_net()
    start, end = net.vertices[net.faces[net.base_face, :2]]
    return net, math.atan2(end[1] - start[1], end[0] - start[0]) + candidate.axis_rad


@pytest.fixture(scope="module")
def start():
    graph = DualGraph(GOAL)
    attempts = (nearly_blooming(graph, base, seed=0) for base in range(len(GOAL.faces)))
    layout = next(attempt.layout for attempt in attempts if attempt.is_net)
    return on_its_sheet(judge(layout, PROBLEM, 0.0), net_of, PROBLEM, ())


def test_the_sheet_takes_away_only(start):
    assert start.cost >= cost(start.candidate.result, PROBLEM) - 1e-9
    assert start.cost >= cost(start.folded.result, PROBLEM) - 1e-12


def test_annealing_on_the_sheet_is_real_never_worse_and_repeatable(start):
    settings = SearchSettings(1, 80, seed=3)
    better = improve_on_sheet(start, net_of, PROBLEM, settings, 12)
    assert better.cost <= start.cost
    again = improve_on_sheet(start, net_of, PROBLEM, settings, 12)
    assert again.cost == better.cost
    assert np.array_equal(again.placed.vertices, better.placed.vertices)
    anew = on_its_sheet(better.candidate, net_of, PROBLEM, ())
    assert anew.cost == better.cost
    assert np.array_equal(anew.folded.result.steps, better.folded.result.steps)


def test_without_anything_to_spend_the_start_is_returned(start):
    settings = SearchSettings(1, 80, seed=3)
    assert improve_on_sheet(start, net_of, PROBLEM, settings, 0) is start
    assert improve_on_sheet(start, net_of, PROBLEM, SearchSettings(1, 0), 12) is start
    assert improve_on_sheet(start, net_of, PROBLEM, SearchSettings(1, 80, deadline=0.0), 12) is start


def test_a_given_net_is_kept(start):
    settings = SearchSettings(1, 40, seed=1, fixed_net=True)
    better = improve_on_sheet(start, net_of, PROBLEM, settings, 8)
    assert np.array_equal(better.candidate.layout.tree, start.candidate.layout.tree)
    assert better.candidate.layout.base == start.candidate.layout.base
