"""The shipped goal shapes go through the planner."""

from __future__ import annotations

import numpy as np
import pytest

from models.goals import goal_names, goal_path
from planner.make_net import make_net
from planner.overlap import overlapping_faces
from planner.plan_folds import plan_folds
from planner.read_goal import read_goal
from rigs.limits import machine_limits
from rigs.material import load_material
from rigs.rig import load_rig
from tests.models.test_goals import load

LIMITS = machine_limits(load_rig("grbl-4axis"), load_material("304"))


@pytest.mark.parametrize("name", goal_names())
def test_shape_is_read_as_it_is(name):
    goal = read_goal(goal_path(name))
    mesh = load(name)
    assert goal.notices == ()
    assert goal.faces.tolist() == mesh.faces.tolist()
    assert np.abs(goal.vertices - mesh.vertices).max() < 1e-12


@pytest.mark.parametrize("name", goal_names())
def test_shape_has_a_net_without_overlap(name):
    net = make_net(read_goal(goal_path(name)))
    assert overlapping_faces(net) == []
    assert net.certificate.faces_left_out == 0


@pytest.mark.parametrize(
    "name", ["antenna", "box_with_lid", "bracket", "bug_robot", "crown", "drone_frame", "flower", "star"]
)
def test_small_shape_folds_whole(name):
    plan = plan_folds(make_net(read_goal(goal_path(name))), LIMITS, seed=0)
    assert plan.metrics.fold_completion == pytest.approx(1.0, abs=1e-9)
    assert plan.metrics.shape_rms < 1e-4
    assert plan.blocked == ()
