"""Whole plans of shipped goals, with sheet and tabs, for tests of heat in the net."""

from __future__ import annotations

from functools import cache

from models.goals import goal_path
from planner import make_net, read_goal
from planner.fold_plan import FoldPlan
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.placement import place_net
from planner.plan_on_sheet import plan_on_sheet
from planner.substrate import make_sheet
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig

__all__ = ["RIG", "STEEL", "shipped_plan"]

RIG, STEEL = load_rig("grbl-4axis"), load_material("304")


@cache
def shipped_plan(name: str) -> FoldPlan:
    """The plan of a goal in ``models/goals``: its net folded once, as it comes, without a search."""
    limits = machine_limits(RIG, STEEL)
    net = place_net(make_net(read_goal(goal_path(name))), limits, 0.0)
    problem = FoldProblem(net.goal, edge_insets(net, limits.thickness, limits.clearance), limits)
    return plan_on_sheet(net, make_sheet(net, limits), problem, 0, (), ())
