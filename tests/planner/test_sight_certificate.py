"""Certificates of sight: the bound is never below what is hidden, and what is hidden is named."""

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest

from models.goals import goal_path
from planner.errors import PlanError
from planner.fold_plan import Bend, Fold, MachineLimits, Rotate
from planner.make_net import make_net
from planner.plan_folds import plan_folds
from planner.read_goal import read_goal
from planner.sight_certificate import END_SHARE, certify_sight, hidden_bound
from planner.sight_file import sight_bytes, write_sight
from tests.planner.contact_reference import hidden_share_reference

LIMITS = MachineLimits(
    max_tilt_rad=math.radians(45.0), axis_height=180.0, lens_height=220.0, beam_spread=0.01
)


@pytest.fixture(scope="module", autouse=True)
def short_search():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys.modules["planner.plan_folds"], "EVALUATION_BUDGET", 1200)
        patch.setattr(sys.modules["planner.plan_folds"], "STARTS", 4)
        yield


@pytest.fixture(scope="module", params=["bracket", "box_with_lid", "creature_coarse"])
def plan(request):
    return plan_folds(make_net(read_goal(goal_path(request.param))), LIMITS)


@pytest.fixture(scope="module")
def blind():
    return plan_folds(make_net(read_goal(goal_path("creature_coarse"))), LIMITS, without=("sight",))


def light_of(rotary):
    return np.array([0.0, math.sin(rotary), math.cos(rotary)])


@pytest.mark.parametrize("rotary", [0.0, 0.5, math.pi - 0.3])
def test_bound_is_what_polygons_say_where_nothing_moves(rotary):
    rng = np.random.default_rng(4)
    light = light_of(rotary)
    seen = 0
    for _ in range(150):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangles = rng.uniform(-2, 2, (3, 3, 3))
        triangles[:, :, 2] = np.sign(light[2]) * rng.uniform(0.1, 2, (3, 3))
        inner = END_SHARE * (end - start)
        true = hidden_share_reference(
            np.append(start + inner, 0.0), np.append(end - inner, 0.0), list(triangles), light
        )
        none, thin = np.zeros(3), np.zeros(3, dtype=bool)
        assert hidden_bound(triangles, none, thin, start, end, (light, False), 0.0, 0.0) == pytest.approx(
            true, abs=1e-6
        )
        seen += 0.0 < true < 1.0
    assert seen > 30


@pytest.mark.parametrize("source", [None, np.array([3.0, -4.0, 30.0])])
def test_bound_holds_for_all_that_the_slack_allows(source):
    rng = np.random.default_rng(8)
    light = (light_of(0.4), False) if source is None else (source, True)
    for _ in range(150):
        start, end = rng.uniform(-2, 2, 2), rng.uniform(-2, 2, 2)
        triangles = rng.uniform(-2, 2, (2, 3, 3))
        slack, thin = np.array([0.0, 0.1]), np.ones(2, dtype=bool)
        bound = hidden_bound(triangles, slack, thin, start, end, light, 0.0, 0.0)
        for _ in range(5):
            step = rng.normal(size=(2, 3, 3))
            step *= (slack / np.linalg.norm(step, axis=2).max(axis=1))[:, None, None]
            moved = hidden_bound(triangles + step, np.zeros(2), thin, start, end, light, 0.0, 0.0)
            assert moved <= bound + 1e-9


def test_plans_of_the_planner_are_proven_in_sight_but_for_brief_shadows(plan):
    certificate = certify_sight(plan)
    assert len(certificate.turns) == sum(isinstance(step, Fold) for step in plan.steps)
    open_turns = [turn for turn in certificate.turns if not turn.proven]
    # the planner looks every 1.7 degrees and keeps half of the share in reserve for what passes in between
    assert len(open_turns) <= 0.02 * len(certificate.turns), certificate.words()
    assert certificate.is_proven == (not open_turns)
    assert all(turn.hidden <= plan.hidden_max for turn in certificate.turns if turn.proven)


def test_a_moving_face_may_graze_the_crease_but_not_reach_over_it():
    start, end, light = np.array([0.0, 0.0]), np.array([4.0, 0.0]), (light_of(0.0), False)
    for reach, hidden in ((0.0, False), (0.015, False), (0.03, True)):
        triangle = np.array([[[-9.0, -reach, 2.0], [15.0, -reach, 2.0], [2.0, 9.0, 2.0]]])
        share = hidden_bound(triangle, np.zeros(1), np.ones(1, bool), start, end, light, 0.05, 0.0)
        assert (share > 0.5) == hidden
        assert hidden_bound(triangle, np.zeros(1), np.zeros(1, bool), start, end, light, 0.05, 0.0) > 0.5


def test_a_plan_that_looked_away_is_not_proven(blind):
    certificate = certify_sight(blind)
    assert not certificate.is_proven
    first = next(turn for turn in certificate.turns if not turn.proven)
    assert f"step {first.step} is not" in certificate.words()
    assert first.hidden > blind.hidden_max
    assert math.isfinite(first.from_rad)


def test_a_face_that_leans_over_its_crease_is_not_proven(plan):
    steps = [step for step in plan.steps if not isinstance(step, Rotate)]
    fold = next(step for step in steps if isinstance(step, Fold))
    steep = math.copysign(math.radians(100.0), fold.to_rad)
    side = Rotate(0.0 if fold.to_rad > 0.0 else math.pi)
    certificate = certify_sight(replace(plan, steps=(side, Fold(fold.crease, steep))))
    (turn,) = certificate.turns
    assert not turn.proven
    assert abs(math.degrees(turn.from_rad)) == pytest.approx(90.5, abs=1e-6)


def test_bent_substrate_is_refused(plan):
    bent = replace(plan, steps=(Bend((0,), ((0.0, 0.0), (1.0, 0.0)), 0.5), *plan.steps))
    with pytest.raises(PlanError, match="bends the substrate"):
        certify_sight(bent)


def test_the_file_says_the_same_every_time(plan, tmp_path):
    certificate = certify_sight(plan)
    write_sight(certificate, tmp_path / "sight.json", {"net": "n", "plan": "p"})
    kept = (tmp_path / "sight.json").read_bytes()
    assert kept == sight_bytes(certify_sight(plan), {"net": "n", "plan": "p"})
    document = json.loads(kept)
    assert document["proven"] == certificate.is_proven
    assert document["plan_sha256"] == "p"
    assert [row["step"] for row in document["steps"]] == [turn.step for turn in certificate.turns]
