"""Sag is told where it matters, and only there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planner.fold_plan import Fold, Rotate
from planner.goal_mesh import GoalMesh
from tests.twin.hand_plans import breadth_first_net, plan_of, star
from tests.twin.test_dynamics import BLIND, run
from twin.events import Event
from twin.hinge_law import SheetMetal
from twin.sag_warnings import sag_warnings
from twin.validation import validate

VERY_SOFT = SheetMetal(2e8, 0.3, 265e6, 7900.0)


def long_flap():
    corners = np.array([[0, 0, 0], [20, 0, 0], [0, 30, 0], [20, -60, 1.0]])
    net = breadth_first_net(GoalMesh(corners, np.array([[0, 1, 2], [1, 0, 3]])))
    return plan_of(net, [Rotate(0.0), Fold(int(net.crease_of[1]), 1e-3)])


def test_stiff_parts_get_no_word() -> None:
    plan = plan_of(breadth_first_net(star()))
    assert sag_warnings(plan, run(plan, BLIND)) == ()
    assert validate(plan, draws=1).advice == ()


def test_a_crease_that_hangs_is_named_with_its_angle() -> None:
    plan = long_flap()
    result = run(plan, BLIND, metal=VERY_SOFT)
    told = sag_warnings(plan, result)
    crease = plan.steps[1].crease
    assert result.largest_sag_rad > np.radians(0.5)
    assert any(f"{crease} by -{np.degrees(result.largest_sag_rad):.2f}°" in text for text in told)
    assert any("mm rms off its goal" in text for text in told)
    assert all(text.startswith("sag: ") for text in told)


def test_loads_near_yield_touches_and_hidden_creases_are_told() -> None:
    plan = plan_of(breadth_first_net(star()))
    good = run(plan, BLIND)
    near = replace(good, yield_share=0.8)
    assert any("80 % of the load" in text for text in sag_warnings(plan, near))
    touch = Event("sag", 3, 1, (1, 2), depth_mm=0.4, detail="face 1 and face 2 meet")
    assert any("face 1 and face 2" in text for text in sag_warnings(plan, replace(good, noted=(touch,))))
    graze = replace(touch, depth_mm=0.02)
    assert sag_warnings(plan, replace(good, noted=(graze,))) == ()
    hidden = replace(touch, kind="occluded", depth_mm=0.0)
    assert any("1 crease is hidden" in text for text in sag_warnings(plan, replace(good, noted=(hidden,))))


def test_a_run_that_was_stopped_says_nothing_of_sag() -> None:
    plan = plan_of(breadth_first_net(star()))
    assert sag_warnings(plan, run(plan, replace(BLIND, largest_rate_rad_s=1e-3))) == ()
