"""The planners behind one interface with one result: the fold planner and what it is compared with."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from planner.candidate import axis_angles, cost
from planner.errors import PlanError
from planner.fold_plan import FoldPlan, MachineLimits
from planner.fold_problem import RULES, FoldProblem, shape_rms
from planner.insets import edge_insets
from planner.kinematics import folded_triangles
from planner.lost_folds import foldable_share
from planner.net import Net
from planner.pattern_check import with_pattern
from planner.placement import place_net
from planner.plan_on_sheet import plan_on_sheet, tree_of_net
from planner.substrate import make_sheet

__all__ = ["FOLD_METHODS", "PLANNING_METHODS", "FoldMethod", "MotionResult", "fold_method"]


@dataclass(frozen=True, eq=False)
class MotionResult:
    """How far one method folds a net.

    Attributes:
        method: name in ``FOLD_METHODS``.
        completion: sum of reached over sum of wanted angles (1 if nothing is to be folded).
        shape_rms: root mean square distance of the face corners to the goal after the best rigid fit, mm.
        angles: (F,) angle reached at the crease of each face, rad.
        rules: names of the rules that held, out of ``planner.fold_problem.RULES``.
        stopped_by: what ended it, in words; empty if everything is folded.
        plan: the whole plan; None for a method whose motion is no plan for a laser.
    """

    method: str
    completion: float
    shape_rms: float
    angles: NDArray[np.float64]
    rules: tuple[str, ...]
    stopped_by: str = ""
    plan: FoldPlan | None = None

    @property
    def clipped_area(self) -> float | None:
        """Area of the sheet that is clipped, mm²; None without a plan."""
        return None if self.plan is None else self.plan.metrics.clipped_area

    @property
    def clipped_faces(self) -> int | None:
        """Substrate triangles that are clipped; None without a plan."""
        return None if self.plan is None else self.plan.metrics.clipped_faces

    @property
    def rotations(self) -> int | None:
        """How often the rotary turns; None without a plan."""
        return None if self.plan is None else self.plan.metrics.rotations


class FoldMethod(Protocol):
    """A method folds one given net under given limits as far as it can.

    ``seed`` is that of every random choice, ``budget_s`` are nominal seconds that are counted as work (None:
    the method's own), ``without`` names rules that are switched off.

    Raises:
        PlanError: if the sheet does not fit the machine, or the part cannot be held or turned.
        ValueError: if a rule is unknown.
    """

    def __call__(
        self,
        net: Net,
        limits: MachineLimits,
        *,
        seed: int = 0,
        budget_s: float | None = None,
        hidden_max: float = 0.05,
        without: Collection[str] = (),
    ) -> MotionResult:
        """Fold ``net``."""
        ...


def fold_planner(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,  # noqa: ARG001  one net takes milliseconds
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """The fold planner on this net as it is: ready list, postponement, least-loss concession."""
    from planner.plan_folds import plan_folds

    plan = plan_folds(net, limits, seed=seed, keep_net=True, hidden_max=hidden_max, without=without)
    return _of_plan("fp", plan)


def fold_planner_with_search(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """The fold planner with its search over nets: starts from ``net``, may fold another net of the goal.

    Here ``budget_s`` is a limit by the clock, as in ``plan_folds``.
    """
    from planner.plan_folds import plan_folds

    plan = plan_folds(net, limits, seed=seed, budget_s=budget_s, hidden_max=hidden_max, without=without)
    return _of_plan("fp-search", plan)


def first_block(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,  # noqa: ARG001  one pass only
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """Outside-in in one fixed order, deepest creases first, until the first one is stopped."""
    from planner.first_block import FirstBlockProblem

    def problem(insets: NDArray[np.float64]) -> FoldProblem:
        return FirstBlockProblem(net.goal, insets, limits, hidden_max=hidden_max, without=without)

    return _of_plan("first-block", _plan_with(problem, net, limits, seed, without))


def motion_planner(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """The traditional motion planner, see ``planner.joint_space_planner``."""
    from planner.joint_space_planner import MotionPlannerProblem

    def problem(insets: NDArray[np.float64]) -> FoldProblem:
        return MotionPlannerProblem(
            net.goal, insets, limits, hidden_max=hidden_max, without=without, seed=seed, budget_s=budget_s
        )

    return _of_plan("mp", _plan_with(problem, net, limits, seed, without))


def _all_at_once(method: str, rates_of: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> FoldMethod:
    """A method that turns all creases at once, each at its rate, until two faces touch."""

    def fold(
        net: Net,
        limits: MachineLimits,
        *,
        seed: int = 0,  # noqa: ARG001  nothing is chosen
        budget_s: float | None = None,  # noqa: ARG001  one motion only
        hidden_max: float = 0.05,
        without: Collection[str] = (),
    ) -> MotionResult:
        from planner.linear_folding import JointMotion

        _check_rules(without)
        tree = tree_of_net(net)
        insets = edge_insets(net, limits.thickness, limits.clearance)
        motion = JointMotion(
            FoldProblem(net.goal, insets, limits, hidden_max=hidden_max, without=without), tree
        )
        rates = rates_of(tree.target)
        share, words = 1.0, ""
        if "contact" not in without:
            touch = motion.free(np.zeros(len(tree.target)), tree.target, rates)
            share = touch.share
            if touch.face >= 0:
                words = f"faces {touch.other} and {touch.face} touch after {share:.1%} of the motion"
        angles = np.sign(tree.target) * np.minimum(np.abs(tree.target), rates * share)
        return _of_angles(method, net, angles, words, without)

    return fold


def _rrt_connect(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """OMPL's RRT-Connect over the joint space, see ``planner.rrt_connect``."""
    from planner.linear_folding import JointMotion
    from planner.rrt_connect import best_of_rrt_connect

    _check_rules(without)
    tree = tree_of_net(net)
    if "contact" in without:
        return _of_angles("rrt-connect", net, tree.target, "", without)
    insets = edge_insets(net, limits.thickness, limits.clearance)
    motion = JointMotion(FoldProblem(net.goal, insets, limits, hidden_max=hidden_max), tree)
    angles, words = best_of_rrt_connect(motion, seed, budget_s)
    return _of_angles("rrt-connect", net, angles, words, without)


def linear_folding(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """All creases at once, each over the whole motion, until two faces touch."""
    from planner.linear_folding import linear_rates

    fold = _all_at_once("linear", linear_rates)
    return fold(net, limits, seed=seed, budget_s=budget_s, hidden_max=hidden_max, without=without)


def uniform_folding(
    net: Net,
    limits: MachineLimits,
    *,
    seed: int = 0,
    budget_s: float | None = None,
    hidden_max: float = 0.05,
    without: Collection[str] = (),
) -> MotionResult:
    """All creases at once, all equally fast, until two faces touch."""
    from planner.linear_folding import uniform_rates

    fold = _all_at_once("uniform", uniform_rates)
    return fold(net, limits, seed=seed, budget_s=budget_s, hidden_max=hidden_max, without=without)


FOLD_METHODS: Mapping[str, FoldMethod] = MappingProxyType(
    {
        "fp": fold_planner,
        "fp-search": fold_planner_with_search,
        "mp": motion_planner,
        "first-block": first_block,
        "linear": linear_folding,
        "uniform": uniform_folding,
        "rrt-connect": _rrt_connect,
    }
)
"""Name of every method and the method."""

PLANNING_METHODS = ("fp", "fp-search", "mp", "first-block")
"""Methods that give a plan for a laser; the others turn many creases at once and only report."""


def fold_method(name: str) -> FoldMethod:
    """The method called ``name``.

    Raises:
        PlanError: if there is none; the message lists them, the nearest name first.
    """
    if name in FOLD_METHODS:
        return FOLD_METHODS[name]
    near = difflib.get_close_matches(name, FOLD_METHODS, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    raise PlanError(f"unknown planner {name!r}; {hint}choose one of {', '.join(FOLD_METHODS)}")


def _plan_with(
    problem_of: Callable[[NDArray[np.float64]], FoldProblem],
    net: Net,
    limits: MachineLimits,
    seed: int,
    without: Collection[str],
) -> FoldPlan:
    """A whole plan of ``net`` by another planner, the rotary axis where the fold planner folds most."""
    _check_rules(without)
    problem = problem_of(edge_insets(net, limits.thickness, limits.clearance))
    greedy = FoldProblem(
        net.goal, problem.insets, limits, hidden_max=problem.hidden_max, without=tuple(without)
    )
    start, end = net.vertices[net.faces[net.base_face, :2]]
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    best: tuple[float, Net] | None = None
    for axis in axis_angles(greedy):
        try:
            placed = place_net(net, limits, heading + axis)
        except PlanError:
            continue
        weight = cost(greedy.fold(tree_of_net(placed)), greedy)
        if best is None or weight < best[0]:
            best = weight, placed
    placed = place_net(net, limits) if best is None else best[1]
    sheet = make_sheet(placed, limits)
    return with_pattern(plan_on_sheet(placed, sheet, problem, seed, tuple(sorted(without)), ()))


def _of_plan(method: str, plan: FoldPlan) -> MotionResult:
    """The result that is a plan."""
    angles = np.zeros(len(plan.net.faces))
    creased = plan.net.crease_of >= 0
    angles[creased] = plan.final_angles[plan.net.crease_of[creased]]
    short = len(plan.blocked)
    causes = sorted({blocked.by for blocked in plan.blocked})
    return MotionResult(
        method=method,
        completion=plan.metrics.fold_completion,
        shape_rms=plan.metrics.shape_rms,
        angles=angles,
        rules=tuple(rule for rule in RULES if rule not in plan.without),
        stopped_by=f"{short} creases stay short: {', '.join(causes)}" if short else "",
        plan=plan,
    )


def _of_angles(
    method: str, net: Net, angles: NDArray[np.float64], words: str, without: Collection[str]
) -> MotionResult:
    """The result of a motion of all creases at once."""
    target = tree_of_net(net).target
    wanted = np.abs(target).sum()
    folded = float(np.minimum(np.abs(angles), np.abs(target)).sum() / wanted) if wanted else 1.0
    of_edge = np.zeros(len(net.edges))
    creased = net.crease_of >= 0
    of_edge[net.crease_of[creased]] = angles[creased]
    return MotionResult(
        method=method,
        completion=foldable_share(net) * folded,
        shape_rms=shape_rms(folded_triangles(net, of_edge), net.goal.vertices[net.goal.faces]),
        angles=angles,
        rules=() if "contact" in without else ("contact",),
        stopped_by=words,
    )


def _check_rules(without: Collection[str]) -> None:
    unknown = sorted(set(without) - set(RULES))
    if unknown:
        raise ValueError(f"unknown rule {unknown[0]!r}; the rules are {', '.join(RULES)}")
