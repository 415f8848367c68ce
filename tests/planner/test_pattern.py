"""The pattern: edges come out where the moved faces have them, cuts stay whole, what cannot be is said."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.bend_allowance import outward
from planner.fold_plan import Clip, Cut, Release
from planner.net_region import boundary_edges
from planner.pattern import pattern_of
from planner.pattern_check import pattern_faults, pattern_figures, pattern_overlap, with_pattern
from planner.sheet_layers import sheet_layers
from tests.planner import hand_nets
from tests.planner.hand_plans import LIMITS, plan_for, some_nets

NETS = some_nets()
BENDS = {"thin": (0.1, 0.1 / 3.0), "eaten": (0.1, 0.2), "wide": (0.8, 0.0)}
KERF = LIMITS.kerf


@pytest.fixture(scope="module", params=NETS)
def flat_plan(request):
    whole = plan_for(NETS[request.param])
    free = np.flatnonzero(~whole.sheet.frame_faces)
    hits = np.random.default_rng(2).choice(free, len(free) // 10, replace=False).tolist()
    return plan_for(NETS[request.param], hits)


@pytest.fixture(params=BENDS)
def plan(flat_plan, request):
    width, shift = BENDS[request.param]
    return replace(flat_plan, limits=replace(flat_plan.limits, bend_width=width, neutral_shift=shift))


def all_paths(plan):
    return [path for step in plan.steps if isinstance(step, Cut | Release) for path in step.paths]


def test_without_bends_nothing_moves(flat_plan):
    pattern = pattern_of(flat_plan)
    assert pattern.largest_shift_mm == 0.0
    for path in all_paths(flat_plan):
        assert pattern.path(path) is path
    for crease, ends in pattern.creases.items():
        assert np.array(ends) == pytest.approx(np.array(flat_plan.net.hinge(flat_plan.net.child_of[crease])))


def test_every_edge_comes_out_where_the_moved_face_has_it(plan):
    """After the beam has taken half a kerf on both sides: exact beside wide gaps, short only in slits."""
    pattern = pattern_of(plan)
    before = shapely.MultiLineString(all_paths(plan))
    after = shapely.MultiLineString([*pattern.paths(all_paths(plan))])
    _, faces, corners = boundary_edges(plan.net)
    exact = 0
    for face, ends in zip(faces.tolist(), plan.net.vertices[corners], strict=True):
        for share in np.linspace(0.1, 0.9, 9):
            point = ends[0] + share * (ends[1] - ends[0])
            old = before.distance(shapely.Point(point))
            new = after.distance(shapely.Point(point + pattern.shifts[face]))
            if old > 0.499 * KERF:  # a gap that the kerf fits into
                opened = pattern_overlap(pattern) == 0.0
                if opened:
                    assert new == pytest.approx(0.5 * KERF, abs=0.003)
                    exact += 1
            else:
                moved = np.linalg.norm(pattern.shifts, axis=1).max()
                assert abs(new - old) <= moved + 1e-6
    assert exact or pattern_overlap(pattern) > 0.0 or not len(plan.net.child_of)


def test_paths_keep_their_course(plan):
    """Closed stays closed, no gap within a path, no point moves farther than the faces do."""
    pattern = pattern_of(plan)
    for path in all_paths(plan):
        moved = pattern.path(path)
        assert (moved[0] == moved[-1]) == (path[0] == path[-1])
        reach = pattern.largest_shift_mm + 1e-5
        line, old = shapely.LineString(moved), shapely.LineString(path)
        assert shapely.hausdorff_distance(line, old, densify=0.05) <= 2.0 * reach
        assert all(math.dist(a, b) > 1e-6 for a, b in itertools.pairwise(moved))


def test_the_pattern_can_be_cut_where_the_net_can(plan):
    """Nothing falls that should not, and what is clipped is free: with the moved cuts as with the others."""
    pattern = pattern_of(plan)
    if pattern_overlap(pattern) < 0.5 * KERF:
        assert pattern_faults(plan, pattern) == []


def test_creases_lie_in_the_middle_of_the_strip_that_bends(plan):
    pattern = pattern_of(plan)
    for crease, ends in pattern.creases.items():
        face = plan.net.child_of[crease]
        parent = int(plan.net.parent[face])
        start, end = plan.net.hinge(face)
        normal = outward(plan.net, face)
        gaps = [(np.array(ends[0]) - start - pattern.shifts[f]) @ normal for f in (parent, face)]
        assert gaps[0] == pytest.approx(-gaps[1], abs=1e-12)
        assert math.dist(*ends) == pytest.approx(float(np.linalg.norm(end - start)))


def test_tabs_and_base_stay(plan):
    pattern = pattern_of(plan)
    assert np.all(pattern.shifts[plan.net.base_panel] == 0.0)
    for step in plan.steps:
        if isinstance(step, Release):
            for path, moved in zip(step.paths, pattern.paths(step.paths), strict=True):
                assert shapely.hausdorff_distance(shapely.LineString(path), shapely.LineString(moved)) < 1e-6


def test_drawings_show_the_pattern(plan):
    pattern = pattern_of(plan)
    layers = sheet_layers(plan)
    lines = [line for name in ("VALLEY", "MOUNTAIN") for line in layers[name]]
    folded = [e for e, letter in enumerate(plan.net.assignment.tolist()) if letter in "VM"]
    assert sorted(lines) == sorted(pattern.creases[e] for e in folded)
    cut = sorted(pattern.paths(p for s in plan.steps if isinstance(s, Cut) for p in s.paths))
    assert sorted([*layers["CUT"], *layers["CLIP"]]) == cut


def test_an_allowance_that_cannot_be_cut_is_taken_out_with_a_notice():
    plan = plan_for(NETS["cross"])
    plan = replace(plan, limits=replace(plan.limits, bend_width=40.0))
    done = with_pattern(plan)
    assert done.limits.bend_width == 0.0
    assert done.notices[-1].startswith("no bend allowance, the pattern could not be cut: ")
    assert done.steps == plan.steps


def narrow_fan():
    """Seven faces round an apex; the gap in their net is narrow."""
    return plan_for(hand_nets.net_from_parents(hand_nets.pyramid_goal(7, 20.0, 4.0), [-1, *range(6)]))


def test_faces_that_come_to_overlap_are_told():
    """The narrow gap of a flat fan cannot give way when wide strips draw its faces together."""
    plan = narrow_fan()
    plan = replace(plan, limits=replace(plan.limits, bend_width=40.0))
    deep = pattern_overlap(pattern_of(plan))
    assert deep > 0.5 * KERF
    done = with_pattern(plan)
    assert done.notices[-1] == (
        f"faces of the pattern overlap by up to {deep:.2f} mm: some edges come out shorter by half"
    )
    assert done.limits == plan.limits


@pytest.mark.parametrize("name", ["strip", "cross"])
def test_panels_at_a_crease_may_overlap_by_its_deduction(name):
    plan = plan_for(NETS[name])
    plan = replace(plan, limits=replace(plan.limits, bend_width=2.0))
    assert pattern_of(plan).largest_shift_mm > 0.05
    assert pattern_overlap(pattern_of(plan)) < 1e-6


def least_way_out(first, second):
    """Move one polygon away from another step by step in many directions."""
    least = math.inf
    for angle in np.linspace(0.0, 2.0 * math.pi, 721):
        low, high = 0.0, 100.0
        for _ in range(40):
            way = 0.5 * (low + high)
            at = shapely.affinity.translate(second, way * math.cos(angle), way * math.sin(angle))
            low, high = (way, high) if first.intersection(at).area > 1e-12 else (low, way)
        least = min(least, high)
    return least


def test_overlap_is_the_least_way_out():
    """A face of a strip laid over another one far from it."""
    pattern = pattern_of(plan_for(NETS["strip"]))
    net = pattern.net
    middle = net.vertices[net.faces].mean(axis=1)
    shifts = np.zeros((len(net.faces), 2))
    shifts[0] = middle[-1] - middle[0] + np.array([0.7, 1.1])
    moved = replace(pattern, shifts=shifts)
    polygons = shapely.polygons(moved.triangles)
    under = [p for p in polygons[1:] if p.intersection(polygons[0]).area > 0.0]
    assert under
    expected = max(least_way_out(p, polygons[0]) for p in under)
    assert pattern_overlap(moved) == pytest.approx(expected, rel=1e-4)


def test_figures():
    plan = plan_for(NETS["cross"])
    plan = replace(plan, limits=replace(plan.limits, bend_width=0.1, neutral_shift=0.1 / 3.0))
    figures = pattern_figures(plan)
    deduction = 0.1 * (4.0 / math.pi - 1.0) - 0.2 / 3.0  # of a right angle
    assert (
        figures.largest_shift == pytest.approx(2.0 * abs(deduction), rel=1e-6) or figures.largest_shift > 0.0
    )
    assert figures.shape_rms_without > 0.0
    assert figures.overlap == 0.0
    assert 0.0 <= figures.kerf_loss <= 0.5 * KERF
    sharp = pattern_figures(replace(plan, limits=LIMITS))
    assert sharp.shape_rms_without == pytest.approx(0.0, abs=1e-12)
    assert set(figures.to_values()) == {
        "bend_width_mm", "neutral_shift_mm", "largest_shift_mm", "shape_rms_without_mm", "overlap_mm",
        "kerf_loss_mm", "kerf_loss_mm2",
    }  # fmt: skip


def test_a_closed_slit_costs_half_a_kerf_and_a_wide_gap_nothing():
    slit = pattern_figures(plan_for(NETS["closed slit"]))
    assert slit.kerf_loss == pytest.approx(0.5 * KERF, abs=1e-3)
    assert slit.kerf_loss_mm2 == pytest.approx(20.0 * KERF, rel=0.05)
    strip = pattern_figures(plan_for(NETS["strip"]))
    assert strip.kerf_loss < 1e-3
    assert strip.kerf_loss_mm2 < 0.05


def test_clips_are_there():
    """The plans of this file do clip something, or the tests of seams would say nothing."""
    whole = plan_for(NETS["cross"])
    hits = np.flatnonzero(~whole.sheet.frame_faces)[::7].tolist()
    assert any(isinstance(step, Clip) for step in plan_for(NETS["cross"], hits).steps)
