"""The substrate: all of the sheet but net and kerf, triangles of bounded edges, a frame all around."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from planner.errors import PlanError
from planner.fold_plan import MachineLimits
from planner.placement import GAP_MM, place_net
from planner.substrate import EDGE_MM, EDGE_SHARE, make_sheet
from tests.planner.hand_plans import LIMITS, some_nets

NETS = some_nets()


@pytest.fixture(scope="module", params=list(NETS))
def placed(request):
    return place_net(NETS[request.param], LIMITS)


@pytest.fixture(scope="module")
def sheet(placed):
    return make_sheet(placed, LIMITS)


def union(polygons):
    return shapely.union_all(shapely.polygons(polygons), grid_size=1e-7)


def test_no_triangle_lies_on_the_net(placed, sheet):
    """The measure of the independent check of bundles: less than 1e-3 mm2 of any pair."""
    faces, triangles = shapely.polygons(placed.vertices[placed.faces]), shapely.polygons(sheet.triangles)
    i, j = shapely.STRtree(faces).query(triangles)
    assert shapely.area(shapely.intersection(triangles[i], faces[j])).max(initial=0.0) < 1e-6


def test_net_kerf_and_substrate_make_up_the_sheet(placed, sheet):
    outline, net, metal = (
        shapely.Polygon(sheet.outline),
        union(placed.vertices[placed.faces]),
        union(sheet.triangles),
    )
    wide = shapely.buffer(net, 3.0 * LIMITS.kerf, join_style="mitre")
    assert metal.difference(outline).area < 1e-6
    assert outline.difference(wide).difference(metal).area < 1e-2  # nothing is forgotten away from the net
    near = metal.intersection(shapely.buffer(net, 0.8 * LIMITS.kerf, quad_segs=32))
    assert near.area < 0.02 * LIMITS.kerf * net.length  # and nothing reaches into the kerf


def test_triangles_do_not_overlap_and_are_counter_clockwise(sheet):
    t = sheet.triangles
    u, v = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    area = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    assert (area > 0.0).all()
    assert union(t).area == pytest.approx(area.sum(), rel=1e-6)


def test_no_edge_is_longer_than_the_bound_and_most_triangles_are_well_shaped(sheet):
    t = sheet.triangles
    edges = np.linalg.norm(np.roll(t, -1, axis=1) - t, axis=2)
    bound = max(EDGE_MM, EDGE_SHARE * np.ptp(sheet.outline, axis=0).max())
    assert edges.max() <= bound + 1e-4
    u, v = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    shape = edges.max(axis=1) ** 2 / (0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]))
    assert np.median(shape) < 4.0
    assert np.percentile(shape, 90) < 8.0


def test_the_frame_is_the_outer_strip(placed, sheet):
    frame = union(sheet.triangles[sheet.frame_faces])
    outline = shapely.Polygon(sheet.outline)
    strip = outline.difference(outline.buffer(-LIMITS.frame_margin, join_style="mitre"))
    assert frame.symmetric_difference(strip).area < 1e-3
    assert frame.distance(union(placed.vertices[placed.faces])) >= GAP_MM - 1e-3


def test_frame_and_substrate_share_their_corners(sheet):
    """One conforming mesh: there is a way over edges from the frame to all of the metal."""
    owner = {(r[k], r[(k + 1) % 3]): t for t, r in enumerate(sheet.faces.tolist()) for k in range(3)}
    reached = set(np.flatnonzero(sheet.frame_faces).tolist())
    stack = list(reached)
    while stack:
        row = sheet.faces[stack.pop()].tolist()
        for k in range(3):
            other = owner.get((row[(k + 1) % 3], row[k]))
            if other is not None and other not in reached:
                reached.add(other)
                stack.append(other)
    area = shapely.area(shapely.polygons(sheet.triangles))
    assert area[sorted(reached)].sum() > 0.999 * area.sum()


def test_the_axis_runs_through_the_middle(sheet):
    assert np.array_equal(sheet.rotary_axis[:, 1], [0.0, 0.0])
    assert sheet.outline.mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-4)


@pytest.mark.parametrize("kerf", [0.0, 0.03, 0.4])
def test_other_kerfs(kerf):
    limits = replace(LIMITS, kerf=kerf)
    for net in NETS.values():
        placed = place_net(net, limits)
        faces = shapely.polygons(placed.vertices[placed.faces])
        metal = union(make_sheet(placed, limits).triangles)
        assert shapely.area(shapely.intersection(faces, metal)).max() < 1e-6


def test_a_rig_without_a_frame_is_refused():
    limits = MachineLimits(frame_margin=0.0)
    with pytest.raises(PlanError, match="frame_margin"):
        make_sheet(place_net(NETS["plate"], limits), limits)
