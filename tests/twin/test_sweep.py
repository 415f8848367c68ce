"""The kinematic sweep against dense sampling by MuJoCo; its bounds against brute force."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.fold_plan import Clip, Fold, FoldPlan, Sheet
from planner.goal_mesh import GoalMesh
from planner.kinematics import rotation_about_line
from tests.twin.hand_plans import (
    box,
    breadth_first_net,
    icosahedron,
    outside_in_steps,
    plan_of,
    ring_sheet,
    star,
)
from tests.twin.sampled_sweep import sampled_hits
from twin.errors import ModelError
from twin.loaded_model import LoadedModel
from twin.mjcf_model import compile_model
from twin.sweep import DEPTH_TOLERANCE_MM, _Pose, kinematic_sweep
from twin.sweep_bounds import first_reach, may_meet
from twin.timeline import turns


@pytest.mark.parametrize("goal", [box(), box(40, 3, 3), star(), star(7), icosahedron(), icosahedron(30, 1)])
def test_clean_plans_have_no_hit(goal) -> None:
    plan = plan_of(breadth_first_net(goal))
    result = kinematic_sweep(compile_model(plan), plan)
    assert result.events == ()
    assert result.turns == sum(isinstance(s, Fold) for s in plan.steps)
    assert result.closest_mm > 0.0


def shuffled(net, seed: int, factor: float = 1.0) -> FoldPlan:
    folds = [s for s in outside_in_steps(net) if isinstance(s, Fold)]
    order = np.random.default_rng(seed).permutation(len(folds))
    return plan_of(net, [Fold(folds[i].crease, folds[i].to_rad * factor) for i in order])


def named_hits(compiled, events) -> dict:
    out = {}
    for e in events:
        pair = [("face", f) for f in e.faces]
        pair += [
            ("sheet", k) for k, p in enumerate(compiled.side.pieces) if set(e.substrate) & set(p.triangles)
        ]
        out.setdefault((e.step, frozenset(pair)), e)
    return out


@pytest.mark.parametrize(
    ("goal", "seed", "factor"),
    [
        (box(), 1, 2.5),
        (icosahedron(), 2, 2.2),
        (icosahedron(), 3, 2.5),
        (icosahedron(30, 1), 4, 1.6),
        (box(), 7, 2.0),
    ],
)
def test_hits_are_those_of_dense_sampling(goal, seed: int, factor: float) -> None:
    plan = shuffled(breadth_first_net(goal), seed, factor)
    compiled = compile_model(plan)
    mine = named_hits(compiled, kinematic_sweep(compiled, plan).events)
    light, same, deep = sampled_hits(compiled, plan, (0.0, DEPTH_TOLERANCE_MM, 4 * DEPTH_TOLERANCE_MM))
    assert set(deep) <= set(mine)
    assert set(mine) <= set(light)
    assert mine
    for key, event in mine.items():  # the touch comes no later than the sampled hit, and not before any touch
        assert abs(event.angle_rad) >= abs(light[key][0]) - np.radians(0.25)
        if key in same:
            assert abs(event.angle_rad) <= abs(same[key][1]) + np.radians(1.0)  # depths differ by their path


def test_a_fold_through_a_neighbour_names_pair_step_and_angle() -> None:
    """Every side of a box folded too far: sides meet, and the event says which, when and where."""
    goal = box(20, 20, 20)
    net = breadth_first_net(goal)
    folds = [s for s in outside_in_steps(net) if isinstance(s, Fold)]
    plan = plan_of(net, [Fold(f.crease, f.to_rad * 1.3) for f in folds])
    compiled = compile_model(plan)
    result = kinematic_sweep(compiled, plan)
    assert result.events
    first = result.events[0]
    assert first.kind == "contact"
    assert isinstance(plan.steps[first.step], Fold)
    assert plan.steps[first.step].crease == first.crease
    assert f"face {first.faces[0]}" in first.detail
    assert first.depth_mm > DEPTH_TOLERANCE_MM


def test_sheet_is_hit_until_it_is_clipped() -> None:
    """A flap as long as the box turned over onto substrate beyond the base."""
    goal = box(20, 20, 20)
    net = breadth_first_net(goal)
    child = max(range(len(net.faces)), key=lambda f: len(net.subtree[f]) if net.crease_of[f] >= 0
                and net.assignment[net.crease_of[f]] != "F" else -1)  # fmt: skip
    start, end = net.hinge(child)
    crease = int(net.crease_of[child])
    # a triangle lies where the far end of the flap comes down, mirrored across the crease
    far = net.vertices[net.faces[net.subtree[child]]].reshape(-1, 2)
    u = (end - start) / np.linalg.norm(end - start)
    n = np.array([-u[1], u[0]])
    tip = far[np.argmax(np.abs((far - start) @ n))]
    mirrored = tip - 2 * ((tip - start) @ n) * n
    ring = ring_sheet(net, gap=50.0)
    extra = mirrored + 0.5 * np.array([[-1, -1], [1, -1], [0, 1]])
    sheet = Sheet(
        outline=ring.outline, vertices=np.vstack([ring.vertices, extra]),
        faces=np.vstack([ring.faces, [[8, 9, 10]]]), frame_faces=np.append(ring.frame_faces, False), tabs=(),
        rotary_axis=ring.rotary_axis,
    )  # fmt: skip
    fold = Fold(crease, float(np.radians(-178.0)))
    hit = plan_of(net, [fold], sheet)
    events = kinematic_sweep(compile_model(hit), hit).events
    blocked = [e for e in events if e.substrate]
    clipped = plan_of(net, [Clip((8,)), fold], sheet)
    free = [e for e in kinematic_sweep(compile_model(clipped), clipped).events if e.substrate]
    assert [e.substrate for e in blocked] and all(e.substrate == (8,) for e in blocked)
    assert free == []


def sun(faces: int, arms: int = 32, quads: int = 20) -> GoalMesh:
    """A flat polygon with an arm on every side that curls up by 2 degrees a crease; the last is shorter."""
    side = 2 * np.pi / arms
    corners = [[60 * np.cos(side * k), 60 * np.sin(side * k), 0.0] for k in range(arms)]
    triangles = [[0, k, k + 1] for k in range(1, arms - 1)]
    for k in range(arms):
        out = np.array([np.cos(side * (k + 0.5)), np.sin(side * (k + 0.5)), 0.0])
        near = [k, (k + 1) % arms]
        for q in range(1, quads + 1):
            lean = np.radians(2.0 * q)
            step = 5.0 * (np.cos(lean) * out + np.sin(lean) * np.array([0.0, 0.0, 1.0]))
            far = [len(corners), len(corners) + 1]
            corners += [np.array(corners[n]) + step for n in near]
            triangles += [[near[0], far[1], near[1]], [near[0], far[0], far[1]]]
            near = far
    return GoalMesh(np.array(corners), np.array(triangles[:faces]), name="sun")


def test_a_net_of_1281_faces_is_compiled_and_swept() -> None:
    """Clean as it is; and with its last crease turned almost shut, that step is hit and no other."""
    net = breadth_first_net(sun(1281))
    steps = outside_in_steps(net)
    plan = plan_of(net, steps)
    result = kinematic_sweep(compile_model(plan), plan)
    assert len(net.faces) == 1281
    assert result.turns == sum(isinstance(s, Fold) for s in steps) > 600
    assert result.events == ()
    *before, last = steps
    assert isinstance(last, Fold)
    shut = plan_of(net, [*before, Fold(last.crease, float(np.radians(179.0)))])
    events = kinematic_sweep(compile_model(shut), shut).events
    assert {(e.step, e.crease) for e in events} == {(len(before), last.crease)}


def test_a_model_of_another_net_is_refused() -> None:
    compiled = compile_model(plan_of(breadth_first_net(box())))
    with pytest.raises(ModelError, match="another net"):
        kinematic_sweep(compiled, plan_of(breadth_first_net(star())))


finite = st.floats(-10, 10, width=32)


@given(st.integers(0, 10**6), st.floats(0.05, 3.0))
def test_no_pair_that_meets_is_dropped_and_no_plane_is_trusted_too_long(seed: int, sweep: float) -> None:
    rng = np.random.default_rng(seed)
    moving = rng.uniform(-5, 5, (6, 1, 3)) + rng.uniform(-2, 2, (6, 6, 3))
    rest = rng.uniform(-5, 5, (5, 1, 3)) + rng.uniform(-2, 2, (5, 8, 3))
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    kept = set(zip(*(index.tolist() for index in may_meet(moving, rest, axis, sweep)), strict=True))
    i, j = np.divmod(np.arange(30), 5)
    normal = rest[j].mean(axis=1) - moving[i].mean(axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    step = first_reach(moving[i], rest[j], axis, np.zeros(30), normal, sweep)
    for angle in np.linspace(0.0, sweep, 60):
        turned = moving @ rotation_about_line(np.zeros(3), axis, float(angle))[:3, :3].T
        gap = np.einsum("nkd,nd->nk", rest[j], normal).min(1) - np.einsum(
            "nkd,nd->nk", turned[i], normal
        ).max(1)
        assert np.all(gap[angle < step] > -1e-9)
        # a body that holds a corner of the other meets it for sure: such a pair must have been kept
        for m, r in zip(i.tolist(), j.tolist(), strict=True):
            if (m, r) not in kept:
                inner, outer = turned[m].mean(axis=0), rest[r].mean(axis=0)
                assert np.linalg.norm(inner - outer) > 1e-6


@given(st.integers(0, 10**6), st.floats(0.05, 3.0))
def test_pairs_with_a_common_point_are_kept(seed: int, sweep: float) -> None:
    """Bodies are built around a point that both hold at some angle of the turn: they do meet."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    point = rng.uniform(-5, 5, 3)
    back = rotation_about_line(np.zeros(3), axis, -float(rng.uniform(0, sweep)))[:3, :3] @ point

    def around(p):
        corners = rng.uniform(-1, 1, (5, 3))
        return np.vstack([corners, -corners.sum(axis=0)]) + p  # the mean, so a point of the hull, is p

    i, j = may_meet(around(back)[None], around(point)[None], axis, sweep)
    assert i.tolist() == [0] and j.tolist() == [0]


def test_a_pose_at_which_mujoco_gives_up_is_measured_beside_it() -> None:
    """Faces 5 and 18 overlap by 0.04 mm at this angle of crease 8, where MuJoCo tells a distance of 0."""
    plan = shuffled(breadth_first_net(icosahedron()), 3, 2.5)
    compiled = compile_model(plan)
    loaded = LoadedModel(compiled, plan.net)
    for turn in turns(plan, compiled.side):
        if turn.step == 16:
            break
        loaded.set_angle(turn.joint, turn.to_rad)
    mujoco.mj_kinematics(loaded.model, loaded.data)
    moving, rest = loaded.face_geom[18], loaded.face_geom[5]
    if turn.moving_faces[5]:
        moving, rest = rest, moving
    joint = loaded.joint[turn.joint]
    anchor, axis = loaded.data.xanchor[joint].copy(), loaded.data.xaxis[joint] * np.sign(turn.to_rad)
    pose = _Pose(loaded, np.array([moving]), anchor, axis)
    for degrees in np.linspace(36.8, 37.1, 301):
        found = pose.distance(int(moving), int(rest), 0, float(np.radians(degrees)), np.zeros(6))
        assert -0.06 < found < -0.01
