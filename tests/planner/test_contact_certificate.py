"""Certificates of whole plans: what they prove is true, and what is wrong is named."""

import json
import math
import sys
from dataclasses import replace

import fcl
import numpy as np
import pytest

from models.goals import goal_path
from planner.contact_certificate import ENOUGH_MM, certify_contact
from planner.contact_file import contact_bytes, write_contact
from planner.errors import PlanError
from planner.fold_file import read_fold, write_fold
from planner.fold_plan import Bend, Clip, Fold, MachineLimits
from planner.fold_problem import FoldProblem
from planner.insets import edge_insets
from planner.kinematics import face_transforms
from planner.make_net import make_net
from planner.plan_file import read_plan, write_plan
from planner.plan_folds import plan_folds
from planner.plan_on_sheet import tree_of_net
from planner.read_goal import read_goal
from planner.sheet_hits import sheet_solids
from tests.planner.contact_reference import PRISM_FACES, body

LIMITS = MachineLimits(max_tilt_rad=math.radians(45.0), axis_height=180.0, lens_height=220.0)


@pytest.fixture(scope="module", autouse=True)
def short_search():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys.modules["planner.plan_folds"], "EVALUATION_BUDGET", 1200)
        patch.setattr(sys.modules["planner.plan_folds"], "STARTS", 4)
        yield


@pytest.fixture(scope="module")
def box():
    return plan_folds(make_net(read_goal(goal_path("box_with_lid"))), LIMITS)


@pytest.fixture(scope="module")
def careless():
    """A plan made without the contact rule."""
    return plan_folds(make_net(read_goal(goal_path("creature_coarse"))), LIMITS, without=("contact",))


def distances(plan, step, samples):
    """Least distance between what moves in a fold step and every solid that stands still, by sampling."""
    net = plan.net
    problem = FoldProblem(net.goal, edge_insets(net, LIMITS.thickness, LIMITS.clearance), LIMITS)
    prisms = problem.solids(tree_of_net(net))[:, :6]
    gone = {t for s in plan.steps[:step] if isinstance(s, Clip) for t in s.faces}
    sheet = [b for t, b in enumerate(sheet_solids(plan.sheet, LIMITS.thickness)[:, :6]) if t not in gone]
    angles = np.zeros(len(net.edges))
    for earlier in plan.steps[:step]:
        if isinstance(earlier, Fold):
            angles[earlier.crease] = earlier.to_rad
    crease, goal = plan.steps[step].crease, plan.steps[step].to_rad
    face = net.child_of[crease]
    moving = set(net.subtree[face].tolist())
    start = angles[crease]
    out = math.inf
    for angle in np.linspace(start, goal, samples):
        angles[crease] = angle
        at = face_transforms(net, angles)
        posed = np.einsum("fij,fkj->fki", at[:, :3, :3], prisms) + at[:, None, :3, 3]
        bodies = [body(p, PRISM_FACES) for p in posed]
        others = [(f, b) for f, b in enumerate(bodies) if f not in moving]
        others += [(-1, body(b, PRISM_FACES)) for b in sheet]
        for m in moving:
            for f, other in others:
                if (m, f) != (face, net.parent[face]):
                    distance = fcl.distance(bodies[m], other, fcl.DistanceRequest(), fcl.DistanceResult())
                    out = min(out, distance)
    return out


def test_every_turn_is_proven_and_no_margin_is_more_than_what_fcl_measures(box):
    proof = certify_contact(box)
    assert [turn.step for turn in proof.turns] == [n for n, s in enumerate(box.steps) if isinstance(s, Fold)]
    assert proof.is_proven
    assert proof.free_turns == len(proof.turns)
    assert proof.margin_mm > 0.0
    assert 0.0 < proof.error_mm < 1e-8
    for turn in proof.turns[::3]:
        assert turn.margin_mm <= min(distances(box, turn.step, 9), ENOUGH_MM) + 1e-9
        assert turn.pairs >= turn.close_pairs > 0
    assert f"{len(proof.turns)} of {len(proof.turns)} turns certified free" in proof.words()


def test_a_crease_that_turns_too_far_is_named(box):
    proof = certify_contact(box)
    # through the sheet to the other side: whatever lies there is hit
    last = max(n for n, s in enumerate(box.steps) if isinstance(s, Fold))
    steps = list(box.steps)
    steps[last] = Fold(steps[last].crease, math.copysign(math.pi, steps[last].to_rad))
    bad = certify_contact(replace(box, steps=tuple(steps)))
    assert bad.turns[:-1] == proof.turns[:-1]
    assert not bad.is_proven
    assert bad.turns[-1].open_pairs
    pair = bad.turns[-1].open_pairs[0]
    assert pair.kind == "contact"
    assert pair.moving in box.net.subtree[box.net.child_of[steps[last].crease]]
    assert abs(box.steps[last].to_rad) - 1e-9 <= abs(pair.from_rad) <= math.pi
    assert f"1 not proven, first step {last}" in bad.words()


def test_substrate_that_is_not_clipped_is_hit(careless):
    clipped = {t for step in careless.steps if isinstance(step, Clip) for t in step.faces}
    assert clipped
    steps = tuple(step for step in careless.steps if not isinstance(step, Clip))
    before, after = certify_contact(careless), certify_contact(replace(careless, steps=steps))
    # with the contact rule off the planner does not mind the frame; everything else that is hit is clipped
    hit = sheet_contacts(after) - sheet_contacts(before)
    assert hit
    assert hit <= clipped
    assert not sheet_contacts(before) & clipped


def sheet_contacts(proof):
    pairs = [pair for turn in proof.turns for pair in turn.open_pairs]
    return {pair.still for pair in pairs if pair.in_substrate and pair.kind == "contact"}


def test_a_plan_made_without_the_contact_rule_is_not_proven(careless):
    proof = certify_contact(careless)
    touching = [turn for turn in proof.turns if any(p.kind == "contact" for p in turn.open_pairs)]
    assert touching
    assert distances(careless, touching[0].step, 40) <= 1e-2


def test_the_proof_from_the_files_is_the_same(box, tmp_path):
    write_fold(box.net, tmp_path / "net.fold")
    write_plan(box, tmp_path / "plan.json", {})
    plan = read_plan(tmp_path / "plan.json", read_fold(tmp_path / "net.fold", box.net.goal))
    proof, again = certify_contact(plan), certify_contact(plan)
    hashes = {"net": "1" * 64, "plan": "2" * 64}
    assert contact_bytes(proof, hashes) == contact_bytes(again, hashes)
    write_contact(proof, tmp_path / "contact.json", hashes)
    values = json.loads((tmp_path / "contact.json").read_text())
    assert values["free"] == values["turns"] == len(proof.turns)
    assert values["plan_sha256"] == "2" * 64
    assert values["proven"] is True
    assert 0.0 < values["margin"] <= proof.margin_mm
    assert [row["step"] for row in values["steps"]] == [turn.step for turn in proof.turns]


def test_bends_are_refused(box):
    bend = Bend((0,), ((0.0, 0.0), (1.0, 0.0)), 0.5)
    with pytest.raises(PlanError, match="bends the substrate"):
        certify_contact(replace(box, steps=(bend, *box.steps)))


def test_nothing_to_fold_is_proven(box):
    proof = certify_contact(replace(box, steps=()))
    assert proof.is_proven
    assert proof.words() == "0 of 0 turns certified free"
