"""What the viewer of the report needs, as plain values: hinge tree, sheet and steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planner.fold_plan import Bend, Clip, Cut, Fold, FoldPlan, Release, Rotate, Wait
from planner.kinematics import folded_triangles, rigid_fit
from planner.net import Net
from studio.report_heat import AGES_S
from studio.report_steps import StepSetting
from studio.words import blocked_text, degrees, step_op, step_text

__all__ = ["steps_values", "viewer_values"]

DIGITS_MM = 6
"""Decimals of lengths in the page: forward kinematics in the page stays within 1e-4 mm of the planner's."""


def _flat(values: ArrayLike, digits: int = DIGITS_MM) -> list[float]:
    rounded = np.round(np.asarray(values, dtype=np.float64).ravel(), digits) + 0.0
    return [int(v) if v == int(v) else v for v in rounded.tolist()]


def viewer_values(plan: FoldPlan, settings: Mapping[int, StepSetting] | None = None) -> dict[str, Any]:
    """Net, sheet and steps of a plan for the viewer, lengths in mm, angles in degrees.

    ``slot`` says, per face, at which of its corners its crease begins (0 for the base); it ends at the next
    one. Turning the face by a positive angle about end - start is a valley fold. ``fit`` is the motion
    (rotation row by row, then shift) that lays the goal, folded about the base face, over the reached shape.

    Args:
        plan: the plan.
        settings: step index → how it is burnt; gives the steps times and temperatures.
    """
    net, sheet = plan.net, plan.sheet
    creases = sorted(net.child_of)
    steps = steps_values(plan)
    for index, setting in (settings or {}).items():
        if setting.seconds is not None:
            steps[index]["seconds"] = round(setting.seconds, 2)
        if setting.start_c is not None:
            steps[index]["start"] = [round(v) for v in setting.start_c]
            steps[index]["after"] = [round(v) for v in setting.after_c]
    return {
        "base": int(net.base_face),
        "panel": net.base_panel.tolist(),
        "vertices": _flat(net.vertices),
        "faces": net.faces.ravel().tolist(),
        "parent": net.parent.tolist(),
        "order": net.order.tolist(),
        "creaseOf": net.crease_of.tolist(),
        "slot": [_slot(net, face) for face in range(len(net.faces))],
        "wanted": {str(e): degrees(float(net.fold_angle[e]), 6) for e in creases},
        "fit": _fit(plan),
        "sheet": {
            "outline": _flat(sheet.outline),
            "vertices": _flat(sheet.vertices, 3),
            "faces": sheet.faces.ravel().tolist(),
            "frame": np.flatnonzero(sheet.frame_faces).tolist(),
        },
        "tabs": [_flat((tab.start, tab.end), 3) for tab in sheet.tabs],
        "ages": list(AGES_S),
        "steps": steps,
        "blocked": [
            {"crease": b.crease, "face": net.child_of[b.crease], "text": blocked_text(b)}
            for b in plan.blocked
        ],
    }


def _slot(net: Net, face: int) -> int:
    """Corner of a face at which its crease begins; 0 for the base face."""
    if net.parent[face] < 0:
        return 0
    ends = set(net.edges[net.crease_of[face]].tolist())
    corners = net.faces[face].tolist()
    return next(k for k in range(3) if {corners[k], corners[(k + 1) % 3]} == ends)


def _fit(plan: FoldPlan) -> list[float]:
    """The best rigid motion of the goal onto the reached shape."""
    goal = folded_triangles(plan.net, plan.net.fold_angle).reshape(-1, 3)
    turn, shift = rigid_fit(goal, folded_triangles(plan.net, plan.final_angles).reshape(-1, 3))
    return [*_flat(turn, 9), *_flat(shift, 6)]


def steps_values(plan: FoldPlan) -> list[dict[str, Any]]:
    """Every step as plain values: ``op``, ``text`` and what the viewer needs to play it."""
    angles = np.zeros(len(plan.net.edges))
    out: list[dict[str, Any]] = []
    for step in plan.steps:
        before = float(angles[step.crease]) if isinstance(step, Fold) else 0.0
        values: dict[str, Any] = {"op": step_op(step), "text": step_text(plan, step, before)}
        match step:
            case Cut(paths=paths) | Release(paths=paths):
                values["paths"] = [_flat(path, 3) for path in paths]
            case Clip(faces=faces):
                values["faces"] = list(faces)
            case Bend(faces=faces, hinge=hinge, to_rad=to):
                values |= {"faces": list(faces), "hinge": _flat(hinge, 3), "to": degrees(to, 6)}
            case Rotate(to_rad=to):
                values["to"] = degrees(to, 6)
            case Fold(crease=crease, to_rad=to):
                values |= {"crease": crease, "face": plan.net.child_of[crease], "to": degrees(to, 6)}
                values["from"] = degrees(before, 6)
                angles[crease] = to
            case Wait(seconds=seconds):
                values["seconds"] = seconds
        out.append(values)
    return out
