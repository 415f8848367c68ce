"""FOLD files with a frame per fold: the rules of the specification, and the poses of the plan."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from planner.fold_frames import fold_frames, write_fold_frames
from planner.fold_plan import Fold
from planner.kinematics import folded_triangles
from planner.make_net import make_net
from planner.plan_folds import plan_folds
from tests.rigs.made_jobs import made_plan
from tests.studio.small_plan import small_plan

PLANS = {
    "star": lambda: made_plan("star"),
    "box": lambda: made_plan("box"),
    "ball": lambda: made_plan("ball"),
    "small": small_plan,
}


@pytest.fixture(scope="module", params=PLANS)
def plan(request):
    return PLANS[request.param]()


def fold_rules(data: dict) -> None:
    """What FOLD 1.2 asks of files and frames (edemaine/fold, doc/spec.md)."""
    assert data["file_spec"] == 1.2 and data["file_creator"]
    assert set(data["file_classes"]) <= {"singleModel", "multiModel", "animation", "diagrams"}
    frames = [data, *data["file_frames"]]
    classes = {"creasePattern", "foldedForm", "graph", "linkage"}
    for number, frame in enumerate(frames):
        assert set(frame["frame_classes"]) <= classes
        if number:
            assert 0 <= frame["frame_parent"] < number and frame["frame_inherit"] is True
        merged = {**data, **frame}
        vertices, edges = len(merged["vertices_coords"]), merged["edges_vertices"]
        assert all(0 <= v < vertices for edge in edges for v in edge) and len(
            {tuple(sorted(e)) for e in edges}
        ) == len(edges)
        assert len(merged["edges_assignment"]) == len(merged["edges_foldAngle"]) == len(edges)
        assert set(merged["edges_assignment"]) <= set("VMFBUCJ")
        known = {tuple(sorted(e)) for e in edges}
        for face in merged["faces_vertices"]:
            assert len(set(face)) == len(face) == 3
            assert all(tuple(sorted((face[k], face[k - 1]))) in known for k in range(3))
        assert all(-180.0 <= a <= 180.0 for a in merged["edges_foldAngle"])
        assert all(
            len(p) == (2 if "2D" in frame["frame_attributes"] else 3) for p in frame["vertices_coords"]
        )
    for letter, angle in zip(data["edges_assignment"], data["edges_foldAngle"], strict=True):
        assert {"V": angle > 0, "M": angle < 0}.get(letter, angle == 0)


def test_the_rules_of_the_format(plan):
    fold_rules(fold_frames(plan))


def test_every_fold_has_its_pose(plan):
    data = fold_frames(plan)
    now = np.zeros(len(plan.net.edges))
    folds = [step for step in plan.steps if isinstance(step, Fold)]
    assert len(data["file_frames"]) == len(folds)
    faces = np.array(data["faces_vertices"])
    for step, frame in zip(folds, data["file_frames"], strict=True):
        now[step.crease] = step.to_rad
        points = np.array(frame["vertices_coords"])
        assert np.abs(points[faces] - folded_triangles(plan.net, now)).max() < 2e-5
        assert any(abs(a - math.degrees(step.to_rad)) < 1e-4 for a in frame["edges_foldAngle"])


def test_fold_angles_are_those_between_the_faces(plan):
    """The angle of each crease, measured between the normals of its faces in the last frame."""
    data = fold_frames(plan)
    faces = np.array(data["faces_vertices"])
    points = np.array(data["file_frames"][-1]["vertices_coords"])
    a, b, c = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    for ends, letter, angle in zip(
        data["edges_vertices"],
        data["edges_assignment"],
        data["file_frames"][-1]["edges_foldAngle"],
        strict=True,
    ):
        beside = [f for f, face in enumerate(faces.tolist()) if set(ends) <= set(face)]
        if letter == "B":
            assert len(beside) == 1
        else:
            between = math.degrees(math.acos(np.clip(normal[beside[0]] @ normal[beside[1]], -1.0, 1.0)))
            assert between == pytest.approx(abs(angle), abs=0.01)


def test_long_plans_are_thinned_and_the_file_is_the_same_every_time(plan, tmp_path):
    thin = fold_frames(plan, most_frames=2)
    assert 1 <= len(thin["file_frames"]) <= 3
    assert thin["file_frames"][-1] == fold_frames(plan)["file_frames"][-1]
    write_fold_frames(plan, tmp_path / "a.fold")
    write_fold_frames(plan, tmp_path / "b.fold")
    assert (tmp_path / "a.fold").read_bytes() == (tmp_path / "b.fold").read_bytes()
    assert json.loads((tmp_path / "a.fold").read_text()) == json.loads(json.dumps(fold_frames(plan)))


@pytest.mark.slow
def test_a_scan(shared_meshes):
    from planner.read_goal import read_goal
    from rigs.limits import machine_limits
    from rigs.material import load_material
    from rigs.rig import load_rig

    limits = machine_limits(load_rig("grbl-4axis"), load_material("304"))
    goal = read_goal(shared_meshes / "real" / "bunny-48.obj", size_mm=60.0, limits=limits)
    fold_rules(fold_frames(plan_folds(make_net(goal), limits)))
