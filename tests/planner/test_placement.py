"""Placement: rigid, centred, narrowest across the axis, refused in words."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.errors import PlanError
from planner.fold_plan import MachineLimits
from planner.placement import GAP_MM, place_net, sheet_extent
from tests.planner.hand_nets import bfs_parents, box_goal, cross_net, net_from_parents, rerooted
from tests.planner.hand_plans import some_nets

LIMITS = MachineLimits()
NETS = some_nets()


def bounds(net):
    points = net.vertices[np.unique(net.faces)]
    return points.min(axis=0), points.max(axis=0)


def turned(net, angle, shift):
    c, s = np.cos(angle), np.sin(angle)
    return replace(net, vertices=net.vertices @ np.array([[c, -s], [s, c]]).T + shift)


@pytest.mark.parametrize("name", NETS)
def test_the_net_is_moved_rigidly_and_centred(name):
    net = NETS[name]
    placed = place_net(net, LIMITS)
    before, after = net.vertices, placed.vertices
    distances = [np.linalg.norm(v[:, None] - v[None], axis=2) for v in (before, after)]
    assert np.abs(distances[0] - distances[1]).max() < 1e-9
    a, b, c = (after[net.faces[:, k]] for k in range(3))
    assert ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0] > 0).all()  # no mirror
    low, high = bounds(placed)
    assert np.abs(low + high).max() < 1e-9
    for key in ("faces", "parent", "edges", "assignment", "fold_angle", "crease_of"):
        assert np.array_equal(getattr(net, key), getattr(placed, key))


@pytest.mark.parametrize("name", NETS)
def test_no_other_turn_is_narrower(name):
    net = NETS[name]
    low, high = bounds(place_net(net, LIMITS))
    for angle in np.radians(np.arange(0.0, 180.0, 0.25)):
        points = turned(net, angle, np.zeros(2)).vertices[np.unique(net.faces)]
        assert np.ptp(points[:, 1]) >= high[1] - low[1] - 1e-6


@given(st.floats(-3, 3), st.floats(-50, 50), st.floats(-50, 50))
def test_where_the_net_lay_before_does_not_matter(angle, x, y):
    net = NETS["strip"]
    one = bounds(place_net(net, LIMITS))[1]
    other = bounds(place_net(turned(net, angle, np.array([x, y])), LIMITS))[1]
    assert one == pytest.approx(other, abs=1e-6)


def test_the_axis_can_be_given():
    net = NETS["strip"]
    for axis in (0.0, 0.4, np.pi / 2):
        placed = place_net(net, LIMITS, axis)
        a, b = net.vertices[:2], placed.vertices[:2]
        before, after = a[1] - a[0], b[1] - b[0]
        turn = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
        assert np.exp(1j * turn) == pytest.approx(np.exp(-1j * axis), abs=1e-9)


def test_the_sheet_fits_where_only_a_turn_across_fits():
    """The narrowest turn of a long strip is too long for the area; it has to stand across the axis."""
    net = NETS["strip"]
    low, high = bounds(place_net(net, LIMITS))
    long, narrow = high - low
    room = 2 * (GAP_MM + LIMITS.frame_margin)
    across = replace(LIMITS, work_area=(narrow + room + 0.01, long + room + 0.01))
    extent = sheet_extent(place_net(net, across), across)
    assert (np.ptp(extent, axis=0) <= np.array(across.work_area) + 1e-9).all()


def test_too_large_a_net_is_refused_with_the_largest_size_that_fits():
    small = replace(LIMITS, work_area=(100.0, 80.0))
    with pytest.raises(PlanError, match=r"needs .* mm .* work area is 100 x 80 mm") as caught:
        place_net(cross_net(40.0), small)
    size = float(re.search(r"--size ([\d.]+)", str(caught.value))[1])
    place_net(cross_net(size), small)  # fits
    with pytest.raises(PlanError):
        place_net(cross_net(size + 0.2), small)


def test_a_work_area_smaller_than_the_frame_is_named_as_such():
    with pytest.raises(PlanError, match="too small for any net"):
        place_net(cross_net(), replace(LIMITS, work_area=(25.0, 25.0)))


def test_the_same_net_gives_the_same_bytes():
    goal = box_goal()
    nets = [net_from_parents(goal, rerooted(bfs_parents(goal), 2)) for _ in range(2)]
    assert place_net(nets[0], LIMITS).sha256 == place_net(nets[1], LIMITS).sha256
