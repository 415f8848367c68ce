"""Bars and clamps of the frame: solids of their height, out of the way of light, net and rotation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.clearance import check_rotation_clearance
from planner.errors import PlanError
from planner.fold_plan import Rotate
from planner.frame_strip import frame_strip
from planner.placement import GAP_MM, frame_gap, place_net, sheet_extent
from planner.plan_file import read_plan, write_plan
from planner.plan_on_sheet import tree_of_net
from planner.sheet_hits import sheet_solids
from planner.substrate import make_sheet
from tests.planner.hand_nets import cross_net
from tests.planner.hand_plans import LIMITS, plan_for

BARS = replace(LIMITS, clamp_height=4.0)
CORNER = ((-200.0, 20.0), (-26.0, 20.0), (-26.0, 150.0), (-200.0, 150.0))


def heights(solids):
    return solids[:, :6, 2].max(axis=1), solids[:, :6, 2].min(axis=1)


def test_bars_are_as_high_as_the_rig_says_in_the_search_and_on_the_sheet():
    net = place_net(cross_net(), BARS)
    sheet = make_sheet(net, BARS)
    top, bottom = heights(sheet_solids(sheet, BARS.thickness))
    assert np.all(top == np.where(sheet.frame_faces, 4.0, 0.05))
    assert np.all(bottom == -top)
    strip_top, strip_bottom = heights(frame_strip(tree_of_net(net), BARS))
    assert np.all(strip_top == 4.0)
    assert np.all(strip_bottom == -4.0)
    flat = heights(sheet_solids(make_sheet(net, LIMITS), LIMITS.thickness))[0]
    assert np.all(flat == 0.05)


@pytest.mark.parametrize("source", [None, (30.0, -10.0, 400.0)])
@pytest.mark.parametrize("height", [0.0, 2.0, 9.0, 30.0])
def test_no_bar_stands_between_any_crease_and_the_light(height, source):
    """Rays from the border of the net at every tilt, by sampling, pass over the inner edge of the bars."""
    limits = replace(
        LIMITS, clamp_height=height, max_tilt_rad=math.radians(35.0), beam_source=source, beam_spread=0.01
    )
    gap = frame_gap(limits)
    assert gap >= GAP_MM
    half = 0.5 * np.array(limits.work_area)
    for tilt in np.linspace(-limits.max_tilt_rad, limits.max_tilt_rad, 9):
        c, s = math.cos(tilt), math.sin(tilt)
        for x, y in ((half[0], half[1]), (half[0], -half[1]), (-half[0], half[1]), (0.0, half[1])):
            point = np.array([x, y, 0.0])
            light = np.array([0.0, s, c])
            if source is not None:
                sx, sy, sz = source  # turned back into the frame of the sheet
                light = np.array([sx, sy * c + sz * s, -sy * s + sz * c]) - point
            aside = np.hypot(*light[:2]) / light[2]
            assert aside * height + limits.beam_radius <= gap + 1e-9


def test_the_net_keeps_that_gap_and_the_sheet_grows_with_it():
    tall = replace(LIMITS, clamp_height=30.0)
    net, sheets = cross_net(), []
    for limits in (LIMITS, tall):
        placed = place_net(net, limits)
        sheet = make_sheet(placed, limits)
        frame = shapely.union_all(shapely.polygons(sheet.triangles[sheet.frame_faces]))
        faces = shapely.union_all(shapely.polygons(placed.vertices[placed.faces]))
        assert frame.distance(faces) == pytest.approx(frame_gap(limits), abs=1e-3)
        sheets.append(np.ptp(sheet_extent(placed, limits), axis=0))
    assert np.all(sheets[1] - sheets[0] == pytest.approx(2.0 * (frame_gap(tall) - GAP_MM)))


def test_clamps_that_reach_over_the_sheet_belong_to_the_frame():
    limits = replace(BARS, clamps=(CORNER,))
    net = place_net(cross_net(), limits)
    sheet = make_sheet(net, limits)
    frame = shapely.union_all(shapely.polygons(sheet.triangles[sheet.frame_faces]), grid_size=1e-6)
    clamp = shapely.Polygon(CORNER)
    under = clamp.intersection(shapely.Polygon(sheet.outline))
    assert under.area > 50.0
    assert under.difference(frame).area < 1e-2
    bare = make_sheet(net, BARS)
    strip = shapely.union_all(shapely.polygons(bare.triangles[bare.frame_faces]), grid_size=1e-6)
    assert frame.area == pytest.approx(strip.union(under).area, abs=1e-2)
    faces = shapely.union_all(shapely.polygons(net.vertices[net.faces]))
    assert faces.distance(clamp) >= frame_gap(limits)


def test_a_net_turns_away_from_a_clamp_or_is_refused():
    across = ((-200.0, 12.0), (200.0, 12.0), (200.0, 13.0), (-200.0, 13.0))
    limits = replace(LIMITS, clamps=(across,))
    with pytest.raises(PlanError, match=r"within 5 mm of a clamp that reaches.*--size"):
        place_net(cross_net(), limits)
    far = replace(LIMITS, clamps=(tuple((x, y + 60.0) for x, y in across),))
    assert np.array_equal(place_net(cross_net(), far).vertices, place_net(cross_net(), LIMITS).vertices)


def test_bars_count_in_rotation_clearance():
    plan = plan_for(cross_net())
    assert any(isinstance(step, Rotate) for step in plan.steps)
    half = 0.5 * float(np.ptp(plan.sheet.outline[:, 1]))
    room = math.hypot(half, 0.05) + 0.5
    tight = replace(plan, limits=replace(plan.limits, axis_height=room, lens_height=room + 100.0))
    assert check_rotation_clearance(tight) == []
    tall = replace(tight, sheet=replace(plan.sheet, clamp_height=12.0))
    reach = math.hypot(half, 12.0 - 0.05) + 0.05 - room
    assert reach > 0.1
    (words, *_) = check_rotation_clearance(tall)
    assert "into the bed" in words
    assert float(words.split(" mm into")[0].split()[-1]) == pytest.approx(reach, abs=0.01)


def test_bars_and_clamps_survive_the_plan_file(tmp_path):
    limits = replace(BARS, clamps=(CORNER,))
    plan = plan_for(cross_net(), limits=limits)
    write_plan(plan, tmp_path / "plan.json", {})
    again = read_plan(tmp_path / "plan.json", plan.net)
    assert again.sheet.clamp_height == 4.0
    assert again.limits.clamps == (CORNER,)
    assert np.array_equal(again.sheet.frame_faces, plan.sheet.frame_faces)
