"""What the viewer of the report needs, as plain values: hinge tree, sheet and steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from planner.fold_plan import Bend, Clip, Cut, Fold, FoldPlan, Release, Rotate, Wait
from studio.words import blocked_text, degrees, step_op, step_text

__all__ = ["steps_values", "viewer_values"]

DIGITS_MM = 5
"""Decimals of lengths in the page: forward kinematics in the page stays within 1e-4 mm of the planner's."""


def _flat(values: ArrayLike, digits: int = DIGITS_MM) -> list[float]:
    rounded = np.round(np.asarray(values, dtype=np.float64).ravel(), digits) + 0.0
    return [int(v) if v == int(v) else v for v in rounded.tolist()]


def viewer_values(plan: FoldPlan) -> dict[str, Any]:
    """Net, sheet and steps of a plan for the viewer, lengths in mm, angles in degrees.

    ``hinge`` holds, per face, start x, y and end x, y of its crease in the flat net (zeros for the base):
    turning the face by a positive angle about end - start is a valley fold.
    """
    net, sheet = plan.net, plan.sheet
    hinges = np.zeros((len(net.faces), 4))
    for face in net.order.tolist()[1:]:
        start, end = net.hinge(face)
        hinges[face, :2], hinges[face, 2:] = start, end
    creases = sorted(net.child_of)
    return {
        "base": int(net.base_face),
        "panel": net.base_panel.tolist(),
        "vertices": _flat(net.vertices),
        "faces": net.faces.ravel().tolist(),
        "parent": net.parent.tolist(),
        "order": net.order.tolist(),
        "creaseOf": net.crease_of.tolist(),
        "hinge": _flat(hinges),
        "wanted": {str(e): degrees(float(net.fold_angle[e]), 6) for e in creases},
        "sheet": {
            "outline": _flat(sheet.outline),
            "vertices": _flat(sheet.vertices, 3),
            "faces": sheet.faces.ravel().tolist(),
            "frame": np.flatnonzero(sheet.frame_faces).tolist(),
        },
        "steps": steps_values(plan),
        "blocked": [
            {"crease": b.crease, "face": net.child_of[b.crease], "text": blocked_text(b)}
            for b in plan.blocked
        ],
        "thickness": plan.limits.thickness,
    }


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
