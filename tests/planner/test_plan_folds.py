"""Whole plans: every rule replayed, the same bytes for the same seed, and what cannot be planned."""

import json
import math
import subprocess
import sys

import numpy as np
import pytest

from models.goals import goal_path
from planner.clearance import check_rotation_clearance
from planner.errors import NetError, PlanError
from planner.fold_file import write_fold
from planner.fold_plan import Clip, Cut, Fold, MachineLimits, Release, Rotate
from planner.goal_file import write_goal_ply
from planner.goal_mesh import GoalMesh
from planner.held_check import check_held
from planner.kinematics import folded_triangles
from planner.make_net import make_net
from planner.plan_file import plan_bytes, write_plan
from planner.plan_folds import plan_folds
from planner.read_goal import read_goal

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0), axis_height=180.0, lens_height=220.0)
HASHES = {"goal": "0" * 64, "net": "1" * 64, "rig": "2" * 64, "material": "3" * 64}


@pytest.fixture(autouse=True)
def short_search(monkeypatch):
    monkeypatch.setattr(sys.modules["planner.plan_folds"], "EVALUATION_BUDGET", 1200)
    monkeypatch.setattr(sys.modules["planner.plan_folds"], "SHEETS", 6)
    monkeypatch.setattr(sys.modules["planner.plan_folds"], "STARTS", 4)


def plan_of(name, **options):
    return plan_folds(make_net(read_goal(goal_path(name))), LIMITS, **options)


@pytest.mark.parametrize("name", ["bracket", "box_with_lid", "drone_frame", "star"])
def test_shipped_goals_fold_and_every_rule_holds(name, tmp_path, repository):
    plan = plan_of(name)
    assert plan.metrics.fold_completion > 0.95
    assert check_held(plan) == []
    assert check_rotation_clearance(plan) == []
    # the referee shares no code with the project
    write_goal_ply(plan.net.goal, tmp_path / "goal.ply")
    write_fold(plan.net, tmp_path / "net.fold")
    write_plan(plan, tmp_path / "plan.json", HASHES)
    referee = repository.parent / "shared" / "check" / "check_bundle.py"
    if not referee.is_file():
        pytest.skip("the independent referee is not beside the checkout")
    ran = subprocess.run(
        [sys.executable, str(referee), str(tmp_path)], capture_output=True, text=True, check=False
    )
    found = json.loads(ran.stdout)
    assert found["ok"], found
    assert found["fold_completion"] == pytest.approx(plan.metrics.fold_completion, abs=1e-9)
    assert found["shape_rms_mm"] == pytest.approx(plan.metrics.shape_rms, abs=1e-6)


def test_order_of_the_steps():
    plan = plan_of("box_with_lid")
    kinds = [type(step) for step in plan.steps]
    assert kinds[0] is Cut
    assert kinds[-1] is Release
    assert kinds.count(Release) == 1
    assert max(k for k, kind in enumerate(kinds) if kind in (Cut, Clip)) < kinds.index(Fold)
    assert sum(kind is Rotate for kind in kinds) == plan.metrics.rotations


def test_blocked_creases_and_metrics_agree_with_the_last_angles():
    plan = plan_of("flower", without=("sight",))
    angles, wanted = plan.final_angles, plan.net.fold_angle
    short = {e for e in range(len(wanted)) if abs(angles[e]) < abs(wanted[e]) - 1e-9}
    assert {blocked.crease for blocked in plan.blocked} == short
    share = np.minimum(np.abs(angles), np.abs(wanted)).sum() / np.abs(wanted).sum()
    assert plan.metrics.fold_completion == pytest.approx(share, abs=1e-12)
    posed, goal = folded_triangles(plan.net, angles), folded_triangles(plan.net, wanted)
    assert (plan.metrics.shape_rms < 1e-6) == (np.abs(posed - goal).max() < 1e-5)


