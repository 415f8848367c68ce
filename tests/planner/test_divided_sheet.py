"""A sheet divided along what the folds sweep: ways to hold the base that whole triangles would lose."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from models.goals import goal_path
from planner import plan_on_sheet as module
from planner.candidate import cost
from planner.dual_graph import DualGraph
from planner.errors import PlanError
from planner.fold_plan import MachineLimits
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.nearly_blooming import nearly_blooming
from planner.placement import place_net
from planner.read_goal import read_goal
from planner.substrate import make_sheet
from planner.swept_region import ROUGH_MM, swept_region

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0))


@pytest.fixture(scope="module")
def cases():
    """Nets of one goal, each folded on its sheet: as triangles, and divided where that is needed."""
    goal = read_goal(goal_path("creature_coarse"))
    graph = DualGraph(goal)
    attempts = [nearly_blooming(graph, base, seed=0) for base in range(0, len(goal.faces), 7)]
    layouts = [attempt.layout for attempt in attempts if attempt.is_net]
    insets = edge_insets(layouts[0].to_net(), LIMITS.thickness, LIMITS.clearance)
    problem = FoldProblem(goal, insets, LIMITS)
    divide = module._on_divided_sheet
    out = []
    for layout in layouts:
        net = layout.to_net()
        start, end = net.vertices[net.faces[net.base_face, :2]]
        placed = place_net(net, LIMITS, math.atan2(end[1] - start[1], end[0] - start[0]))
        sheet = make_sheet(placed, LIMITS)
        calls = []

        def spy(net, folded, tree, problem, calls=calls):
            calls.append((folded, divide(net, folded, tree, problem)))
            return calls[-1][1]

        module._on_divided_sheet = spy
        try:
            folded = module.fold_on_sheet(placed, sheet, problem, ())
        except PlanError:
            continue
        finally:
            module._on_divided_sheet = divide
        out.append((placed, sheet, problem, folded, calls))
    return out


def test_it_is_divided_only_where_nothing_is_left_to_hold_the_base(cases):
    divided = [bool(calls) for *_, calls in cases]
    assert any(divided)
    assert not all(divided)
    for _, sheet, _, folded, calls in cases:
        if calls:
            assert calls[0][0].hold.needed
            assert calls[0][0].sheet is sheet
        else:
            assert folded.sheet is sheet
            assert not folded.hold.needed


def test_most_of_those_are_held_without_a_fold_given_up(cases):
    ways = [calls[0] for *_, calls in cases if calls]
    freed = [after for _, after in ways if not after.hold.needed]
    assert len(freed) >= 0.5 * len(ways)
    for after in freed:
        assert not set(after.hits) & after.hold.tether


def test_it_is_the_same_metal(cases):
    for before, after in (calls[0] for *_, calls in cases if calls):
        whole, parts = (
            shapely.union_all(shapely.polygons(one.sheet.triangles), grid_size=1e-6)
            for one in (before, after)
        )
        assert whole.symmetric_difference(parts).area < 0.05
        frames = [one.sheet.triangles[one.sheet.frame_faces] for one in (before, after)]
        areas = [float(shapely.area(shapely.polygons(one)).sum()) for one in frames]
        assert areas[0] == pytest.approx(areas[1], rel=1e-6)
        assert after.sheet.frame_faces[after.kept].all()


def test_the_plans_keep_every_rule(cases):
    made = 0
    for placed, _, problem, folded, calls in cases:
        if not calls or folded.hold.needed or made == 2:
            continue
        made += 1
        plan = module.plan_on_sheet(placed, folded.sheet, problem, 0, (), (), folded)  # raises if not held
        assert plan.metrics.fold_completion == pytest.approx(folded.result.completion)
        assert math.isfinite(cost(folded.result, problem))
    assert made


def test_a_rough_region_misses_little_of_the_proven_one(cases):
    placed, _, problem, folded, _ = cases[0]
    tree = module.tree_of_net(placed)
    proven = swept_region(tree, folded.result, problem)
    rough = swept_region(tree, folded.result, problem, rough=True)
    assert proven.difference(rough).area < 0.01 * proven.area
    assert rough.difference(proven.buffer(2.0 * ROUGH_MM)).area < 0.01 * proven.area
    assert np.isfinite(rough.area)
