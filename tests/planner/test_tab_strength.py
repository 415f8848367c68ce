"""What tabs carry: closed forms for one tab, laws of limit analysis, and the notice of a plan."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.fold_plan import Fold, MachineLimits, Tab
from planner.kinematics import folded_triangles
from planner.tab_strength import TabResistance, mass_centres, tab_notice, tab_strength
from tests.planner.hand_plans import plan_for, some_nets

LIMITS = MachineLimits()
DOWN = np.array([0.0, 0.0, 1.0])
NETS = some_nets()
place = st.floats(-40.0, 40.0)
vector = st.tuples(place, place, place).map(np.array)


def tab(x, width=1.0, y=0.0):
    return Tab(0, (x, y), (x + width, y))


def test_one_tab_bends_at_its_plastic_moment_per_width():
    """Centre of mass straight before the tab: bending only (and a little shear)."""
    share = TabResistance([tab(-1.0, 2.0)], LIMITS).share(np.array([0.0, 30.0, 0.0]), DOWN)
    shear = 4.0 * LIMITS.plastic_moment_n / LIMITS.thickness / math.sqrt(3.0) * 2.0
    assert share == pytest.approx(30.0 / (LIMITS.plastic_moment_n * 2.0) + 1.0 / shear, rel=1e-9)


def test_one_tab_twists_at_the_torque_of_a_sand_heap():
    share = TabResistance([tab(-1.0, 2.0)], LIMITS).share(np.array([30.0, 0.0, 0.0]), DOWN)
    stress = 4.0 * LIMITS.plastic_moment_n / LIMITS.thickness**2
    torque = stress / math.sqrt(3.0) * LIMITS.thickness**2 * (3.0 * 2.0 - LIMITS.thickness) / 6.0
    shear = stress / math.sqrt(3.0) * LIMITS.thickness * 2.0
    assert share == pytest.approx(30.0 / torque + 1.0 / shear, rel=1e-9)


@given(vector, vector, st.floats(0.0, 1.0))
def test_the_share_is_convex_and_even(one, other, part):
    resistance = TabResistance([tab(-8.0), tab(8.0, 2.0)], LIMITS)
    between = resistance.share(part * one + (1 - part) * other, DOWN)
    ends = resistance.share(one, DOWN), resistance.share(other, DOWN)
    assert between <= part * ends[0] + (1 - part) * ends[1] + 1e-6
    assert resistance.share(one, -DOWN) == pytest.approx(ends[0], rel=1e-6, abs=1e-9)


@given(vector)
def test_more_and_wider_tabs_carry_no_less(centre):
    few = TabResistance([tab(-8.0), tab(8.0)], LIMITS).share(centre, DOWN)
    more = TabResistance([tab(-8.0), tab(0.0), tab(8.0)], LIMITS).share(centre, DOWN)
    wide = TabResistance([tab(-8.5, 2.0), tab(7.5, 2.0)], LIMITS).share(centre, DOWN)
    assert more <= few + 1e-9
    assert wide <= few + 1e-9


@pytest.mark.parametrize("name", ["cross", "strip", "wedge"])
def test_centres_of_mass_follow_the_folds(name):
    plan = plan_for(NETS[name])
    net = plan.net
    angles = np.zeros(len(net.edges))
    corners = net.vertices[net.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    wanted = [area @ folded_triangles(net, angles).mean(axis=1) / area.sum()]
    for step in plan.steps:
        if isinstance(step, Fold):
            angles[step.crease] = step.to_rad
            wanted.append(area @ folded_triangles(net, angles).mean(axis=1) / area.sum())
    assert np.allclose(mass_centres(plan), wanted, atol=1e-9)


@pytest.mark.parametrize("name", ["cross", "strip", "wedge"])
@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0, math.pi])
def test_no_pose_at_no_rotary_angle_takes_more_than_is_said(name, angle):
    plan = plan_for(NETS[name])
    said = tab_strength(plan)
    resistance = TabResistance(plan.sheet.tabs, plan.limits)
    down = np.array([0.0, math.sin(angle), math.cos(angle)])
    if angle in (0.0, math.pi) or any(type(step).__name__ == "Rotate" for step in plan.steps):
        worst = max(resistance.share(centre, down) for centre in mass_centres(plan))
        assert said.weight_n * worst <= said.share * (1.0 + 1e-9)
    assert said.margin == pytest.approx(1.0 / said.share)


def test_a_heavy_part_is_told():
    plan = plan_for(NETS["cross"])
    assert tab_notice(plan) == ()
    heavy = replace(plan, limits=replace(plan.limits, weight_n_mm2=1e-1))
    (words,) = tab_notice(heavy)
    assert "the tabs may sag" in words
    assert tab_strength(heavy).share > 1.0


def test_without_tabs_nothing_holds():
    plan = plan_for(NETS["cross"])
    with pytest.raises(ValueError, match="no tabs"):
        tab_strength(replace(plan, sheet=replace(plan.sheet, tabs=())))
