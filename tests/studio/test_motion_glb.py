"""The animated glTF shows the pose that the planner's forward kinematics gives."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pygltflib import GLTF2

from planner.fold_plan import Fold, Rotate
from planner.kinematics import folded_triangles, rotation_about_line
from studio.motion_glb import STEP_SECONDS, motion_glb
from tests.studio.small_plan import small_plan


class Player:
    """A plain reader of animated glTF: nodes at a time, by the letter of the specification."""

    def __init__(self, data):
        self.gltf = GLTF2.load_from_bytes(data)
        self.blob = self.gltf.binary_blob()

    def values(self, number):
        accessor = self.gltf.accessors[number]
        view = self.gltf.bufferViews[accessor.bufferView]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor.type]
        array = np.frombuffer(self.blob, np.float32, accessor.count * width, view.byteOffset)
        return array.reshape(accessor.count, width).astype(float)

    def sample(self, sampler, time):
        times, values = self.values(sampler.input)[:, 0], self.values(sampler.output)
        if time <= times[0]:
            return values[0]
        if time >= times[-1]:
            return values[-1]
        k = int(np.searchsorted(times, time, side="right")) - 1
        if sampler.interpolation == "STEP":
            return values[k]
        share = (time - times[k]) / (times[k + 1] - times[k])
        a, b = values[k], values[k + 1]
        if np.dot(a, b) < 0:
            b = -b
        angle = math.acos(min(1.0, float(np.dot(a, b))))
        if angle < 1e-9:
            return a
        return (math.sin((1 - share) * angle) * a + math.sin(share * angle) * b) / math.sin(angle)

    def matrices(self, time):
        moved = {}
        animation = self.gltf.animations[0]
        for channel in animation.channels:
            moved[channel.target.node, channel.target.path] = self.sample(
                animation.samplers[channel.sampler], time
            )
        out = {}

        def walk(number, above):
            node = self.gltf.nodes[number]
            x, y, z, w = moved.get((number, "rotation"), node.rotation or [0, 0, 0, 1])
            local = np.eye(4)
            local[:3, :3] = [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
            local[:3, :3] *= moved.get((number, "scale"), np.array(node.scale or [1, 1, 1]))
            local[:3, 3] = node.translation or [0, 0, 0]
            out[node.name] = above @ local
            for child in node.children:
                walk(child, out[node.name])

        walk(self.gltf.scenes[0].nodes[0], np.eye(4))
        return out

    def corners(self, name):
        node = next(n for n in self.gltf.nodes if n.name == name)
        return self.values(self.gltf.meshes[node.mesh].primitives[0].attributes.POSITION)


@pytest.fixture(scope="module")
def plan():
    return small_plan()


@pytest.fixture(scope="module")
def player(plan):
    return Player(motion_glb(plan))


def moments(plan):
    """Time, angles and rotary angle after every step and in the middle of every fold and rotation."""
    angles, rotary, now = np.zeros(len(plan.net.edges)), 0.0, 0.0
    for step in plan.steps:
        took = STEP_SECONDS[type(step).__name__]
        before, turned = angles.copy(), rotary
        if isinstance(step, Fold):
            angles[step.crease] = step.to_rad
        if isinstance(step, Rotate):
            rotary = step.to_rad
        yield now + took / 2, (before + angles) / 2, (turned + rotary) / 2
        now += took
        yield now, angles.copy(), rotary


def test_every_face_is_where_forward_kinematics_puts_it(plan, player):
    up = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)  # z up, as in the sheet, to y up, as in glTF
    for time, angles, rotary in moments(plan):
        matrices = player.matrices(time)
        turn = rotation_about_line(np.zeros(3), np.array([1.0, 0, 0]), rotary)[:3, :3]
        wanted = folded_triangles(plan.net, angles) @ turn.T @ up.T * 0.001
        for face in range(len(plan.net.faces)):
            matrix = matrices[f"face {face}"]
            shown = player.corners(f"face {face}") @ matrix[:3, :3].T + matrix[:3, 3]
            np.testing.assert_allclose(shown, wanted[face], atol=1e-7)  # float32 metres


def test_clipped_pieces_vanish_and_the_sheet_at_last(plan, player):
    first, last = 0.0, sum(STEP_SECONDS[type(s).__name__] for s in plan.steps)
    clipped_at = STEP_SECONDS["Cut"] + STEP_SECONDS["Clip"]
    for name, gone in (("piece of step 1", clipped_at), ("sheet", last)):
        assert np.linalg.det(player.matrices(first)[name]) > 0
        assert np.linalg.det(player.matrices(gone - 1e-3)[name]) > 0
        assert np.linalg.det(player.matrices(gone + 1e-3)[name]) == 0


def test_other_readers_open_it(plan):
    trimesh = pytest.importorskip("trimesh")
    import io

    scene = trimesh.load(io.BytesIO(motion_glb(plan)), file_type="glb")
    assert {f"face {f}" for f in range(len(plan.net.faces))} <= set(scene.graph.nodes)
    area = sum(g.area for name, g in scene.geometry.items() if name.startswith("face"))
    flat = plan.net.vertices[plan.net.faces]
    u, v = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    assert area == pytest.approx(0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum(), rel=1e-5)


def test_same_plan_same_bytes(plan):
    assert motion_glb(plan) == motion_glb(small_plan())
