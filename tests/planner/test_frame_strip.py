"""The frame as the search sees it is the frame of the sheet that is made in the end."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from models.goals import goal_path
from planner.candidate import flat_tree
from planner.dual_graph import DualGraph
from planner.fold_plan import MachineLimits
from planner.fold_problem import FoldProblem
from planner.frame_strip import LONGEST_MM, frame_strip
from planner.insets import edge_insets
from planner.make_net import make_net
from planner.nearly_blooming import nearly_blooming
from planner.placement import place_net
from planner.plan_on_sheet import tree_of_net
from planner.read_goal import read_goal
from planner.sheet_hits import sheet_solids
from planner.substrate import make_sheet

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0), axis_height=180.0, lens_height=220.0)
GOAL = read_goal(goal_path("star"))
GRAPH = DualGraph(GOAL)


def both_frames(base, axis_rad):
    """The tree of a net with its strip, and the placed net with the frame of its sheet."""
    attempt = nearly_blooming(GRAPH, base, seed=0)
    if not attempt.is_net:
        return None
    tree = flat_tree(attempt.layout, axis_rad)
    net = attempt.layout.to_net()
    start, end = net.vertices[net.faces[net.base_face, :2]]
    placed = place_net(net, LIMITS, math.atan2(end[1] - start[1], end[0] - start[0]) + axis_rad)
    sheet = make_sheet(placed, LIMITS)
    frame = sheet_solids(sheet, LIMITS.thickness)[sheet.frame_faces]
    return tree, frame_strip(tree, LIMITS), placed, frame


def footprint(solids, axes):
    """Union of the middle triangles in the frame of ``axes``, its lower left corner at the origin."""
    import shapely

    region = shapely.union_all(shapely.polygons(solids[:, 6:9, :2] @ axes.T))
    low = np.array(region.bounds[:2])
    return shapely.transform(region, lambda points: points - low)


@settings(max_examples=12, deadline=None)
@given(base=st.integers(0, len(GOAL.faces) - 1), axis_rad=st.floats(0.0, math.pi))
def test_the_strip_covers_the_frame_and_nothing_else(base, axis_rad):
    found = both_frames(base, axis_rad)
    if found is None:
        return
    tree, strip, _, frame = found
    axes = np.array([tree.axis, [-tree.axis[1], tree.axis[0]]])
    own, wanted = footprint(strip, axes), footprint(frame, np.eye(2))
    assert own.symmetric_difference(wanted).area < 0.1  # mm2: the sheet rounds to 1e-4 mm
    assert np.ptp(strip[:, 6:9, :2] @ axes.T, axis=1).max() <= LONGEST_MM + 1e-9
    assert np.abs(strip[:, :6, 2]).max() == pytest.approx(0.5 * LIMITS.thickness)


@pytest.mark.parametrize("base", [0, 3, 7, 11])
def test_a_net_folds_in_the_strip_as_in_the_frame_of_its_sheet(base):
    found = both_frames(base, 0.4)
    assert found is not None
    tree, strip, placed, frame = found
    problem = FoldProblem(GOAL, edge_insets(make_net(GOAL), LIMITS.thickness, LIMITS.clearance), LIMITS)
    early = problem.fold(tree, obstacles=strip)
    late = problem.fold(tree_of_net(placed), obstacles=frame)
    assert early.completion == pytest.approx(late.completion, abs=2e-3)


def test_what_stands_inside_the_net_stops_it():
    found = both_frames(0, 0.4)
    assert found is not None
    tree, strip, _, _ = found
    problem = FoldProblem(GOAL, edge_insets(make_net(GOAL), LIMITS.thickness, LIMITS.clearance), LIMITS)
    shrunk = strip.copy()
    shrunk[:, :, :2] *= 0.2
    assert problem.fold(tree, obstacles=shrunk).completion < problem.fold(tree, obstacles=strip).completion
