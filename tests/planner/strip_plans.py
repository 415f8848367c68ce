"""Strips of squares, each turned by an angle against the one before, and plans of such nets."""

import math

import numpy as np

from planner.fold_plan import MachineLimits
from planner.fold_problem import FoldProblem
from planner.goal_mesh import GoalMesh
from planner.insets import edge_insets
from planner.net import Net
from planner.placement import place_net
from planner.plan_on_sheet import plan_on_sheet
from planner.substrate import make_sheet
from tests.planner import hand_nets


def limits(tilt_deg):
    return MachineLimits(max_tilt_rad=math.radians(tilt_deg))


def strip_goal(angles_deg, *, step=12.0, width=10.0):
    """A strip of squares, each turned by the next angle against the one before; fold signs as given."""
    points, heading = [np.zeros(2)], 0.0
    for angle in (0.0, *angles_deg):
        heading += math.radians(angle)
        points.append(points[-1] + step * np.array([math.cos(heading), math.sin(heading)]))
    v = [(p[0], y, p[1]) for p in points for y in (0.0, width)]
    faces = [
        f
        for k in range(len(points) - 1)
        for f in ([2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1])
    ]
    return GoalMesh(np.array(v), np.array(faces), name="strip")


def plan_net(net: Net, tilt_deg: float, axis_rad=None, **options):
    limit = limits(tilt_deg)
    placed = place_net(net, limit, axis_rad)
    problem = FoldProblem(net.goal, edge_insets(net, limit.thickness, limit.clearance), limit, **options)
    return plan_on_sheet(placed, make_sheet(placed, limit), problem, 0, tuple(options.get("without", ())), ())


def strip_plan(angles_deg, tilt_deg, base=0, **options):
    goal = strip_goal(angles_deg)
    net = hand_nets.net_from_parents(goal, hand_nets.bfs_parents(goal, base))
    start, end = next(net.hinge(f) for f in net.order[1:] if net.assignment[net.crease_of[f]] != "F")
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    return plan_net(net, tilt_deg, heading, **options)
