"""Diagnosis of blocked creases: causes that are known, cures that hold, proofs against plain search."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.cures import Effort
from planner.diagnose import diagnose
from planner.fold_orders import steepest_fold, try_all_orders
from planner.fold_plan import Fold
from planner.fold_problem import FoldProblem
from planner.fold_state import FoldState, beams_of_side
from planner.fold_trials import Change, Workbench
from planner.insets import edge_insets
from planner.placement import place_net
from planner.plan_file import read_plan, write_plan
from planner.plan_on_sheet import plan_on_sheet, tree_of_net
from planner.substrate import make_sheet
from tests.planner import hand_nets
from tests.planner.strip_plans import limits, plan_net, strip_goal, strip_plan

QUICK = Effort(creases=3, shared=300, each=300, axes=3, sheets=1, states=200, failures=True)


def only(plan):
    assert len(plan.blocked) == 1
    return plan.blocked[0]


def lid_plan(tilt_deg=0.0):
    """A wall whose own lid comes over its crease: two turns of 80 degrees the same way, the base outside."""
    return strip_plan((70.0, 150.0), tilt_deg)


# -- causes, proofs ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_steep_fold_is_proven_impossible_until_the_tilt_allows_it(sign):
    plan = strip_plan((150.0 * sign,), 45.0)
    found = only(diagnose(plan, QUICK)).diagnosis
    assert found.cause == "own flap"
    assert math.degrees(abs(found.at_rad)) == pytest.approx(135.5, abs=0.3)
    assert found.proof is not None
    assert found.proof.kind == "angle"
    assert math.degrees(found.proof.bound_rad) == pytest.approx(135.5, abs=1e-9)
    assert found.cures[0].kind == "tilt"
    assert found.cures[0].frees
    assert math.degrees(found.cures[0].value) == pytest.approx(60.0, abs=0.01)
    assert strip_plan((150.0 * sign,), 65.0).blocked == ()


def test_the_wrong_axis_is_proven_and_turning_it_helps():
    goal = strip_goal((120.0,))
    net = hand_nets.net_from_parents(goal, hand_nets.bfs_parents(goal))
    start, end = next(net.hinge(f) for f in net.order[1:] if net.assignment[net.crease_of[f]] != "F")
    across = math.atan2(end[1] - start[1], end[0] - start[0]) + 0.5 * math.pi
    plan = plan_net(net, 45.0, across)
    found = only(diagnose(plan, QUICK)).diagnosis
    assert found.proof is not None
    assert found.proof.kind == "axis"
    assert math.degrees(found.proof.bound_rad) == pytest.approx(90.5, abs=0.01)
    axis = next(cure for cure in found.cures if cure.kind == "axis")
    assert axis.frees
    assert axis.blocked == 0
    turned = plan_net(plan.net, 45.0, axis.value)
    assert turned.blocked == ()


def test_a_face_that_hides_the_crease_is_named_with_the_path():
    plan = lid_plan()
    diagnosed = diagnose(plan, QUICK)
    found = next(b.diagnosis for b in diagnosed.blocked if b.diagnosis.cause == "sight")
    crease = next(b.crease for b in diagnosed.blocked if b.diagnosis is found)
    assert found.carried
    child = plan.net.child_of[crease]
    assert found.blocker in plan.net.subtree[child].tolist()
    assert found.path_faces[-1] == found.blocker
    assert crease in found.path_creases
    assert len(found.path_creases) == len(found.path_faces) - 1
    # in no order, as long as the lid is folded as far as it goes; less of it and the crease is free
    assert found.proof is not None
    assert found.proof.kind == "orders"
    assert found.proof.states >= 3
    assert any(cure.kind == "unfold" and cure.frees for cure in found.cures)


def test_contact_names_the_pair_and_a_rectangular_spiral_touches_itself():
    plan = strip_plan((100.0, 100.0, 100.0), 0.0, without=("sight",))
    found = [b.diagnosis for b in diagnose(plan, QUICK).blocked]
    assert found
    for why in found:
        assert why.cause == "contact"
        assert why.views == ()
        assert why.path_faces[0] == why.toucher
        assert why.path_faces[-1] == why.blocker


def test_path_is_a_walk_in_the_tree():
    plan = lid_plan()
    for blocked in diagnose(plan, QUICK).blocked:
        why = blocked.diagnosis
        for crease, one, other in zip(why.path_creases, why.path_faces, why.path_faces[1:], strict=False):
            assert {int(plan.net.parent[one]), int(plan.net.parent[other])} & {one, other}
            assert plan.net.child_of[crease] in (one, other)


@given(st.floats(0.0, 80.0), st.floats(0.0, 90.0))
@settings(max_examples=60)
def test_no_beam_reaches_beyond_the_bound(tilt_deg, turn_deg):
    """The bound against the beams themselves: how far a lone face may turn, by looking at many angles."""
    limit = limits(tilt_deg)
    bound = steepest_fold(limit, math.cos(math.radians(turn_deg)))
    crease = np.array([math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg)), 0.0])
    across = np.cross([0.0, 0.0, 1.0], crease)
    largest = 0.0
    for rotary in np.linspace(-limit.max_tilt_rad, limit.max_tilt_rad, 41):
        light = np.array([0.0, math.sin(rotary), math.cos(rotary)])
        largest = max(largest, math.atan2(light[2], light @ across))
    assert largest <= bound
    assert bound - largest <= math.radians(0.5) + 1e-9  # the overhang; the ends of the range are looked at
    assert bound <= steepest_fold(limit) + 1e-12


# -- orders --------------------------------------------------------------------------------------------------


def orders_by_hand(problem, tree):
    """Every order, plainly: a recursion that shares nothing and forgets nothing."""
    creases = [f for f in range(len(tree.parent)) if tree.target[f] != 0.0]
    freed = set()

    def above(face):
        out, up = [], int(tree.parent[face])
        while up >= 0:
            out.append(up)
            up = int(tree.parent[up])
        return out

    def go(turned, done):
        for face in creases:
            if turned.get(face) == tree.target[face] or any(turned.get(g, 0.0) for g in above(face)):
                continue
            if any(face in above(g) and g not in done for g in creases):
                continue
            state = FoldState(problem, tree)
            for other, angle in turned.items():
                state.turn(other, angle)
            beams = beams_of_side(problem.limits.max_tilt_rad, top=tree.target[face] > 0)
            to = state.reach(face, beams).angle_rad
            if to == tree.target[face]:
                freed.add(face)
            moved = abs(to - turned.get(face, 0.0)) > math.radians(0.2) or to == tree.target[face]
            if moved:
                go({**turned, face: to}, done | {face})
            elif face not in done:
                go(turned, done | {face})

    go({}, frozenset())
    return freed


@pytest.mark.parametrize("angles", [(70.0, 150.0), (95.0, -60.0, 80.0), (-60.0, -100.0, 85.0)])
@pytest.mark.parametrize("base", [0, 2])
def test_all_orders_agree_with_a_plain_recursion(angles, base):
    plan = strip_plan(angles, 20.0, base=base)
    tree = tree_of_net(plan.net)
    problem = Workbench(plan).problem
    wanted = [f for f in range(len(tree.parent)) if tree.target[f] != 0.0]
    search = try_all_orders(problem, tree, None, [*wanted, -1], 10_000)
    assert search.exhausted
    assert search.freed == orders_by_hand(problem, tree)


def test_an_unfinished_search_proves_nothing():
    plan = strip_plan((70.0, 150.0), 0.0)
    tree = tree_of_net(plan.net)
    assert not try_all_orders(Workbench(plan).problem, tree, None, [-1], 1).exhausted


def test_what_is_proven_is_never_cured_by_the_order_alone():
    plan = diagnose(lid_plan(), QUICK)
    for blocked in plan.blocked:
        if blocked.diagnosis.proof is not None:
            face = plan.net.child_of[blocked.crease]
            tree = tree_of_net(plan.net)
            problem = Workbench(plan).problem
            rng = np.random.default_rng(1)
            for _ in range(20):
                assert problem.fold(tree, rank=rng.permutation(len(tree.parent))).cause[face] != 0


# -- cures ---------------------------------------------------------------------------------------------------


def spiral_plan():
    return strip_plan((70.0, 150.0, -40.0), 0.0)


@pytest.fixture(scope="module")
def diagnosed():
    return diagnose(spiral_plan(), QUICK)


def replanned(plan, cure):
    """The plan made anew from the words of a cure, by the way that every plan is made."""
    limit, hidden, net, axis = plan.limits, plan.hidden_max, plan.net, 0.0
    if cure.kind == "tilt":
        limit = replace(limit, max_tilt_rad=cure.value)
    elif cure.kind == "clearance":
        limit = replace(limit, clearance=cure.value)
    elif cure.kind == "hidden":
        hidden = cure.value
    elif cure.kind == "axis":
        axis = cure.value
    elif cure.kind == "base":
        parents = hand_nets.rerooted(net.parent.tolist(), cure.face)
        flat = hand_nets.net_from_parents(net.goal, parents)
        old, new = (n.vertices[n.faces[cure.face, :2]] for n in (net, flat))
        headings = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in (old, new)]
        net, axis = flat, headings[1] - headings[0]
    problem = FoldProblem(
        net.goal, edge_insets(net, limit.thickness, limit.clearance), limit, hidden_max=hidden
    )
    placed = place_net(net, limit, axis)
    return plan_on_sheet(placed, make_sheet(placed, limit), problem, 0, (), ())


def test_a_cure_that_is_claimed_works_when_planned_anew(diagnosed):
    tried = 0
    for blocked in diagnosed.blocked:
        for cure in blocked.diagnosis.cures:
            if cure.kind in ("cut", "unfold"):
                continue
            again = replanned(diagnosed, cure)
            tried += 1
            if cure.kind != "base":
                still = {b.crease for b in again.blocked}
                assert (blocked.crease not in still) == cure.frees
            assert again.metrics.fold_completion == pytest.approx(cure.completion, abs=1e-9)
            assert again.metrics.shape_rms == pytest.approx(cure.shape_rms, abs=1e-6)
            assert len(again.blocked) == cure.blocked
    assert tried >= 4


def test_folding_another_crease_less_frees_this_one_as_claimed(diagnosed):
    bench = Workbench(diagnosed)
    claims = [(b.crease, c) for b in diagnosed.blocked for c in b.diagnosis.cures if c.kind == "unfold"]
    assert claims
    for crease, cure in claims:
        face, other = (diagnosed.net.child_of[c] for c in (crease, cure.crease))
        trial = bench.fold_on_sheet(Change(unfold=(other, cure.value)))
        assert trial.angle_at(int(bench.layout.crease[face]))[1] == cure.frees
        assert cure.frees
        assert abs(trial.reached[other]) <= abs(trial.target[other]) - cure.value + 1e-9


def test_cures_are_sorted_by_use_and_counted(diagnosed):
    before = diagnosed.metrics.shape_rms
    for blocked in diagnosed.blocked:
        keys = [(not c.frees, c.shape_rms > before + 1e-9) for c in blocked.diagnosis.cures]
        assert keys == sorted(keys)
        assert blocked.diagnosis.tries == sum(c.tries for c in blocked.diagnosis.cures)


def test_a_joint_elsewhere_frees_what_is_blocked():
    plan = diagnose(plan_net(hand_nets.net_from_parents(*comb()), 0.0), replace(QUICK, each=3000))
    cuts = [c for b in plan.blocked for c in b.diagnosis.cures if c.kind == "cut" and c.frees]
    assert cuts
    for cure in cuts:
        assert cure.crease in plan.net.child_of
        assert len(cure.join) == 2
        shared = set(plan.net.goal.faces[cure.join[0]].tolist()) & set(
            plan.net.goal.faces[cure.join[1]].tolist()
        )
        assert len(shared) == 2


def comb():
    """A closed box whose net is one long way around: lids fold over the creases of their carriers."""
    goal = hand_nets.box_goal(20.0, 14.0, 10.0)
    return goal, hand_nets.rerooted(long_way(goal), 0)


def long_way(goal):
    """A depth-first tree, coplanar neighbours first: the longest chains."""
    side = hand_nets.neighbours(goal)
    faces = goal.faces.tolist()
    parent = {0: -1}

    def go(face):
        options = []
        for k in range(3):
            other = side.get((faces[face][(k + 1) % 3], faces[face][k]))
            if other is not None:
                bend = abs(hand_nets.signed_dihedral(goal, face, other[0], k))
                options.append((bend > 0.01, other[0]))
        for _, other in sorted(options):
            if other not in parent:
                parent[other] = face
                go(other)

    go(0)
    return [parent[f] for f in range(len(faces))]


# -- as data -------------------------------------------------------------------------------------------------


def test_the_same_plan_gives_the_same_diagnosis_and_the_file_keeps_it(diagnosed, tmp_path):
    assert diagnose(spiral_plan(), QUICK).blocked == diagnosed.blocked
    write_plan(diagnosed, tmp_path / "plan.json", {})
    first = (tmp_path / "plan.json").read_bytes()
    again = read_plan(tmp_path / "plan.json", diagnosed.net)
    for one, other in zip(again.blocked, diagnosed.blocked, strict=True):
        assert one.diagnosis.cause == other.diagnosis.cause
        assert one.diagnosis.path_creases == other.diagnosis.path_creases
        assert [c.kind for c in one.diagnosis.cures] == [c.kind for c in other.diagnosis.cures]
        assert one.diagnosis.loss_mm == other.diagnosis.loss_mm
    write_plan(again, tmp_path / "plan.json", {})
    assert (tmp_path / "plan.json").read_bytes() == first


def test_files_without_a_diagnosis_are_read(diagnosed, tmp_path):
    write_plan(spiral_plan(), tmp_path / "plan.json", {})
    values = json.loads((tmp_path / "plan.json").read_bytes())
    assert all("diagnosis" not in entry for entry in values["blocked"])
    assert all(b.diagnosis is None for b in read_plan(tmp_path / "plan.json", diagnosed.net).blocked)


def test_a_plan_without_blocked_creases_is_left_alone():
    plan = strip_plan((30.0, 40.0), 0.0)
    assert plan.blocked == ()
    assert diagnose(plan) is plan


def test_more_blocked_creases_than_the_effort_are_said_to_be_capped():
    plan = diagnose(spiral_plan(), replace(QUICK, creases=0))
    assert all(b.diagnosis.capped and not b.diagnosis.cures for b in plan.blocked)
    assert any(isinstance(step, Fold) for step in plan.steps)
