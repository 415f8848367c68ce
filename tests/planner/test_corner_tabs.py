"""Necks at corners of the base panel: where they have room, what is cut, that folds stay clear of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.corner_tabs import CORNER_WIDTHS_MM, Neck, corner_tabs, is_corner_tab, neck_of
from planner.cut_paths import contour_lines, split_at_tabs
from planner.fold_plan import Cut, Fold, Release, Tab
from planner.fold_problem import FoldProblem
from planner.held_check import check_held
from planner.holding import hold_base
from planner.insets import edge_insets
from planner.metal_pieces import incentres, metal_left, piece_of
from planner.neck_contact import neck_bodies, petal_rests, stays_clear
from planner.placement import place_net
from planner.plan_on_sheet import fold_on_sheet, plan_on_sheet, tree_of_net
from planner.relief import lit_creases
from planner.substrate import make_sheet
from planner.tab_strength import tab_strength
from tests.planner.hand_nets import cross_net
from tests.planner.hand_plans import LIMITS, plan_for

NET = place_net(cross_net(base=0), LIMITS)  # petals all around the bottom of a box
HALF = 0.5 * LIMITS.kerf


@pytest.mark.parametrize("width", CORNER_WIDTHS_MM)
def test_necks_run_straight_out_of_the_gaps_between_two_petals(width):
    """The petals of the box leave a quarter turn free at two corners of its bottom."""
    necks = corner_tabs(NET, LIMITS, width)
    assert {tuple(np.round(neck.corner, 3).tolist()) for neck in necks} == {(-10.0, 10.0), (-10.0, -10.0)}
    for neck in necks:
        assert is_corner_tab(NET, neck.tab)
        assert neck.outward == pytest.approx(neck.corner / math.hypot(*neck.corner), abs=1e-6)
        assert math.dist(neck.tab.start, neck.tab.end) == pytest.approx(width, abs=2e-6)
        # beside a gap of 90 degrees the petals end where half of it is as wide as half the neck and a kerf
        assert neck.reach_mm == pytest.approx(0.5 * width + LIMITS.kerf, abs=1e-4)
        assert not set(neck.fan) & set(NET.base_panel.tolist())


def test_a_neck_is_as_wide_as_kerf_and_thickness_ask_for():
    assert corner_tabs(NET, replace(LIMITS, kerf=0.2, clearance=0.1), 0.35) == []
    assert corner_tabs(NET, replace(LIMITS, thickness=0.3), 0.35) == []
    assert corner_tabs(NET, replace(LIMITS, thickness=0.3), 0.6)


def test_no_neck_where_it_would_take_too_much_of_a_crease_or_meet_another_face():
    assert corner_tabs(NET, LIMITS, 7.0) == []  # 3.6 mm / sin 45 are more than a fifth of 20 mm
    (tab, *_) = [neck.tab for neck in corner_tabs(NET, LIMITS, 1.0)]
    along = Tab(tab.edge, (-10.0, 10.5), (-10.0, 9.5))  # in the middle of a petal
    assert neck_of(NET, tab, LIMITS.kerf) is not None
    assert neck_of(NET, along, LIMITS.kerf) is None


def test_the_hold_takes_necks_where_no_side_is_free_and_they_are_strong_enough():
    plan = plan_for(cross_net(base=0))
    assert len(plan.sheet.tabs) == 2
    assert all(is_corner_tab(plan.net, tab) for tab in plan.sheet.tabs)
    assert tab_strength(plan).share < 1.0
    assert check_held(plan) == []


def test_wider_necks_are_taken_for_a_heavier_sheet():
    light, heavy = (
        hold_base(NET, make_sheet(NET, limits), limits, ())
        for limits in (LIMITS, replace(LIMITS, weight_n_mm2=4.0 * LIMITS.weight_n_mm2))
    )
    widths = [min(math.dist(tab.start, tab.end) for tab in hold.tabs) for hold in (light, heavy)]
    assert widths[0] < widths[1]


def test_cuts_beside_a_neck_end_at_the_base_and_leave_it_whole():
    plan = plan_for(cross_net(base=0))
    net, tabs = plan.net, plan.sheet.tabs
    contour, later = split_at_tabs(net, contour_lines(net, LIMITS.kerf), tabs, LIMITS.kerf)
    panel = shapely.union_all(shapely.polygons(net.vertices[net.faces[net.base_panel]]))
    assert contour.intersection(panel.buffer(-1e-6)).length == 0.0
    burnt = shapely.buffer(contour, HALF)
    for tab in tabs:
        neck = neck_of(net, tab, LIMITS.kerf)
        assert burnt.intersection(neck.band(-1e-3)).area < 2.0 * LIMITS.kerf**2  # round ends of kerfs
        inside = shapely.union_all(shapely.polygons(net.vertices[net.faces[list(neck.fan)]]))
        for side in shapely.get_parts(neck.sides()).tolist():
            assert side.distance(panel) < 1e-6
            # its kerf reaches out of the petal, into that of the contour
            assert side.buffer(HALF).intersection(burnt.difference(inside)).area > 0.0
    # the release cuts the necks off half a kerf beside the base
    assert later.distance(panel) == pytest.approx(HALF, abs=1e-6)
    metal = panel.buffer(8.0).difference(shapely.buffer(shapely.union_all([contour, later]), HALF + 1e-3))
    held = [part for part in shapely.get_parts(metal) if part.intersects(panel.buffer(-1.0))]
    bands = shapely.union_all([neck_of(net, tab, LIMITS.kerf).band() for tab in tabs])
    assert all(part.intersection(bands).area < 0.05 for part in held)


def test_a_crease_cut_before_its_petal_is_free_is_found_out():
    """Without the cuts beside the necks the petals hang on the sheet, and the replay of rule 5 says so."""
    plan = plan_for(cross_net(base=0))
    necks = [neck_of(plan.net, tab, LIMITS.kerf) for tab in plan.sheet.tabs]
    sides = shapely.buffer(shapely.union_all([neck.sides() for neck in necks]), 1e-3)
    steps = tuple(
        replace(step, paths=tuple(p for p in step.paths if not sides.contains(shapely.LineString(p))))
        if isinstance(step, Cut)
        else step
        for step in plan.steps
    )
    assert any("still joined" in line for line in check_held(replace(plan, steps=steps)))
    dropped = tuple(step for step in plan.steps if not isinstance(step, Release))
    assert check_held(replace(plan, steps=dropped)) == ["the plan never releases the part from the sheet"]


def test_creases_are_lit_only_beyond_the_neck():
    plan = plan_for(cross_net(base=0))
    lit = lit_creases(plan)
    necks = [neck_of(plan.net, tab, LIMITS.kerf) for tab in plan.sheet.tabs]
    taken = shapely.union_all([neck.band(LIMITS.kerf - 1e-6, 0.0, neck.back_mm) for neck in necks])
    shorter = 0
    for crease, ends in lit.items():
        start, end = plan.net.hinge(plan.net.child_of[crease])
        whole = float(np.linalg.norm(end - start))
        assert shapely.LineString(ends).intersection(taken).length < 1e-6
        assert math.dist(*ends) >= 0.6 * whole
        shorter += math.dist(*ends) < whole - 0.1
    folded = {step.crease for step in plan.steps if isinstance(step, Fold)}
    corners = shapely.MultiPoint([neck.corner for neck in necks])
    touched = [
        e for e in folded if corners.distance(shapely.MultiPoint(plan.net.vertices[plan.net.edges[e]])) < 1e-5
    ]
    assert touched
    assert shorter >= len(touched)


def problem_of(net, limits=LIMITS):
    return FoldProblem(net.goal, edge_insets(net, limits.thickness, limits.clearance), limits)


def test_petals_that_rise_beside_a_neck_stay_clear_of_it_and_others_do_not():
    problem, tree = problem_of(NET), tree_of_net(NET)
    result = fold_on_sheet(NET, make_sheet(NET, LIMITS), problem, ()).result
    neck = corner_tabs(NET, LIMITS, 1.0)[0]
    assert stays_clear(neck, tree, result, problem)
    # a neck that only petals without their corners cut off would have room beside
    blunt = Neck(NET, neck.tab, neck.kerf_mm, (), neck.reach_mm)
    assert not stays_clear(blunt, tree, result, problem)


def test_the_bodies_of_petals_and_neck_lie_a_kerf_apart():
    problem, tree = problem_of(NET), tree_of_net(NET)
    for neck in corner_tabs(NET, LIMITS, 0.6):
        faces = problem.solids(tree)
        owner, rests = petal_rests(neck, faces, np.zeros_like(problem.sharp))
        assert set(owner.tolist()) == set(neck.fan)
        bodies = neck_bodies(neck, LIMITS.thickness)
        left, right = (shapely.union_all(shapely.polygons(s[:, 6:9, :2])) for s in (rests, bodies))
        assert left.distance(right) == pytest.approx(LIMITS.kerf, abs=1e-6)
        assert right.area == pytest.approx(
            neck.band(0.0, neck.kerf_mm, neck.back_mm).difference(neck.panel).area
        )
        whole = shapely.union_all(shapely.polygons(faces[list(neck.fan), 0:3, :2]))
        assert left.symmetric_difference(whole.difference(neck.band(neck.kerf_mm, 9.0, 9.0))).area < 1e-6


def test_a_plan_around_a_base_with_petals_on_all_sides_is_whole():
    problem = problem_of(NET)
    plan = plan_on_sheet(NET, make_sheet(NET, LIMITS), problem, 0, (), ())
    assert all(is_corner_tab(plan.net, tab) for tab in plan.sheet.tabs)
    assert plan.metrics.fold_completion > 0.8
    assert any("2 necks 0.6 mm wide" in notice for notice in plan.notices)


@pytest.mark.parametrize("base", range(12))
def test_any_single_neck_holds_the_base_until_the_release(base):
    """From every face of the box as base: one neck joins it to the sheet, and its release parts them."""
    net = place_net(cross_net(base=base), LIMITS)
    for neck in corner_tabs(net, LIMITS, 0.6):
        assert neck.panel.contains(shapely.Point(neck.corner - 0.01 * neck.outward))
        contour, later = split_at_tabs(net, contour_lines(net, LIMITS.kerf), [neck.tab], LIMITS.kerf)
        outline = shapely.box(-80.0, -80.0, 80.0, 80.0)
        spots = incentres(np.concatenate([net.vertices[net.faces], [[[79, 79], [78, 79], [79, 78]]]]))
        for cuts, joined in ((contour, True), (shapely.union_all([contour, later]), False)):
            pieces = shapely.get_parts(metal_left(outline, cuts, (), LIMITS.kerf))
            where = piece_of(pieces, spots)
            assert (where[:-1] == where[0]).all()  # the part stays in one piece
            assert (where[0] == where[-1]) == joined


def test_no_neck_starts_where_the_base_takes_up_only_one_side_of_it():
    net = place_net(cross_net(base=7), LIMITS)  # a petal: the bottom of the box lies behind
    assert corner_tabs(net, LIMITS, 0.6) == []
