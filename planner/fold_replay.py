"""A plan played fold by fold, with the question whether another fold would be allowed at some moment."""

from __future__ import annotations

import math

import numpy as np

from planner.errors import PlanError
from planner.fold_plan import Bend, Clip, Fold, FoldPlan, Rotate, Step
from planner.fold_problem import FoldProblem
from planner.fold_state import FoldState
from planner.insets import edge_insets
from planner.plan_on_sheet import tree_of_net
from planner.sheet_hits import sheet_solids

__all__ = ["FoldReplay"]

_FLAT_RAD = 1e-9
_REACH_RAD = 1e-9


class FoldReplay:
    """The net of a plan in its sheet while the plan's steps are made, or others in their place.

    Args:
        plan: the plan; rules that it was made without are not asked.

    Raises:
        PlanError: if the plan bends substrate, which is not played here.
    """

    def __init__(self, plan: FoldPlan) -> None:
        self.plan, net = plan, plan.net
        if any(isinstance(step, Bend) for step in plan.steps):
            raise PlanError(
                "the plan bends substrate, which the replay of folds does not play: plan without bends"
            )
        problem = FoldProblem(
            net.goal, edge_insets(net, plan.limits.thickness, plan.limits.clearance), plan.limits,
            hidden_max=plan.hidden_max, without=plan.without,
        )  # fmt: skip
        bodies = sheet_solids(plan.sheet, plan.limits.thickness)
        if "substrate" in plan.without:
            bodies = bodies[:0]
        self._bodies = len(bodies)
        self.state = FoldState(problem, tree_of_net(net), bodies)
        self.rotary_rad = 0.0

    def copy(self) -> FoldReplay:
        """The same moment, to be played on independently."""
        twin = object.__new__(FoldReplay)
        twin.__dict__.update(self.__dict__)
        twin.state = self.state.copy()
        twin.state.present = self.state.present.copy()
        return twin

    def make(self, step: Step) -> None:
        """Make a step without asking."""
        if isinstance(step, Rotate):
            self.rotary_rad = step.to_rad
        elif isinstance(step, Clip) and self._bodies:
            faces = len(self.plan.net.faces)
            self.state.present[faces + np.array(step.faces, dtype=np.int64)] = False
        elif isinstance(step, Fold):
            self.state.turn(self.plan.net.child_of[step.crease], step.to_rad)

    def objection(self, fold: Fold) -> str:
        """The rule that forbids a fold now: ``outside-in``, ``side``, ``contact``, ``sight``, or nothing."""
        state, without = self.state, self.plan.without
        face = self.plan.net.child_of[fold.crease]
        change = fold.to_rad - float(state.angle[face])
        if abs(change) <= _FLAT_RAD:
            return ""
        inner = int(self.plan.net.parent[face])
        while inner >= 0 and "outside-in" not in without:
            if abs(float(state.angle[inner])) > _FLAT_RAD:
                return "outside-in"
            inner = int(self.plan.net.parent[inner])
        if "side" not in without and change * math.cos(self.rotary_rad) < 0.0:
            return "side"
        if state.problem.use_contact and state.contact(face, fold.to_rad).still >= 0:
            return "contact"
        if state.problem.use_sight:
            seen = float(state.views(face, fold.to_rad, np.array([self.rotary_rad]))[0, 0])
            if seen < abs(change) - _REACH_RAD:
                return "sight"
        return ""
