"""Planners to compare with: figures worked out by hand, contact by an independent sampler, seeds."""

import math
from dataclasses import replace

import fcl
import numpy as np
import pytest

from planner.errors import PlanError
from planner.first_block import FirstBlockProblem
from planner.fold_plan import Fold, MachineLimits
from planner.fold_problem import BY_ORDER, FoldProblem
from planner.goal_mesh import GoalMesh
from planner.insets import edge_insets
from planner.joint_space_planner import LEVELS, MotionPlannerProblem
from planner.linear_folding import JointMotion, uniform_rates
from planner.make_net import make_net
from planner.motion_baselines import FOLD_METHODS, PLANNING_METHODS, fold_method
from planner.plan_on_sheet import _blocked, tree_of_net
from tests.planner import hand_nets
from tests.planner.contact_reference import PRISM_FACES, body, touch
from tests.planner.fold_referee import broken_rules, poses
from tests.planner.goal_shapes import random_hull, rough_ball

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0), axis_height=180.0, lens_height=220.0)
CLEARANCE = LIMITS.clearance


def tray():
    """A box without a lid: every wall stands on the floor by 90 degrees, or hangs on a wall that does."""
    box = hand_nets.box_goal(20.0, 30.0, 10.0)
    return make_net(GoalMesh(box.vertices, box.faces[[k for k in range(12) if k not in (2, 3)]], "tray"))


def strip_of(angles_deg, panel=20.0, width=10.0):
    """A strip of rectangles folded by the given angles, laid out from its first face."""
    points, heading = [np.zeros(2)], 0.0
    for turn in [*angles_deg, 0.0]:
        points.append(points[-1] + panel * np.array([math.cos(heading), math.sin(heading)]))
        heading += math.radians(turn)
    v = [(p[0], y, p[1]) for p in points for y in (0.0, width)]
    faces = [
        f
        for k in range(len(angles_deg) + 1)
        for f in ([2 * k, 2 * k + 2, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 1])
    ]
    goal = GoalMesh(np.array(v), np.array(faces), "strip")
    parent = [-1, 0]  # the two triangles of panel k are faces 2k and 2k + 1; the second hangs on panel k - 1
    for k in range(1, len(angles_deg) + 1):
        parent += [2 * k + 1, 2 * k - 2]
    return hand_nets.net_from_parents(goal, parent)


def problem_of(net, kind=FoldProblem, limits=LIMITS, **options):
    return kind(net.goal, edge_insets(net, limits.thickness, limits.clearance), limits, **options)


@pytest.mark.parametrize("name", [name for name in FOLD_METHODS if name != "rrt-connect"])
def test_a_tray_folds_whole_by_every_method(name):
    result = fold_method(name)(tray(), LIMITS, budget_s=1.0)
    assert result.completion == pytest.approx(1.0, abs=1e-12)
    assert result.shape_rms < 1e-6
    assert (result.plan is not None) == (name in PLANNING_METHODS)
    assert result.stopped_by == ""


def test_methods_that_turn_all_at_once_keep_one_rule_only():
    result = fold_method("linear")(tray(), LIMITS)
    assert result.rules == ("contact",)
    assert result.clipped_area is None
    assert fold_method("mp")(tray(), LIMITS, budget_s=1.0).rules[:4] == (
        "outside-in",
        "side",
        "sight",
        "contact",
    )


def test_linear_folding_of_a_curl_stops_where_the_ends_meet():
    # three creases of 100 degrees, four panels of 20 mm: the goal crosses itself. Linear folding turns all of
    # them by a; panel 4 reaches panel 1 when the square closes, a little before a = 90 degrees
    net = strip_of([100.0, 100.0, 100.0])
    result = fold_method("linear")(net, LIMITS)
    touching = math.degrees(np.abs(result.angles).max())
    assert 87.0 < touching < 90.5
    assert result.completion == pytest.approx(touching / 100.0, rel=1e-9)
    assert "touch" in result.stopped_by
    assert fold_method("uniform")(net, LIMITS).completion == pytest.approx(result.completion, abs=1e-9)
    assert fold_method("linear")(net, LIMITS, without=("contact",)).completion == 1.0


