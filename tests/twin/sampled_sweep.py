"""The sweep done the slow way: MuJoCo's collision detection at poses so near that nothing slips through."""

from __future__ import annotations

import mujoco
import numpy as np

from planner.fold_plan import FoldPlan
from planner.net import Net
from twin.loaded_model import LoadedModel
from twin.mjcf_model import CompiledModel
from twin.timeline import turns

NUDGES_RAD = (0.0, 1e-7)
"""Every pose is looked at twice: MuJoCo 4.0.1 finds no contact in some poses of prisms that overlap."""


def _joined(net: Net, one: int, other: int) -> bool:
    return int(net.parent[one]) == other or int(net.parent[other]) == one


def sampled_hits(
    compiled: CompiledModel, plan: FoldPlan, tolerances_mm: tuple[float, ...], finest: float = 0.5
) -> list[dict[tuple[int, frozenset[tuple[str, int]]], tuple[float, float]]]:
    """(step, pair) → (angle before, angle of the first hit), for each tolerance.

    Between two poses no tip moves by more than ``finest`` * thickness.
    """
    loaded = LoadedModel(compiled, plan.net)
    model, data = loaded.model, loaded.data
    net = plan.net
    # MuJoCo leaves out pairs of a body and its parent; panels of several faces may meet beside their hinge.
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_FILTERPARENT)
    model.exclude_signature[:] = 0
    found: list[dict[tuple[int, frozenset[tuple[str, int]]], tuple[float, float]]] = [
        {} for _ in tolerances_mm
    ]
    for turn in turns(plan, compiled.side):
        mujoco.mj_kinematics(model, data)
        joint = loaded.joint[turn.joint]
        moving = loaded.face_geom[turn.moving_faces]
        reach = np.linalg.norm(
            np.cross(data.geom_xpos[moving] - data.xanchor[joint], data.xaxis[joint]), axis=1
        )
        radius = (reach + model.geom_rbound[moving]).max()
        sweep = turn.to_rad - turn.from_rad
        count = max(1, int(np.ceil(abs(sweep) * radius / (finest * plan.limits.thickness))))
        loaded.moving_contacts_on(turn)
        before = turn.from_rad
        for angle in np.linspace(turn.from_rad, turn.to_rad, count + 1):
            for nudge in NUDGES_RAD:
                loaded.set_angle(turn.joint, float(angle) + nudge)
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)
                for n in np.flatnonzero(data.contact.dist < 0.0).tolist():
                    pair = frozenset(loaded.owner[int(g)] for g in data.contact.geom[n])
                    faces = sorted(k for kind, k in pair if kind == "face")
                    if len(faces) == 2 and _joined(net, *faces):
                        continue
                    for hits, tolerance in zip(found, tolerances_mm, strict=True):
                        if data.contact.dist[n] < -tolerance:
                            hits.setdefault((turn.step, pair), (float(before), float(angle)))
            before = angle
        loaded.set_angle(turn.joint, turn.to_rad)
    return found
