"""Rules that are no contact: each breach is named for what it is, at its step; clean plans have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.fold_plan import Clip, Cut, Fold, FoldPlan, Release, Rotate
from tests.planner.hand_plans import plan_for, some_nets
from tests.twin.hand_plans import box, breadth_first_net, icosahedron, outside_in_steps, plan_of, star
from twin.rule_check import rule_events
from twin.validation import validate

NETS = some_nets()


def whole(name: str) -> FoldPlan:
    """A plan with cuts, tabs and release; hand nets may fold into what is no contact here."""
    return replace(plan_for(NETS[name]), without=())


@pytest.mark.parametrize("name", ["cross", "strip", "plate"])
def test_clean_plans_break_no_rule(name: str) -> None:
    assert rule_events(whole(name)) == ()


def test_folding_the_inner_crease_first_breaks_outside_in() -> None:
    net = breadth_first_net(icosahedron())
    folds = [s for s in outside_in_steps(net) if isinstance(s, Fold)]
    plan = plan_of(net, [Rotate(np.pi), *folds[::-1]])  # convex: all of them mountains
    events = rule_events(plan)
    assert events and {e.rule for e in events} == {"outside-in"}
    first = events[0]
    done = [s.crease for s in plan.steps[: first.step] if isinstance(s, Fold)]
    child = first.faces[0]
    inner = []
    face = int(net.parent[child])
    while face != net.base_face:
        inner.append(int(net.crease_of[face]))
        face = int(net.parent[face])
    assert set(inner) & set(done)
    assert f"crease {first.crease} turns while" in first.detail
    assert rule_events(replace(plan, without=("held", "outside-in"))) == ()


@pytest.mark.parametrize("name", ["cross", "strip", "wedge"])
def test_the_wrong_side_is_named(name: str) -> None:
    plan = whole(name)
    number = next(n for n, s in enumerate(plan.steps) if isinstance(s, Fold))
    fold = plan.steps[number]
    assert isinstance(fold, Fold)
    side = np.pi if fold.to_rad > 0.0 else 0.0
    turned = (*plan.steps[:number], Rotate(side), *plan.steps[number:])
    first = rule_events(replace(plan, steps=turned))[0]
    assert (first.rule, first.step, first.crease) == ("side", number + 1, fold.crease)
    assert f"the beam lights the {'bottom' if side else 'top'} side" in first.detail
    assert validate(replace(plan, steps=turned), draws=1).events[0].kind in ("rule", "occluded", "contact")


def test_too_much_tilt_is_named() -> None:
    plan = whole("strip")
    number = next(n for n, s in enumerate(plan.steps) if isinstance(s, Fold))
    most = plan.limits.max_tilt_rad
    for tilt, bad in ((most, False), (most + 0.01, True), (-most - 0.01, True)):
        steps = (*plan.steps[:number], Rotate(tilt), *plan.steps[number:])
        found = {e.rule for e in rule_events(replace(plan, steps=steps))}
        assert ("tilt" in found) is bad


def test_a_crease_that_was_not_cut_free_is_held() -> None:
    plan = whole("cross")
    uncut = tuple(s for s in plan.steps if not isinstance(s, Cut))
    events = rule_events(replace(plan, steps=uncut))
    first = next(n for n, s in enumerate(uncut) if isinstance(s, Fold))
    assert any(e.rule == "held" and e.step == first for e in events)
    assert any("still joined" in e.detail for e in events)


def test_a_part_that_is_never_cut_free_is_told() -> None:
    plan = whole("cross")
    steps = tuple(s for s in plan.steps if not isinstance(s, Release))
    (event,) = rule_events(replace(plan, steps=steps))
    assert (event.rule, event.step) == ("held", len(steps) - 1)
    assert "never releases" in event.detail


def test_clipping_what_holds_the_part_is_told() -> None:
    plan = whole("cross")
    first = next(n for n, s in enumerate(plan.steps) if isinstance(s, Fold))
    steps = (
        *plan.steps[:first],
        Clip((int(np.flatnonzero(plan.sheet.frame_faces)[0]),)),
        *plan.steps[first:],
    )
    events = rule_events(replace(plan, steps=steps))
    assert any(e.rule == "held" and e.step == first and "clamped frame" in e.detail for e in events)


def test_a_part_that_hits_the_bed_while_it_is_turned() -> None:
    net = breadth_first_net(box(20, 30, 60))
    plan = plan_of(net)
    low = replace(plan, limits=replace(plan.limits, axis_height=15.0, lens_height=15.0))
    steps = (*low.steps, Rotate(np.pi))
    events = rule_events(replace(low, steps=steps))
    assert events and {e.rule for e in events} == {"clearance"}
    assert any("into the bed" in e.detail or "into the lens" in e.detail for e in events)


def test_a_broken_rule_alone_is_the_verdict() -> None:
    plan = plan_of(breadth_first_net(star()), without=())
    result = validate(plan, draws=1)
    assert result.verdict == "rule"
    assert {e.rule for e in result.events} == {"held"}
    assert validate(replace(plan, without=("held",)), draws=1).verdict == "pass"
