"""Creases that are held back so that others go further: folding them, and what the plan says of them."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest

from models.goals import goal_path
from planner.angle_repair import let_go, repaired
from planner.candidate import flat_tree, judge
from planner.cures import Effort
from planner.diagnose import diagnose
from planner.dual_graph import DualGraph
from planner.fold_plan import MachineLimits
from planner.fold_problem import HELD_BACK, FoldProblem
from planner.fold_trials import Workbench
from planner.insets import edge_insets
from planner.nearly_blooming import nearly_blooming
from planner.plan_file import read_plan, write_plan
from planner.plan_on_sheet import fold_on_sheet, plan_on_sheet
from planner.read_goal import read_goal
from tests.planner.strip_plans import strip_plan
from tests.planner.test_fold_problem import problem_of

QUICK = Effort(creases=3, shared=300, each=300, axes=3, sheets=1, states=200, failures=True)


def test_holding_back_is_folding_to_a_smaller_angle():
    problem, layouts = problem_of("cone")
    tree = flat_tree(layouts[0], 0.3)
    plain = problem.fold(tree)
    nothing = problem.fold(tree, back=np.zeros(len(tree.parent)))
    assert nothing.steps.tobytes() == plain.steps.tobytes()
    assert np.array_equal(nothing.cause, plain.cause)
    creases = np.flatnonzero((tree.target != 0.0) & (plain.cause == 0))
    rng = np.random.default_rng(1)
    for face in creases.tolist():
        back = np.zeros(len(tree.parent))
        back[face] = rng.uniform(0.1, 1.2) * abs(tree.target[face])
        target = tree.target.copy()
        target[face] = math.copysign(max(0.0, abs(target[face]) - back[face]), target[face])
        held, smaller = problem.fold(tree, back=back), problem.fold(replace(tree, target=target))
        assert held.reached == pytest.approx(smaller.reached, abs=1e-12)
        assert held.shape_rms == pytest.approx(smaller.shape_rms, abs=1e-9)
        if smaller.cause[face] == 0:
            assert held.cause[face] == HELD_BACK
            assert held.stopped_at[face] == abs(held.reached[face]) == pytest.approx(abs(target[face]))
        missing = np.abs(tree.target) - np.minimum(np.abs(held.reached), np.abs(tree.target))
        assert held.completion == pytest.approx(1.0 - missing.sum() / np.abs(tree.target).sum())
        assert held.completion < 1.0


def test_a_crease_that_is_held_back_says_so_and_what_it_would_cost_to_fold_it(tmp_path):
    diagnosed = diagnose(strip_plan((70.0, 150.0, -40.0), 0.0), QUICK)
    crease, cure = next(
        (b.crease, c) for b in diagnosed.blocked for c in b.diagnosis.cures if c.kind == "unfold"
    )
    bench = Workbench(diagnosed)
    back = np.zeros(len(bench.tree.parent))
    other = diagnosed.net.child_of[cure.crease]
    back[other] = cure.value
    net, sheet = diagnosed.net, diagnosed.sheet
    folded = fold_on_sheet(net, replace(sheet, tabs=()), bench.problem, (), back=back)
    plan = plan_on_sheet(net, replace(sheet, tabs=()), bench.problem, 0, (), (), folded)
    found = {b.crease: b for b in diagnose(plan, QUICK).blocked}
    assert crease not in found
    held = found[cure.crease]
    assert held.by == held.diagnosis.cause == "room"
    assert abs(held.wanted_rad) - abs(held.reached_rad) == pytest.approx(cure.value)
    assert plan.metrics.shape_rms == pytest.approx(cure.shape_rms, abs=1e-6)
    (restored,) = held.diagnosis.cures
    assert restored.kind == "restore"
    assert restored.completion == pytest.approx(diagnosed.metrics.fold_completion, abs=1e-9)
    assert restored.shape_rms == pytest.approx(diagnosed.metrics.shape_rms, abs=1e-6)
    write_plan(diagnose(plan, QUICK), tmp_path / "plan.json", {})
    again = {b.crease: b for b in read_plan(tmp_path / "plan.json", net).blocked}
    assert again[cure.crease].by == again[cure.crease].diagnosis.cause == "room"


@pytest.fixture(scope="module")
def held():
    """A net with a crease held back much further than its neighbour needs, and another for nothing."""
    diagnosed = diagnose(strip_plan((70.0, 150.0, -40.0), 0.0), QUICK)
    bench = Workbench(diagnosed)
    cure = next(c for b in diagnosed.blocked for c in b.diagnosis.cures if c.kind == "unfold")
    needed = int(bench.layout.crease[diagnosed.net.child_of[cure.crease]])
    useless = next(
        edge for edge in np.flatnonzero(bench.layout.tree).tolist()
        if edge != needed and not bench.layout.graph.flat[edge]
    )  # fmt: skip
    back = np.zeros(len(bench.layout.tree))
    back[needed], back[useless] = cure.value + 0.3, 0.2
    axis = bench.axis_of(bench.layout)
    return bench.problem, judge(bench.layout, bench.problem, axis, back=back), needed, useless


def test_what_is_held_back_for_nothing_is_let_go(held):
    problem, candidate, needed, useless = held
    freed = let_go(candidate, problem)
    assert freed.cost < candidate.cost
    assert freed.back[useless] == 0.0
    assert freed.back[needed] < candidate.back[needed]
    assert np.array_equal(freed.layout.tree, candidate.layout.tree)
    again = judge(freed.layout, problem, freed.axis_rad, after=freed.after, back=freed.back)
    assert again.cost == freed.cost
    assert let_go(freed, problem).cost <= freed.cost


def test_a_net_that_holds_nothing_back_has_nothing_to_let_go(held):
    problem, candidate, _, _ = held
    plain = judge(candidate.layout, problem, candidate.axis_rad)
    assert let_go(plain, problem) is plain


def test_repair_holds_back_what_is_in_the_way_and_nothing_else():
    goal = read_goal(goal_path("creature_coarse"))
    graph = DualGraph(goal)
    layouts = [nearly_blooming(graph, base, seed=0).layout for base in (0, 9, 18, 27)]
    limits = MachineLimits()
    problem = FoldProblem(goal, edge_insets(layouts[0].to_net(), limits.thickness, limits.clearance), limits)
    better = 0
    for layout in layouts:
        plain = judge(layout, problem, 0.2)
        mended = repaired(plain, problem)
        again = judge(layout, problem, 0.2, back=mended.back)
        assert (again.cost, again.result.completion) == (mended.cost, mended.result.completion)
        if mended is plain:
            continue
        better += 1
        assert mended.cost < plain.cost
        assert repaired(plain, problem).cost == mended.cost  # nothing is random
        for edge in np.flatnonzero(mended.back * layout.tree).tolist():
            without = mended.back.copy()
            without[edge] = 0.0
            assert judge(layout, problem, 0.2, back=without).cost >= mended.cost
        assert repaired(plain, problem, time.monotonic()) is plain
    assert better >= 2


def test_a_net_that_folds_whole_needs_no_repair():
    problem, layouts = problem_of("open_box")
    whole = judge(layouts[0], problem, 0.4)
    assert whole.result.completion == 1.0
    assert repaired(whole, problem) is whole
