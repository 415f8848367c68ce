"""``goal.ply`` brings a goal mesh back bit for bit, here and in a foreign reader."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from planner.errors import FormatError
from planner.goal_file import read_goal_ply, write_goal_ply
from planner.goal_mesh import GoalMesh
from planner.read_goal import read_goal

coordinates = arrays(np.float64, (5, 3), elements=st.floats(-1e6, 1e6, allow_subnormal=False))


@given(vertices=coordinates, faces=st.permutations([[0, 1, 2], [2, 1, 3], [4, 2, 3]]))
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_round_trip_is_exact(tmp_path, vertices, faces):
    goal = GoalMesh(vertices, faces)
    write_goal_ply(goal, tmp_path / "goal.ply")
    first = (tmp_path / "goal.ply").read_bytes()
    back = read_goal_ply(tmp_path / "goal.ply")
    assert back.sha256 == goal.sha256
    write_goal_ply(back, tmp_path / "goal.ply")
    assert (tmp_path / "goal.ply").read_bytes() == first


def test_a_foreign_reader_sees_the_same_mesh(tmp_path, shared_meshes):
    import trimesh

    goal = read_goal(shared_meshes / "real" / "bunny-128.obj")
    write_goal_ply(goal, tmp_path / "goal.ply")
    mesh = trimesh.load(tmp_path / "goal.ply", process=False)
    assert np.array_equal(mesh.vertices, goal.vertices)
    assert np.array_equal(mesh.faces, goal.faces)


def test_damaged_files_are_refused(tmp_path):
    goal = GoalMesh([[0, 0, 0], [60, 0, 0], [0, 40, 0]], [[0, 1, 2]])
    path = tmp_path / "goal.ply"
    with pytest.raises(FormatError, match="cannot be read"):
        read_goal_ply(path)
    write_goal_ply(goal, path)
    whole = path.read_bytes()
    for end in range(len(whole)):
        path.write_bytes(whole[:end])
        with pytest.raises(FormatError, match=r"goal\.ply"):
            read_goal_ply(path)
