"""Whole plans of shipped goals, with sheet and tabs, for tests of heat in the net."""

from __future__ import annotations

from functools import cache

from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from planner.fold_plan import FoldPlan
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig

__all__ = ["RIG", "STEEL", "shipped_plan"]

RIG, STEEL = load_rig("grbl-4axis"), load_material("304")


@cache
def shipped_plan(name: str) -> FoldPlan:
    """The plan of a goal in ``models/goals``, its net folded as it comes."""
    net = make_net(read_goal(goal_path(name)))
    return plan_folds(net, machine_limits(RIG, STEEL), keep_net=True)