def test_uniform_folding_arrives_early_where_angles_are_small():
    net = strip_of([30.0, 90.0])
    tree = tree_of_net(net)
    rates = uniform_rates(tree.target)
    moving = np.abs(tree.target) > 0
    assert np.degrees(rates[moving]) == pytest.approx([90.0, 90.0])
    # the touching share does not matter: half-way the small crease is there already
    half = np.minimum(np.abs(tree.target), 0.5 * rates)
    assert sorted(np.degrees(half[moving])) == pytest.approx([30.0, 45.0])


def test_first_block_stops_everything_else():
    # the outer crease has to turn by 150 degrees: straight light shows it up to 90.5 degrees only
    net = strip_of([40.0, 40.0, 150.0])
    flips = replace(LIMITS, max_tilt_rad=0.0)
    problem = problem_of(net, FirstBlockProblem, flips)
    result = problem.fold(tree_of_net(net))
    reached = np.degrees(np.abs(result.reached[result.reached != 0.0]))
    assert reached == pytest.approx([90.5], abs=0.1)
    assert result.completion == pytest.approx(90.5 / 230.0, abs=1e-3)
    assert sorted(result.cause[result.cause != 0].tolist()) == [2, BY_ORDER, BY_ORDER]
    assert sorted(blocked.by for blocked in _blocked(net, result, np.arange(0))) == [
        "order",
        "order",
        "sight",
    ]
    # the motion planner stands at the last whole level below, and cannot go on either
    mp = problem_of(net, MotionPlannerProblem, flips, budget_s=0.2).fold(tree_of_net(net))
    level = math.floor(90.5 / 150.0 * LEVELS) * 150.0 / LEVELS
    assert mp.completion == pytest.approx(level / 230.0, abs=1e-9)
    # the fold planner gives the crease up and folds the others
    greedy = problem_of(net, FoldProblem, flips).fold(tree_of_net(net))
    assert greedy.completion == pytest.approx((40.0 + 40.0 + 90.5) / 230.0, abs=0.01)


@pytest.mark.parametrize("kind", [FirstBlockProblem, MotionPlannerProblem])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_turns_one_at_a_time_keep_every_rule(kind, seed):
    net = make_net(rough_ball(16, seed, 0.4))
    tree = tree_of_net(net)
    options = {"budget_s": 0.3, "seed": seed} if kind is MotionPlannerProblem else {}
    result = problem_of(net, kind, **options).fold(tree)
    assert (
        broken_rules(tree, result, clearance=CLEARANCE, hidden_max=0.05, max_tilt=LIMITS.max_tilt_rad) == []
    )
    assert 0.0 < result.completion <= 1.0


def pairs_in_contact(tree, problem, angles):
    """Pairs of faces whose prisms meet in a pose, by python-fcl."""
    flat = problem.solids(tree)
    at = poses(tree, angles)
    bodies = [
        body(flat[f, :6] @ at[f, :3, :3].T + at[f, :3, 3], PRISM_FACES) for f in range(len(tree.parent))
    ]
    manager = fcl.DynamicAABBTreeCollisionManager()
    manager.registerObjects(bodies)
    manager.setup()
    if not _any(manager):
        return []
    return [
        (a, b)
        for a in range(len(bodies))
        for b in range(a)
        if tree.parent[a] != b and tree.parent[b] != a and touch(bodies[a], bodies[b])
    ]


def _any(manager):
    data = fcl.CollisionData()
    manager.collide(data, fcl.defaultCollisionCallback)
    return data.result.is_collision


@pytest.mark.parametrize("name", ["linear", "uniform"])
@pytest.mark.parametrize("seed", [1, 4, 5])
def test_nothing_touches_on_the_way_all_at_once(name, seed):
    net = make_net(rough_ball(14, seed, 0.5))
    tree, problem = tree_of_net(net), problem_of(net)
    result = fold_method(name)(net, LIMITS)
    rates = np.abs(tree.target) if name == "linear" else uniform_rates(tree.target)
    share = max((np.abs(result.angles) / np.maximum(rates, 1e-9)).max(), 1e-9)
    for k in range(121):
        angles = np.sign(tree.target) * np.minimum(np.abs(tree.target), rates * share * k / 120)
        assert pairs_in_contact(tree, problem, angles) == []
    if result.completion < 1.0 - 1e-9:
        # a little further something does meet: the motion was not stopped for nothing
        found = []
        for more in np.linspace(0.0, 0.05, 26):
            angles = np.sign(tree.target) * np.minimum(np.abs(tree.target), rates * (share + more))
            found += pairs_in_contact(tree, problem, angles)
        assert found