def test_same_seed_same_bytes():
    one, other = plan_of("star", seed=3), plan_of("star", seed=3)
    assert plan_bytes(one, HASHES) == plan_bytes(other, HASHES)
    assert one.net.sha256 == other.net.sha256


def test_the_base_stays_where_the_user_put_it():
    goal = read_goal(goal_path("star"))
    net = make_net(goal, base_face=3)
    assert plan_folds(net, LIMITS, fixed_base=True).net.base_face == 3


def test_a_kept_net_is_folded_as_it_is():
    net = make_net(read_goal(goal_path("bracket")))
    plan = plan_folds(net, LIMITS, keep_net=True)
    assert np.array_equal(plan.net.parent, net.parent)
    assert np.array_equal(plan.net.faces, net.faces)


def test_a_plate_needs_no_fold():
    plate = GoalMesh([[0, 0, 0], [40, 0, 0], [40, 30, 0], [0, 30, 0]], [[0, 1, 2], [0, 2, 3]], "plate")
    plan = plan_folds(make_net(plate), LIMITS)
    assert not any(isinstance(step, Fold) for step in plan.steps)
    assert plan.metrics.fold_completion == 1.0
    assert check_held(plan) == []


def test_a_part_too_large_for_the_machine_is_refused_with_a_size_that_fits():
    small = MachineLimits(work_area=(60.0, 40.0))
    net = make_net(read_goal(goal_path("box_with_lid")))
    with pytest.raises(PlanError, match="--size"):
        plan_folds(net, small)


def test_no_room_to_turn_is_refused():
    net = make_net(read_goal(goal_path("box_with_lid")))
    low = MachineLimits(axis_height=20.0)
    with pytest.raises(PlanError, match="bed"):
        plan_folds(net, low)


def test_unknown_rule_and_bad_share():
    net = make_net(read_goal(goal_path("bracket")))
    with pytest.raises(ValueError, match="unknown rule 'gravity'; the rules are outside-in"):
        plan_folds(net, LIMITS, without=("gravity",))
    with pytest.raises(ValueError, match="hidden_max"):
        plan_folds(net, LIMITS, hidden_max=1.5)


def test_rules_that_the_planner_cannot_do_without_are_named():
    plan = plan_of("bracket", without=("side", "sight"))
    assert [notice for notice in plan.notices if "rule side is kept" in notice]
    assert not [notice for notice in plan.notices if "rule sight" in notice]
    assert plan.without == ("side", "sight")


def test_an_overlapping_net_is_refused():
    goal = read_goal(goal_path("creature_coarse"))
    with pytest.raises(NetError):
        plan_folds(make_net(goal, method="bfs"), LIMITS)


def test_a_budget_that_ends_the_search_is_told():
    plan = plan_of("flower", budget_s=0.0)
    assert plan.metrics.fold_completion == 1.0 or any("budget" in notice for notice in plan.notices)


def test_where_the_best_nets_cannot_be_held_another_one_is_cut(monkeypatch):
    """Every net that was improved on its sheet is refused; one that the search also found takes its place."""
    module = sys.modules["planner.plan_folds"]
    cut = module.plan_on_sheet
    refused = []

    def refuse_first(net, *others):
        if len(refused) < 3:
            refused.append(net)
            raise PlanError("the plan would drop the part: as this test has it")
        return cut(net, *others)

    monkeypatch.setattr(module, "plan_on_sheet", refuse_first)
    plan = plan_of("star")
    assert len(refused) == 3
    assert check_held(plan) == []
    assert all(plan.net is not net for net in refused)


def test_where_no_net_can_be_held_the_first_reason_is_told(monkeypatch):
    module = sys.modules["planner.plan_folds"]
    count = []

    def refuse(*_):
        count.append(len(count))
        raise PlanError(f"reason {len(count)}")

    monkeypatch.setattr(module, "plan_on_sheet", refuse)
    with pytest.raises(PlanError, match=r"reason 1$"):
        plan_of("bracket")
    assert len(count) > 1
