"""The swept region against points that are really moved through the sheet, and against the contact kernel."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st

from models.goals import goal_path
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.make_net import make_net
from planner.placement import place_net
from planner.plan_on_sheet import fold_on_sheet, tree_of_net
from planner.read_goal import read_goal
from planner.sheet_hits import sheet_hits, sheet_solids
from planner.substrate import make_sheet
from planner.swept_region import passage, swept_region
from tests.planner.fold_referee import turn_about
from tests.planner.hand_plans import LIMITS

THICKNESS = 0.1
coordinate = st.floats(-20.0, 20.0, allow_nan=False)
corners = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=3, max_size=3)


def passed(triangle, hinge, turn, steps=181):
    """(N, 2) places where sampled points of ``triangle`` are in the slab at sampled angles of the turn."""
    shares = [(i / 24, j / 24) for i in range(25) for j in range(25 - i)]
    points = np.array([u * triangle[0] + v * triangle[1] + (1 - u - v) * triangle[2] for u, v in shares])
    start = np.append(hinge[:2], 0.0)
    out = []
    for angle in np.linspace(0.0, turn, steps):
        pose = turn_about(start, start + np.append(hinge[2:], 0.0), angle)
        moved = points @ pose[:3, :3].T + pose[:3, 3]
        out.append(moved[np.abs(moved[:, 2]) <= 0.5 * THICKNESS, :2])
    return np.concatenate(out)


@example([(0.0, 0.0, -8.0), (0.0, -5.0, 1.0), (3.0, 0.0, 0.0)], math.pi, 1.0, 5.0, 0.0)
@given(corners, st.floats(-math.pi, math.pi), st.floats(0.0, 6.28), coordinate, coordinate)
def test_whatever_passes_is_covered(triangle, turn, heading, ox, oy):
    triangle = np.array(triangle)
    if np.abs(triangle[:, 2]).max() <= 1e-6 or abs(turn) < 1e-6:
        return  # it lies in its own place, or nothing moves
    hinge = np.array([ox, oy, math.cos(heading), math.sin(heading)])
    region = shapely.union_all(passage(triangle[None], hinge, turn, THICKNESS)).buffer(1e-6)
    assert shapely.intersects_xy(region, passed(triangle, hinge, turn, 61)).all()


def test_the_bound_is_tight():
    """A flap that stands at 90 degrees and tips over by 90 degrees sweeps its own shape, and no more."""
    flap = np.array([[[0.0, 0.0, 2.0], [10.0, 0.0, 2.0], [4.0, 0.0, 9.0]]])
    hinge = np.array([0.0, 0.0, 1.0, 0.0])
    region = shapely.union_all(passage(flap, hinge, math.radians(90.0), THICKNESS))
    landed = shapely.Polygon([(0.0, -2.0), (10.0, -2.0), (4.0, -9.0)])
    assert region.covers(landed)
    assert landed.buffer((THICKNESS + 0.01) / math.cos(math.pi / 8.0) + 0.01).covers(region)
    assert not passage(flap, hinge, math.radians(80.0), THICKNESS)
    back = shapely.union_all(passage(flap, hinge, math.radians(-90.0), THICKNESS))
    assert back.covers(shapely.Polygon([(0.0, 2.0), (10.0, 2.0), (4.0, 9.0)]))


def test_nothing_moves_nothing_swept():
    hinge = np.array([0.0, 0.0, 1.0, 0.0])
    assert passage(np.empty((0, 3, 3)), hinge, 1.0, THICKNESS) == []
    assert passage(np.ones((1, 3, 3)), hinge, 0.0, THICKNESS) == []


@pytest.fixture(scope="module", params=["star", "creature_coarse"])
def folded(request):
    net = place_net(make_net(read_goal(goal_path(request.param))), LIMITS)
    problem = FoldProblem(net.goal, edge_insets(net, LIMITS.thickness, LIMITS.clearance), LIMITS)
    sheet, tree = make_sheet(net, LIMITS), tree_of_net(net)
    return sheet, problem, tree, fold_on_sheet(net, sheet, problem, ()).result


def test_every_triangle_that_the_kernel_hits_is_crossed(folded):
    sheet, problem, tree, result = folded
    region = swept_region(tree, result, problem)
    hits = sheet_hits(tree, result, problem, sheet_solids(sheet, LIMITS.thickness))
    crossed = shapely.area(shapely.intersection(shapely.polygons(sheet.triangles[sorted(hits)]), region))
    assert (crossed > 0.0).all()
    # and none that is crossed broadly is missed
    every = shapely.intersection(shapely.polygons(sheet.triangles), region).tolist()
    broad = {t for t, part in enumerate(every) if not part.buffer(-2.0 * LIMITS.thickness).is_empty}
    assert broad <= set(hits)
