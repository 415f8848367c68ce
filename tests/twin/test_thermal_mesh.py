"""Meshes for the flow of heat: conforming, as fine as asked for, cuts closed, tabs open."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.fold_plan import Clip
from tests.rigs.made_jobs import made_plan
from tests.twin.thermal_plans import shipped_plan
from twin.thermal_mesh import crease_line, net_mesh, plan_mesh, refined

SQUARE = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def areas(vertices, triangles):
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def smallest_angle(vertices, triangles):
    corners = vertices[triangles]
    u = np.roll(corners, -1, axis=1) - corners
    v = np.roll(corners, 1, axis=1) - corners
    cos = (u * v).sum(axis=2) / np.linalg.norm(u, axis=2) / np.linalg.norm(v, axis=2)
    return np.arccos(np.clip(cos, -1, 1)).min()


def boundary(triangles):
    ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    sides, count = np.unique(ends, axis=0, return_counts=True)
    assert count.max() <= 2
    return sides[count == 1]


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0, 30), st.floats(0, 30)), min_size=3, max_size=9, unique=True),
    st.floats(0.8, 20.0),
)
def test_bisection_keeps_the_area_the_outline_and_half_the_smallest_angle(points, longest):
    from scipy.spatial import Delaunay, QhullError

    vertices = np.array(points)
    try:
        triangles = Delaunay(vertices).simplices.astype(np.int64)
    except QhullError:
        return
    flipped = areas(vertices, triangles) < 0
    triangles[flipped] = triangles[flipped][:, ::-1]
    if areas(vertices, triangles).min() < 0.5:
        return
    fine, cells = refined(vertices, triangles, longest)
    assert np.array_equal(fine[: len(vertices)], vertices)
    assert areas(fine, cells).min() > 0.0
    assert areas(fine, cells).sum() == pytest.approx(areas(vertices, triangles).sum())
    ends = fine[np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).max() <= longest * (1 + 1e-9)
    assert smallest_angle(fine, cells) >= 0.5 * smallest_angle(vertices, triangles) - 1e-9
    # conforming: no vertex hangs on a side, so the outline keeps its length
    lengths = [
        sum(np.linalg.norm(v[a] - v[b]) for a, b in boundary(t))
        for v, t in ((vertices, triangles), (fine, cells))
    ]
    assert lengths[1] == pytest.approx(lengths[0])


def test_a_length_that_is_none_is_refused():
    with pytest.raises(ValueError, match="above 0"):
        refined(SQUARE, HALVES, 0.0)


def test_the_net_is_joined_along_creases_only():
    plan = made_plan("star")
    net = plan.net
    mesh = net_mesh(net, 3.0)
    assert areas(mesh.vertices, mesh.triangles).sum() == pytest.approx(areas(net.vertices, net.faces).sum())
    cut = sum(
        np.linalg.norm(np.subtract(*net.vertices[e]))
        for e, a in zip(net.edges, net.assignment, strict=True)
        if a == "B"
    )
    outline = sum(np.linalg.norm(np.subtract(*mesh.vertices[e])) for e in boundary(mesh.triangles))
    assert outline == pytest.approx(cut)
    for face in net.child_of.values():
        on, weight = crease_line(mesh, *net.hinge(face), len(mesh.vertices))
        assert weight.sum() == pytest.approx(1.0)
        assert len(on) >= np.linalg.norm(np.subtract(*net.hinge(face))) / 3.0
    with pytest.raises(ValueError, match="no triangle side"):
        crease_line(mesh, np.array([900.0, 0.0]), np.array([990.0, 0.0]), len(mesh.vertices))


def test_the_sheet_hangs_on_the_tabs_and_its_frame_is_clamped():
    plan = shipped_plan("crown")
    alone, mesh = net_mesh(plan.net, 3.0), plan_mesh(plan, 3.0)
    inner = len(alone.vertices)
    assert np.array_equal(mesh.vertices[:inner], alone.vertices)
    assert len(mesh.links) == 5 * len(plan.sheet.tabs) > 0
    assert (mesh.links[:, 0] < inner).all()
    assert (mesh.links[:, 1] >= inner).all()
    assert (mesh.link_ratio > 0.0).all()
    assert not mesh.clamped[:inner].any()
    assert mesh.clamped.any()
    clipped = [f for s in plan.steps if isinstance(s, Clip) for f in s.faces]
    kept = np.setdiff1d(np.arange(len(plan.sheet.faces)), clipped)
    outer = areas(mesh.vertices, mesh.triangles).sum() - areas(alone.vertices, alone.triangles).sum()
    assert outer == pytest.approx(areas(plan.sheet.vertices, plan.sheet.faces[kept]).sum())
