"""Folds asked one by one: what the planner planned is allowed, what breaks a rule is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.errors import PlanError
from planner.fold_plan import Bend, Fold, FoldPlan, Rotate
from planner.fold_replay import FoldReplay
from tests.twin.thermal_plans import shipped_plan


@pytest.fixture(scope="module", params=["bracket", "crown", "flower"])
def plan(request) -> FoldPlan:
    return shipped_plan(request.param)


def test_every_fold_of_a_plan_is_allowed_where_it_stands(plan):
    replay = FoldReplay(plan)
    for step in plan.steps:
        if isinstance(step, Fold):
            assert replay.objection(step) == ""
        replay.make(step)
    for crease, face in plan.net.child_of.items():
        assert replay.state.angle[face] == plan.final_angles[crease]


def test_broken_rules_are_named(plan):
    replay = FoldReplay(plan)
    first = next(s for s in plan.steps if isinstance(s, Fold))
    for step in plan.steps[: plan.steps.index(first)]:
        replay.make(step)
    assert replay.objection(Fold(first.crease, -first.to_rad)) == "side"
    assert replay.objection(Fold(first.crease, 0.0)) == ""
    turned = replay.copy()
    turned.make(Rotate(replay.rotary_rad + np.pi))
    assert turned.objection(first) == "side"
    assert replay.objection(first) == ""
    assert FoldReplay(replace(plan, without=("side", "sight"))).objection(Fold(first.crease, -0.01)) == ""
    folded = replay.copy()
    folded.make(first)
    net = plan.net
    outer = [
        c
        for c, f in net.child_of.items()
        if f in net.subtree[net.child_of[first.crease]] and c != first.crease
    ]
    if outer:
        assert folded.objection(Fold(outer[0], np.copysign(0.1, first.to_rad))) == "outside-in"
    assert replay.state.angle[net.child_of[first.crease]] == 0.0


def test_a_fold_through_metal_is_contact():
    plan = shipped_plan("crown")
    replay = FoldReplay(replace(plan, without=("sight", "side")))
    first = next(s for s in plan.steps if isinstance(s, Fold))
    assert replay.objection(Fold(first.crease, np.radians(179.9))) in ("contact", "")
    named = {
        replay.objection(Fold(c, s * np.radians(179.99))) for c in plan.net.child_of for s in (1.0, -1.0)
    }
    assert "contact" in named


def test_bent_substrate_is_refused(plan):
    bent = replace(plan, steps=(Bend((0,), ((0.0, 0.0), (1.0, 0.0)), 0.3), *plan.steps))
    with pytest.raises(PlanError, match="bends substrate"):
        FoldReplay(bent)
