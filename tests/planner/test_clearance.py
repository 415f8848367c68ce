"""Heights during a rotation in closed form, against dense sampling, and the replay over plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.clearance import check_rotation_clearance, height_range, rotation_clearance
from planner.fold_plan import MachineLimits, Rotate
from tests.planner.hand_plans import plan_for, some_nets

NETS = some_nets()
angle = st.floats(-7.0, 7.0)
place = st.floats(-80.0, 80.0)


def sampled(point, start, end, count=4001):
    angles = np.linspace(start, end, count)
    heights = point[1] * np.sin(angles) + point[2] * np.cos(angles)
    return heights.min(), heights.max()


@given(st.tuples(place, place, place), angle, angle)
def test_the_extremes_of_a_turning_point(point, start, end):
    low, high = height_range(np.array([point]), start, end)
    by_samples = sampled(point, start, end)
    radius = np.hypot(point[1], point[2])
    coarse = radius * (abs(end - start) / 4000) ** 2  # what sampling can miss
    assert low[0] <= by_samples[0] + 1e-9
    assert high[0] >= by_samples[1] - 1e-9
    assert low[0] == pytest.approx(by_samples[0], abs=coarse + 1e-9)
    assert high[0] == pytest.approx(by_samples[1], abs=coarse + 1e-9)


@given(st.tuples(place, place, place), angle, angle)
def test_turning_back_needs_the_same_room(point, start, end):
    there, back = (height_range(np.array([point]), *ends) for ends in ((start, end), (end, start)))
    assert there[0] == back[0]
    assert there[1] == back[1]


def test_a_full_turn_needs_the_swept_radius():
    points = np.array([[5.0, 3.0, 4.0], [0.0, -6.0, 0.0]])
    limits = MachineLimits(axis_height=10.0, lens_height=20.0)
    left = rotation_clearance(points, limits)
    assert left.to_bed_mm == pytest.approx(10.0 - 6.0)
    assert left.to_lens_mm == pytest.approx(20.0 - 6.0)
    assert left.margin_mm == pytest.approx(4.0)


def test_a_small_turn_needs_less_than_the_radius():
    points = np.array([[0.0, 10.0, 0.0]])
    limits = MachineLimits(axis_height=50.0, lens_height=50.0)
    left = rotation_clearance(points, limits, 0.0, np.radians(30.0))
    assert left.to_lens_mm == pytest.approx(45.0)
    assert left.to_bed_mm == pytest.approx(50.0)


def test_nothing_needs_no_room():
    assert rotation_clearance(np.zeros((0, 3)), MachineLimits(axis_height=7.0)).to_bed_mm == 7.0


def test_a_plan_with_room_passes_and_one_without_is_refused_for_bed_and_lens():
    plan = plan_for(NETS["cross"])
    assert any(isinstance(step, Rotate) for step in plan.steps)
    assert check_rotation_clearance(plan) == []
    half_depth = plan.sheet.outline[:, 1].max()  # the sheet alone sweeps this far at a flip
    flat = 0.5 * plan.limits.thickness
    for key, word in (("axis_height", "the bed"), ("lens_height", "the lens")):
        enough = replace(plan, limits=replace(plan.limits, **{key: half_depth + flat + 1e-6}))
        assert check_rotation_clearance(enough) == []
        tight = replace(plan, limits=replace(plan.limits, **{key: half_depth + flat - 0.5}))
        problems = check_rotation_clearance(tight)
        assert problems
        assert all(f"0.50 mm into {word}" in line for line in problems)


def test_the_folded_part_counts_from_the_rotation_after_its_fold_on():
    """A tall strip sweeps more once it stands up: a rotation afterwards fails, one before does not."""
    plan = plan_for(NETS["strip"])
    reach = plan.sheet.outline[:, 1].max() + 0.5
    last = len(plan.steps) - 1
    late = (*plan.steps[:last], Rotate(np.pi / 2), Rotate(0.0), plan.steps[last])
    roomy = replace(plan, steps=late)
    assert check_rotation_clearance(roomy) == []
    from planner.kinematics import folded_triangles

    points = folded_triangles(plan.net, plan.final_angles).reshape(-1, 3)
    radius = np.hypot(points[:, 1], points[:, 2]).max()
    if radius > reach:
        low = replace(roomy, limits=replace(plan.limits, lens_height=0.5 * (radius + reach)))
        assert all(int(line.split()[1].rstrip(":")) >= last for line in check_rotation_clearance(low))


def test_an_unplaced_net_is_refused():
    plan = plan_for(NETS["plate"])
    moved = replace(plan.sheet, rotary_axis=plan.sheet.rotary_axis + np.array([0.0, 3.0]))
    with pytest.raises(ValueError, match="y = 0"):
        check_rotation_clearance(replace(plan, sheet=moved))
