"""Clipping what the folds sweep, and no more: less metal, the same folds, every rule still kept."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from models.goals import goal_path
from planner.clip_regions import MARGIN_MM, clip_region, clip_swept
from planner.fabrication import fabrication_steps
from planner.fold_plan import Clip, Sheet
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.make_net import make_net
from planner.metal_pieces import clipped_pieces
from planner.placement import place_net
from planner.plan_on_sheet import fold_on_sheet, plan_on_sheet, tree_of_net
from planner.read_goal import read_goal
from planner.sheet_hits import sheet_hits, sheet_solids
from planner.substrate import make_sheet
from planner.swept_region import swept_region
from tests.planner.hand_plans import LIMITS

METAL, NOTHING = shapely.box(0.0, 0.0, 40.0, 40.0), shapely.Polygon()


def area(sheet: Sheet, numbers) -> float:
    return float(shapely.area(shapely.polygons(sheet.triangles[sorted(numbers)])).sum())


@pytest.fixture(scope="module")
def case():
    net = place_net(make_net(read_goal(goal_path("creature_coarse"))), LIMITS)
    problem = FoldProblem(net.goal, edge_insets(net, LIMITS.thickness, LIMITS.clearance), LIMITS)
    sheet = make_sheet(net, LIMITS)
    made = fold_on_sheet(net, sheet, problem, ())
    sheet, tree = made.sheet, tree_of_net(net)
    return net, sheet, problem, made, clip_swept(
        net, sheet, made.hold, made.hits, tree, made.result, problem
    ), tree  # fmt: skip


def test_less_is_clipped_and_what_stays_is_not_touched(case):
    _, sheet, problem, made, fitted, tree = case
    assert made.hits
    assert 0.0 < area(fitted.sheet, fitted.hold.clipped) < 0.7 * area(sheet, made.hold.clipped)
    found = sheet_hits(tree, made.result, problem, sheet_solids(fitted.sheet, LIMITS.thickness))
    assert set(found) == set(fitted.hits) <= fitted.hold.clipped
    assert not fitted.hold.clipped & (fitted.hold.tether | set(np.flatnonzero(fitted.sheet.frame_faces)))
    assert fitted.pieces == len(clipped_pieces(fitted.sheet, fitted.hold.clipped))


def test_it_is_the_same_metal_and_one_conforming_mesh(case):
    _, sheet, _, _, fitted, _ = case
    before = shapely.union_all(shapely.polygons(sheet.triangles), grid_size=1e-6)
    after = shapely.union_all(shapely.polygons(fitted.sheet.triangles), grid_size=1e-6)
    assert before.symmetric_difference(after).area < 0.05
    assert fitted.sheet.triangles.size < 3 * sheet.triangles.size
    sides: dict[tuple[int, int], int] = {}
    for row in fitted.sheet.faces.tolist():
        for k in range(3):
            side = row[k], row[(k + 1) % 3]
            assert side not in sides
            sides[side] = 1
    lonely = [side for side in sides if side[::-1] not in sides]
    length = sum(float(np.linalg.norm(np.subtract(*fitted.sheet.vertices[list(s)]))) for s in lonely)
    assert length == pytest.approx(after.length, rel=1e-3)  # sides without a neighbour are the border


def test_the_swept_area_is_of_no_triangulation(case):
    net, _, problem, made, fitted, tree = case
    finer = make_sheet(net, LIMITS, shapely.box(-5.0, -5.0, 5.0, 5.0))
    hold = fold_on_sheet(net, finer, problem, ()).hold
    again = clip_swept(net, finer, hold, made.hits, tree, made.result, problem)
    assert again.swept_area == pytest.approx(fitted.swept_area, rel=1e-3)
    assert fitted.swept_area < area(fitted.sheet, fitted.hold.clipped)
    assert fitted.swept_area <= swept_region(tree, made.result, problem).area


def test_the_plan_says_what_it_clips_and_keeps_every_rule(case):
    net, sheet, problem, _, fitted, _ = case
    plan = plan_on_sheet(net, sheet, problem, 0, (), ())  # raises where the part would not be held
    (clip,) = [step for step in plan.steps if isinstance(step, Clip)]
    assert set(clip.faces) == fitted.hold.clipped
    assert plan.metrics.clipped_faces == len(clip.faces)
    assert plan.metrics.clipped_area == pytest.approx(area(plan.sheet, clip.faces), rel=1e-9)
    assert plan.metrics.swept_area == fitted.swept_area
    steps = fabrication_steps(net, fitted.sheet, fitted.hold, (), fitted.hits)
    assert f"{fitted.pieces} pieces" in steps[0].why


def test_a_region_covers_what_is_swept_with_a_margin_and_few_corners():
    swept = shapely.Point(20.0, 20.0).buffer(6.0, quad_segs=64)
    region = clip_region(swept, METAL, NOTHING, LIMITS)
    assert region.covers(swept.buffer(MARGIN_MM))
    assert swept.buffer(1.0).covers(region)
    assert shapely.get_num_coordinates(region) < 40


def test_two_places_close_together_fall_as_one_piece_and_far_ones_as_two():
    for gap, pieces in ((1.0, 1), (8.0, 2)):
        swept = shapely.union(shapely.box(5, 5, 15, 12), shapely.box(15 + gap, 5, 25 + gap, 12))
        assert len(shapely.get_parts(clip_region(swept, METAL, NOTHING, LIMITS))) == pieces


def test_no_sliver_is_left_beside_the_region_and_nothing_of_the_tether_goes():
    swept = shapely.box(5.0, 0.6, 20.0, 10.0)  # 0.6 mm from the border of the metal
    region = clip_region(swept, METAL, NOTHING, LIMITS)
    assert region.covers(shapely.box(6.0, 0.01, 19.0, 9.0))
    tether = shapely.box(0.0, 10.05, 40.0, 40.0)
    assert clip_region(swept, METAL, tether, LIMITS).intersection(tether).area == 0.0


def test_a_margin_does_not_reach_over_the_net_to_other_metal():
    metal = shapely.union(shapely.box(0, 0, 10, 10), shapely.box(10.3, 0, 20, 10))
    region = clip_region(shapely.box(5.0, 2.0, 9.95, 8.0), metal, NOTHING, LIMITS)
    assert region.intersection(shapely.box(10.3, 0, 20, 10)).area == 0.0


def test_a_thread_of_the_bound_counts_only_where_the_folds_touch():
    thread = shapely.box(5.0, 5.0, 15.0, 5.05)
    assert clip_region(thread, METAL, NOTHING, LIMITS).is_empty
    assert clip_region(thread, METAL, NOTHING, LIMITS, [METAL]).covers(thread)
