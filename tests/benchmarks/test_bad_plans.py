"""A fast sample of the benchmark of bad plans: convex and not, each kind, each caught for what it is."""

from __future__ import annotations

import math
from functools import cache

import pytest

from benchmarks.bad_plans import BOUND_RAD, KINDS, bad_plans, first_contact, judged, the_limits
from models.goals import goal_path
from planner import make_net, plan_folds, read_goal
from planner.fold_plan import FoldPlan
from twin.mjcf_model import compile_model
from twin.rule_check import rule_events
from twin.sweep import kinematic_sweep

GOALS = ("bracket", "flower", "star", "crown")


@cache
def good(name: str) -> FoldPlan:
    return plan_folds(make_net(read_goal(goal_path(name))), the_limits(), budget_s=1.0)


@pytest.mark.parametrize("name", GOALS)
def test_good_plans_raise_no_alarm(name: str) -> None:
    plan = good(name)
    assert first_contact(plan) is None
    assert rule_events(plan) == ()
    assert kinematic_sweep(compile_model(plan), plan).events == ()


def test_bad_plans_are_caught_for_what_they_are() -> None:
    plans = [(name, bad) for name in GOALS for bad in bad_plans(good(name), 2, 1)]
    assert {bad.kind for _, bad in plans} == set(KINDS)
    assert sum(bad.contact is not None for _, bad in plans) >= 5
    for name, bad in plans:
        wrong, difference = judged(bad)
        assert wrong == [], f"{name}, {bad.kind}: {wrong}"
        assert difference <= BOUND_RAD < math.radians(0.26)