def test_a_joint_motion_is_as_free_as_samples_say():
    net = make_net(rough_ball(12, 8, 0.3))
    tree, problem = tree_of_net(net), problem_of(net)
    motion = JointMotion(problem, tree)
    rng = np.random.default_rng(5)
    stopped = 0
    for _ in range(12):
        start = np.zeros(len(tree.target))
        end = tree.target * rng.uniform(0.5, 3.0, len(start)) * rng.choice([-1.0, 1.0], len(start))
        found = motion.free(start, end)
        stopped += found.face >= 0
        for share in np.linspace(0.0, found.share, 60):
            assert pairs_in_contact(tree, problem, start + share * (end - start)) == []
        if found.face >= 0:
            beyond = np.linspace(found.share, min(1.0, found.share + 0.01), 20)
            hits = [pairs_in_contact(tree, problem, start + s * (end - start)) for s in beyond]
            assert any(hits), found
    assert stopped


@pytest.mark.parametrize("name", ["mp", "first-block", "linear"])
def test_same_seed_same_result(name):
    net = make_net(random_hull(12, 3))
    one, other = (fold_method(name)(net, LIMITS, seed=7, budget_s=0.2) for _ in range(2))
    assert one.angles.tobytes() == other.angles.tobytes()
    assert one.completion == other.completion
    if one.plan is not None:
        assert one.plan.steps == other.plan.steps


def test_the_motion_planner_never_folds_more_with_a_rule_than_the_goal_allows():
    net = make_net(rough_ball(14, 2, 0.4))
    tree = tree_of_net(net)
    free = problem_of(net, MotionPlannerProblem, without=("sight", "contact"), budget_s=0.5).fold(tree)
    assert free.completion == 1.0
    for without in ((), ("sight",), ("contact",)):
        result = problem_of(net, MotionPlannerProblem, without=without, budget_s=0.3).fold(tree)
        assert result.completion <= free.completion
        assert (np.abs(result.reached) <= np.abs(tree.target) + 1e-12).all()


def test_more_work_never_makes_the_motion_planner_worse():
    net = make_net(rough_ball(20, 6, 0.5))
    tree = tree_of_net(net)
    shares = [
        problem_of(net, MotionPlannerProblem, seed=1, budget_s=budget).fold(tree).completion
        for budget in (0.01, 0.05, 0.3)
    ]
    assert shares == sorted(shares)


def test_plans_of_the_motion_planner_are_whole_plans():
    plan = fold_method("mp")(tray(), LIMITS, budget_s=0.5).plan
    assert sum(isinstance(step, Fold) for step in plan.steps) >= 4
    assert plan.blocked == ()


def test_unknown_names_and_rules():
    with pytest.raises(PlanError, match="did you mean 'linear'"):
        fold_method("liner")
    for name in ("mp", "linear", "first-block"):
        with pytest.raises(ValueError, match="unknown rule 'gravity'"):
            fold_method(name)(tray(), LIMITS, without=("gravity",))


def test_rrt_connect_finds_the_tray_and_repeats_itself():
    pytest.importorskip("ompl", reason="an option: pip install 'metal-blossom[ompl]'")
    one, other = (fold_method("rrt-connect")(tray(), LIMITS, seed=3, budget_s=2.0) for _ in range(2))
    assert one.completion == 1.0
    assert one.angles.tobytes() == other.angles.tobytes()


def test_rrt_connect_without_ompl_says_what_to_install(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "ompl", None)
    with pytest.raises(PlanError, match=r"metal-blossom\[ompl\]"):
        fold_method("rrt-connect")(tray(), LIMITS)
