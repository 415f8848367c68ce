"""Triangulation: covers the polygons exactly, conforms, keeps its bound on edges, is well shaped."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.triangulate import triangulate_polygons


def measures(vertices, faces):
    t = vertices[faces]
    edges = np.linalg.norm(np.roll(t, -1, axis=1) - t, axis=2)
    u, v = t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
    area = 0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return edges, area


def check(polygons, longest):
    vertices, faces, region = triangulate_polygons(polygons, longest)
    edges, area = measures(vertices, faces)
    assert (area > 0).all()
    assert edges.max() <= longest + 1e-6
    triangles = shapely.polygons(vertices[faces])
    for number, polygon in enumerate(polygons):
        own = triangles[region == number]
        assert shapely.area(own).sum() == pytest.approx(polygon.area, rel=1e-6, abs=1e-5)
        assert shapely.union_all(own).symmetric_difference(polygon).area < 1e-4 * polygon.area + 1e-4
    sides = {}
    for t, row in enumerate(faces.tolist()):
        for k in range(3):
            side = (row[k], row[(k + 1) % 3])
            assert side not in sides, "two triangles on one side of an edge"
            sides[side] = t
    return vertices, faces, region, sides


def test_a_ring_around_a_square_is_conforming_and_well_shaped():
    inner = shapely.box(-30, -20, 30, 20)
    hole = shapely.box(-8, -8, 8, 8)
    ring = shapely.box(-40, -30, 40, 30).difference(inner)
    vertices, faces, _, sides = check([ring, inner.difference(hole)], 8.0)
    edges, area = measures(vertices, faces)
    assert (edges.max(axis=1) ** 2 / area).max() < 12.0  # an equilateral triangle has 2.3, a right one 4
    # Every side without a neighbour lies on the outer border or on the hole.
    border = shapely.union_all([shapely.box(-40, -30, 40, 30).exterior, hole.exterior])
    for a, b in sides:
        if (b, a) not in sides:
            assert border.distance(shapely.Point(0.5 * (vertices[a] + vertices[b]))) < 1e-5


def test_no_needle_crosses_the_sheet():
    """A hole with many small sides in a large sheet: without inner points all triangles are needles."""
    angles = np.arange(120) * 2 * np.pi / 120
    gear = shapely.Polygon(
        [(r * np.cos(a), r * np.sin(a)) for a, r in zip(angles, [9, 10] * 60, strict=True)]
    )
    polygon = shapely.box(-60, -60, 60, 60).difference(gear)
    vertices, faces, _, _ = check([polygon], 10.0)
    edges, area = measures(vertices, faces)
    shape = edges.max(axis=1) ** 2 / area
    assert np.median(shape) < 4.0
    assert np.percentile(shape, 95) < 25.0


def test_the_result_does_not_depend_on_the_start_of_a_ring():
    points = [(0, 0), (20, 0), (22, 9), (11, 4), (3, 12)]
    results = []
    for k in range(len(points)):
        polygon = shapely.normalize(shapely.Polygon(points[k:] + points[:k]))
        results.append(triangulate_polygons([polygon], 4.0))
    for other in results[1:]:
        assert all(np.array_equal(a, b) for a, b in zip(results[0], other, strict=True))


@settings(max_examples=60)
@given(st.lists(st.tuples(st.floats(3.0, 20.0), st.floats(0.05, 1.0)), min_size=3, max_size=14), st.data())
def test_any_star_shaped_polygon(rays, data):
    steps = np.cumsum([share for _, share in rays])
    angles = 2 * np.pi * steps / (steps[-1] + 0.05)
    points = [(r * np.cos(a), r * np.sin(a)) for (r, _), a in zip(rays, angles, strict=True)]
    polygon = shapely.Polygon(points)
    assume(polygon.is_valid and polygon.area > 1.0)  # a gap of more than half a turn can make it cross itself
    polygon = shapely.set_precision(polygon, 1e-4)
    assume(polygon.geom_type == "Polygon")
    check([polygon], data.draw(st.sampled_from([2.5, 6.0, 40.0])))


def test_a_polygon_that_crosses_itself_is_refused():
    with pytest.raises(ValueError, match="not valid"):
        triangulate_polygons([shapely.Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])], 1.0)
