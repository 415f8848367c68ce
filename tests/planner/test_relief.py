"""Relief holes: where creases meet, of the right size, and never so that anything is lost."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.cut_paths import tab_strip
from planner.fold_plan import Cut, Fold
from planner.held_check import check_held
from planner.pattern import pattern_of
from planner.pattern_check import with_pattern
from planner.relief import is_relief, lit_creases, relief_mm_for, relief_paths, relief_radii, with_relief
from planner.sheet_layers import sheet_layers
from tests.planner.hand_plans import LIMITS, plan_for, some_nets

NETS = some_nets()
KERF = LIMITS.kerf


@pytest.fixture(scope="module", params=NETS)
def plain(request):
    return plan_for(NETS[request.param])


@pytest.fixture(params=[0.1, 0.4, 3.0])
def plan(plain, request):
    return with_relief(replace(plain, limits=replace(plain.limits, relief_mm=request.param)))


def folded(plan):
    return sorted({step.crease for step in plan.steps if isinstance(step, Fold)})


def radii_of(plan):
    return relief_radii(plan.net, folded(plan), plan.sheet.tabs, plan.limits.relief_mm, KERF)


def test_they_are_where_at_least_two_creases_meet(plan):
    net = plan.net
    count = np.bincount(net.edges[folded(plan)].ravel(), minlength=len(net.vertices))
    assert set(radii_of(plan)) == set(np.flatnonzero(count >= 2).tolist())


def test_they_are_cut_first_and_counted(plan):
    made = [r for r in radii_of(plan).values() if r > 0.0]
    reliefs = [n for n, step in enumerate(plan.steps) if isinstance(step, Cut) and is_relief(step)]
    assert reliefs == ([0] if made else [])
    if made:
        assert f"holes at {len(made)} of " in plan.steps[0].why
        assert sheet_layers(plan)["RELIEF"] == plan.steps[0].paths


def test_the_burnt_edge_is_a_circle_over_the_faces(plan):
    net = plan.net
    for vertex, radius in radii_of(plan).items():
        paths = relief_paths(net, {vertex: radius}, KERF)
        assert bool(paths) == (radius > 0.0)
        if radius <= 0.0:
            continue
        assert radius <= plan.limits.relief_mm
        place = shapely.Point(net.vertices[vertex])
        burnt = shapely.MultiLineString(list(paths)).buffer(0.5 * KERF, quad_segs=32)
        assert shapely.hausdorff_distance(burnt, place) <= radius + 0.002
        mine = [f for f, corners in enumerate(net.faces.tolist()) if vertex in corners]
        faces = shapely.union_all(shapely.polygons(net.vertices[net.faces[mine]]), grid_size=1e-7)
        rim = (
            shapely.Point(place)
            .buffer(radius, quad_segs=64)
            .boundary.intersection(faces.buffer(-0.02 * KERF))
        )
        if rim.length > 0.2 * KERF:
            assert shapely.hausdorff_distance(rim, burnt) <= 2.1 * radius
            assert max(burnt.distance(shapely.Point(p)) for p in shapely.get_coordinates(rim)) < 0.01


def test_most_of_every_crease_stays_and_passes_begin_at_the_hole(plan):
    net, radii = plan.net, radii_of(plan)
    for crease, (a, b) in lit_creases(plan).items():
        start, end = net.hinge(net.child_of[crease])
        length = float(np.linalg.norm(end - start))
        assert math.dist(a, b) >= 0.8 * length - 0.01
        along = (end - start) / length
        for point in (a, b):
            offset = np.array(point) - start
            assert abs(along[0] * offset[1] - along[1] * offset[0]) < 1e-9
        if crease in folded(plan):
            for corner, point in ((start, a), (end, b)):
                vertex = next(v for v in net.edges[crease].tolist() if np.allclose(net.vertices[v], corner))
                assert math.dist(point, corner) >= radii.get(vertex, 0.0) - 0.004


def test_nothing_is_lost_and_no_tab_is_touched(plain, plan):
    assert check_held(plan) == check_held(plain)
    if plan.steps != plain.steps:
        burnt = shapely.MultiLineString(list(plan.steps[0].paths)).buffer(0.5 * KERF)
        for tab in plan.sheet.tabs:
            assert burnt.distance(tab_strip(tab, KERF, KERF, 0.5 * KERF)) > 0.0


def test_passes_of_the_pattern_are_as_short(plan):
    limits = replace(plan.limits, bend_width=0.1, neutral_shift=0.03)
    moved = pattern_of(replace(plan, limits=limits)).creases
    for crease, ends in lit_creases(plan).items():
        assert math.dist(*moved[crease]) == pytest.approx(math.dist(*ends))


def test_none_are_none(plain):
    assert with_relief(plain) is plain
    assert with_pattern(plain) is plain
    assert relief_radii(plain.net, folded(plain), (), 0.0, KERF) == {}
    whole = lit_creases(plain)
    for crease, face in plain.net.child_of.items():
        assert np.array(whole[crease]) == pytest.approx(np.array(plain.net.hinge(face)))


def test_holes_that_would_drop_something_are_left_out_with_a_notice(plain, monkeypatch):
    monkeypatch.setattr("planner.pattern_check.check_held", lambda plan: ["step 0: all is lost"])
    done = with_pattern(replace(plain, limits=replace(plain.limits, relief_mm=0.1)))
    assert done.limits.relief_mm == 0.0
    assert done.steps == plain.steps
    assert done.notices[-1] == "no relief holes, they would cut too much: step 0: all is lost"


def test_usual_radius():
    assert relief_mm_for(0.1, 0.05) == 0.1
    assert relief_mm_for(0.1, 0.3) == 0.3
