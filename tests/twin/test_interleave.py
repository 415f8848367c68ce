"""Folds that take turns: the same part, every rule kept on the way, never slower."""

from __future__ import annotations

import itertools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from planner import certify_contact
from planner.fold_plan import Fold
from planner.fold_replay import FoldReplay
from planner.plan_file import read_plan, write_plan
from planner.sight_certificate import certify_sight
from rigs.job_build import make_job
from tests.twin.thermal_plans import RIG, STEEL, shipped_plan
from twin.interleave import MOST_STAGES, interleave
from twin.plan_process import plan_process

# thin metal and a cool start: there is much to wait for
HOT = {"allowed_start_c": 90.0}


@pytest.fixture(scope="module", params=["crown", "flower"])
def pair(request):
    plan = shipped_plan(request.param)
    return plan, interleave(plan, RIG, STEEL, **HOT)


def test_it_saves_time_and_says_how_much(pair):
    plan, made = pair
    for each, seconds in ((plan, made.seconds_in_order), (made.plan, made.seconds)):
        process = plan_process(each, RIG, STEEL, **HOT)
        assert make_job(each, process, RIG, STEEL).seconds == pytest.approx(seconds)
        assert process.peak_start_c <= 90.5
    assert made.seconds < made.seconds_in_order
    assert made.staged > 0
    assert made.groups > 0


def test_every_crease_ends_where_it_did_and_gets_its_passes(pair):
    plan, made = pair
    assert np.array_equal(plan.final_angles, made.plan.final_angles)
    before, after = (plan_process(p, RIG, STEEL, **HOT).passes_of_crease for p in (plan, made.plan))
    assert before.keys() == after.keys()
    for crease, count in before.items():
        assert after[crease] == pytest.approx(count, abs=MOST_STAGES, rel=0.1)
    folds = Counter(s.crease for s in made.plan.steps if isinstance(s, Fold))
    assert max(folds.values()) <= MOST_STAGES + 1


def test_stages_only_go_on(pair):
    plan, made = pair
    angle: dict[int, float] = {}
    for step in made.plan.steps:
        if isinstance(step, Fold):
            end, now = plan.final_angles[step.crease], angle.get(step.crease, 0.0)
            assert abs(now) < abs(step.to_rad) <= abs(end) + 1e-12
            assert step.to_rad * end > 0.0
            angle[step.crease] = step.to_rad


def test_all_else_of_the_plan_stays(pair):
    plan, made = pair
    others = [[s for s in p.steps if not isinstance(s, Fold)] for p in (plan, made.plan)]
    assert others[0] == others[1]
    creases = []
    for p in (plan, made.plan):
        groups = itertools.groupby(p.steps, key=lambda s: isinstance(s, Fold))
        creases.append([{s.crease for s in steps} for is_fold, steps in groups if is_fold])
    assert creases[0] == creases[1]
    assert replace(made.plan, steps=plan.steps) is not plan


def test_every_stage_is_within_the_rules(pair):
    _, made = pair
    replay = FoldReplay(made.plan)
    for step in made.plan.steps:
        if isinstance(step, Fold):
            assert replay.objection(step) == ""
        replay.make(step)


def test_certificates_hold_as_before(pair):
    """The proofs share no code with the kernels that were asked."""
    plan, made = pair
    assert certify_sight(plan).is_proven <= certify_sight(made.plan).is_proven
    before, after = certify_contact(plan), certify_contact(made.plan)
    if all(turn.is_free or turn.touches_at_goal for turn in before.turns):
        assert all(turn.is_free or turn.touches_at_goal for turn in after.turns)


def test_the_plan_file_carries_the_stages(pair, tmp_path):
    _, made = pair
    path = tmp_path / "plan.json"
    write_plan(made.plan, path, {})
    again = read_plan(path, made.plan.net)
    one, two = (plan_process(p, RIG, STEEL, **HOT) for p in (made.plan, again))
    assert [f.passes for f in one.folds] == [f.passes for f in two.folds]
    assert two.seconds == pytest.approx(one.seconds, rel=1e-3)


def test_it_is_repeatable():
    plan = shipped_plan("flower")
    assert interleave(plan, RIG, STEEL, **HOT).plan.steps == interleave(plan, RIG, STEEL, **HOT).plan.steps


def test_where_nothing_rests_nothing_changes():
    plan = shipped_plan("bracket")
    lone = replace(plan, steps=tuple(s for s in plan.steps if not isinstance(s, Fold)))
    made = interleave(lone, RIG, STEEL)
    assert made.plan is lone
    assert made.seconds == made.seconds_in_order
