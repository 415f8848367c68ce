"""Creases that are held back so that others go further: folding them, and what the plan says of them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planner.cures import Effort
from planner.diagnose import diagnose
from planner.fold_problem import HELD_BACK
from planner.fold_search import flat_tree
from planner.fold_trials import Workbench
from planner.plan_file import read_plan, write_plan
from planner.plan_on_sheet import fold_on_sheet, plan_on_sheet
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
