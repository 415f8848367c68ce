"""Replay what the greedy planner returns by posing and sampling: shares no code with its kernels."""

from __future__ import annotations

import math

import fcl
import numpy as np

from tests.planner.contact_reference import body, hidden_share_reference, touch


def poses(tree, angles):
    """(F, 4, 4) pose of every face when the crease of face f stands at ``angles[f]``."""
    out = np.tile(np.eye(4), (len(tree.parent), 1, 1))
    for face in tree.order[1:].tolist():
        start = np.append(tree.corners[face, tree.slot[face]], 0.0)
        end = np.append(tree.corners[face, (tree.slot[face] + 1) % 3], 0.0)
        out[face] = out[tree.parent[face]] @ turn_about(start, end, angles[face])
    return out


def turn_about(start, end, angle):
    """(4, 4) right-handed turn about the line from start to end, by the quaternion formula."""
    u = (end - start) / np.linalg.norm(end - start)
    w, v = math.cos(angle / 2), math.sin(angle / 2) * u
    x, y, z = v
    out = np.eye(4)
    out[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    out[:3, 3] = start - out[:3, :3] @ start
    return out


def members(tree, face):
    """The faces that turn with ``face``."""
    out = {face}
    for other in tree.order.tolist():
        if int(tree.parent[other]) in out:
            out.add(other)
    return out


def panel(tree, face):
    """The faces joined to ``face`` by flat joints."""

    def root(f):
        while tree.parent[f] >= 0 and tree.target[f] == 0.0:
            f = int(tree.parent[f])
        return f

    return {f for f in range(len(tree.parent)) if root(f) == root(face)}


def shrunk(triangles, inset):
    """Triangles (K, 3, 3) with every side moved inwards by ``inset``; those that vanish are left out."""
    out = []
    for t in triangles:
        a, b, c = (np.linalg.norm(t[(k + 1) % 3] - t[(k + 2) % 3]) for k in range(3))
        r = np.linalg.norm(np.cross(t[1] - t[0], t[2] - t[0])) / (a + b + c)
        if r > 1.1 * inset:
            centre = (a * t[0] + b * t[1] + c * t[2]) / (a + b + c)
            out.append(centre + (t - centre) * (1 - inset / r))
    return np.array(out).reshape(-1, 3, 3)


def broken_rules(tree, result, *, clearance, hidden_max, max_tilt, step=0.0175):
    """What a replay of ``result.steps`` breaks, in words."""
    broken = []
    angles = np.zeros(len(tree.parent))
    rotary = 0.0
    flat = np.zeros((len(tree.parent), 3, 3))
    flat[:, :, :2] = tree.corners
    for number, (kind, which, value) in enumerate(result.steps.tolist()):
        if int(kind) == 0:
            rotary = value
            if min(abs(rotary), abs(rotary - math.pi)) > max_tilt + 1e-9:
                broken.append(f"step {number}: tilt {math.degrees(rotary)}")
            continue
        face = int(which)
        up = int(tree.parent[face])
        turn = value - angles[face]
        while up >= 0:
            if angles[up] != 0.0:
                broken.append(f"step {number}: face {face} turns while {up} is folded")
            up = int(tree.parent[up])
        if abs(value) > abs(tree.target[face]) + 1e-9 or value * tree.target[face] < 0:
            broken.append(f"step {number}: face {face} goes to {value}, wanted {tree.target[face]}")
        if turn * math.cos(rotary) <= 0:
            broken.append(f"step {number}: face {face} turns away from the beam")
        moving = members(tree, face)
        at = poses(tree, angles)
        world = np.einsum("fij,fkj->fki", at[:, :3, :3], flat) + at[:, None, :3, 3]
        start = np.append(tree.corners[face, tree.slot[face]], 0.0)
        end = np.append(tree.corners[face, (tree.slot[face] + 1) % 3], 0.0)
        skip = panel(tree, face) | panel(tree, int(tree.parent[face]))
        along = start[:2] - end[:2]
        # the beam in a frame that rotates with the sheet; the rotary axis lies along tree.axis
        axis = np.append(tree.axis, 0.0)
        beam = math.cos(rotary) * np.array([0, 0, 1.0]) + math.sin(rotary) * np.array(
            [-axis[1], axis[0], 0.0]
        )
        count = max(1, math.ceil(abs(turn) / step))
        mt = shrunk(world[sorted(moving)], clearance).reshape(-1, 3)
        st = shrunk(world[[f for f in range(len(world)) if f not in moving]], clearance).reshape(-1, 3)
        a, b = body(mt, np.arange(len(mt)).reshape(-1, 3)), body(st, np.arange(len(st)).reshape(-1, 3))
        assert np.linalg.norm(along) > 0
        for k in range(count + 1):
            M = turn_about(start, end, turn * k / count)
            a.setTransform(fcl.Transform(M[:3, :3], M[:3, 3]))
            if touch(a, b):
                angle = math.degrees(angles[face] + turn * k / count)
                broken.append(f"step {number}: face {face} touches at {angle:.2f}")
                break
        for k in range(0, count + 1, 5):
            M = turn_about(start, end, turn * k / count)
            now = world.copy()
            for f in moving:
                now[f] = world[f] @ M[:3, :3].T + M[:3, 3]
            above = now[[f for f in range(len(now)) if f not in skip]]
            inner = 0.02 * (end - start)
            hidden = hidden_share_reference(start + inner, end - inner, above, beam)
            if hidden > hidden_max + 1e-9:
                broken.append(f"step {number}: face {face} hidden {hidden:.3f}")
                break
        angles[face] = value
    if not np.allclose(angles, result.reached, atol=1e-9):
        broken.append("the angles reached are not those of the steps")
    return broken
