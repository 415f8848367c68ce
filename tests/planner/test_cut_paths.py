"""Cut lines: half a kerf outside, once for both sides of a slit, interrupted at tabs."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely

from planner.cut_paths import contour_lines, in_travel_order, polylines, split_at_tabs
from planner.fold_plan import Cut, Release
from planner.net_region import boundary_edges
from planner.placement import place_net
from tests.planner.hand_plans import LIMITS, plan_for, some_nets

NETS = {name: place_net(net, LIMITS) for name, net in some_nets().items()}
KERF = LIMITS.kerf


def cut_length(steps, kinds=(Cut,)):
    return sum(shapely.LineString(p).length for s in steps if isinstance(s, kinds) for p in s.paths)


@pytest.mark.parametrize("name", NETS)
def test_every_boundary_edge_is_cut_beside_all_of_its_length(name):
    net = NETS[name]
    lines = contour_lines(net, KERF)
    _, _, corners = boundary_edges(net)
    for start, end in net.vertices[corners]:
        for share in np.linspace(0.0, 1.0, 21):
            gap = lines.distance(shapely.Point(start + share * (end - start)))
            assert gap <= 0.5 * KERF + 1e-4


@pytest.mark.parametrize("name", NETS)
def test_the_beam_takes_nothing_from_a_face_beyond_half_a_kerf_and_crosses_no_crease(name):
    net = NETS[name]
    lines = contour_lines(net, KERF)
    cores = shapely.buffer(shapely.polygons(net.vertices[net.faces]), -0.5 * KERF)
    assert max(shapely.length(shapely.intersection(cores, lines))) < 1e-6
    joints = shapely.linestrings(net.vertices[net.edges[net.assignment != "B"]])
    middles = shapely.line_interpolate_point(joints, 0.5, normalized=True)
    if len(middles):
        assert shapely.distance(middles, lines).min() > 0.5 * KERF


@pytest.mark.parametrize("name", NETS)
def test_nothing_is_cut_twice(name):
    parts = list(shapely.get_parts(contour_lines(NETS[name], KERF)))
    for k, part in enumerate(parts):
        rest = shapely.MultiLineString(parts[:k] + parts[k + 1 :])
        assert part.intersection(rest.buffer(1e-4)).length < 0.05 * KERF
        assert part.is_simple


def test_a_closed_slit_is_cut_once_in_its_middle():
    """A flat fan of eight triangles cut along one radius: 8 chords outside, and the radius once."""
    net = NETS["closed slit"]
    chord = 2 * 20.0 * math.sin(math.pi / 8)
    length = contour_lines(net, KERF).length
    assert length == pytest.approx(8 * chord + 20.0, abs=8 * KERF)


def test_tabs_stay_and_release_cuts_them():
    for net in NETS.values():
        plan = plan_for(net)
        whole = contour_lines(plan.net, KERF)
        assert cut_length(plan.steps, (Cut, Release)) == pytest.approx(whole.length, abs=0.1)
        release = cut_length(plan.steps, (Release,))
        widths = [math.dist(tab.start, tab.end) + KERF for tab in plan.sheet.tabs]
        assert release == pytest.approx(sum(widths), abs=1e-3)


def test_without_tabs_everything_is_cut():
    lines = contour_lines(NETS["plate"], KERF)
    now, later = split_at_tabs(NETS["plate"], lines, (), KERF)
    assert now.equals(lines)
    assert later.is_empty
    assert polylines(later) == ()


def test_travel_order_keeps_every_path_and_shortens_the_way():
    rng = np.random.default_rng(3)
    ends = rng.uniform(0, 100, (40, 2, 2))
    paths = [tuple(map(tuple, p)) for p in ends.tolist()]
    ordered = in_travel_order(paths)
    assert {frozenset(p) for p in ordered} == {frozenset(p) for p in paths}
    assert len(ordered) == len(paths)

    def way(order):
        return sum(math.dist(a[-1], b[0]) for a, b in itertools.pairwise(order))

    assert way(ordered) < 0.6 * way(paths)
