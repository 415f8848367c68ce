"""A fold plan as one FOLD 1.2 file with a frame for every fold, for tools such as Origami Simulator."""

from __future__ import annotations

import json
import math
import os

import numpy as np
from numpy.typing import NDArray

from planner.atomic_file import write_atomic
from planner.fold_plan import Fold, FoldPlan
from planner.kinematics import folded_triangles

__all__ = ["fold_frames", "write_fold_frames"]

_DIGITS = 5


def fold_frames(plan: FoldPlan, most_frames: int = 400) -> dict[str, object]:
    """The file as plain values: the crease pattern, then the folded form after every fold.

    Vertices belong to the key frame; every further frame inherits all of it but the coordinates and the
    angles that
    the creases have then. A vertex at which slits meet stands for several points once the part is folded,
    so each
    panel between cuts has vertices of its own.

    Args:
        plan: the plan.
        most_frames: of a longer plan only every so many-th fold gets a frame, and the last one.
    """
    net = plan.net
    faces, points, source = _split_vertices(plan)
    edges, assignment, angles, index = _edges(plan, faces, source)
    folds = [(number, step) for number, step in enumerate(plan.steps) if isinstance(step, Fold)]
    every = max(1, math.ceil(len(folds) / max(most_frames, 1)))
    now = np.zeros(len(net.edges))
    frames: list[dict[str, object]] = []
    for count, (number, step) in enumerate(folds, 1):
        now[step.crease] = step.to_rad
        if count % every and count != len(folds):
            continue
        corners = folded_triangles(net, now)
        place = np.zeros((len(points), 3))
        place[faces] = corners
        frames.append(
            {
                "frame_title": f"step {number}: crease {step.crease} to {math.degrees(step.to_rad):.1f}°",
                "frame_classes": ["foldedForm"],
                "frame_attributes": ["3D", "cuts"],
                "frame_parent": 0,
                "frame_inherit": True,
                "vertices_coords": _rounded(place),
                "edges_foldAngle": [
                    round(math.degrees(float(now[k])), _DIGITS) if k >= 0 else 0.0 for k in index
                ],
            }
        )
    return {
        "file_spec": 1.2,
        "file_creator": "metal-blossom",
        "file_title": f"{net.goal.name}, folded step by step",
        "file_classes": ["animation"],
        "frame_title": "flat",
        "frame_classes": ["creasePattern"],
        "frame_attributes": ["2D", "cuts"],
        "frame_unit": "mm",
        "vertices_coords": [row[:2] for row in _rounded(points)],
        "edges_vertices": edges,
        "edges_assignment": assignment,
        "edges_foldAngle": angles,
        "faces_vertices": faces.tolist(),
        "file_frames": frames,
    }


def write_fold_frames(plan: FoldPlan, path: str | os.PathLike[str], most_frames: int = 400) -> None:
    """Write ``fold_frames`` of a plan.

    Raises:
        OSError: if the file cannot be written.
    """
    rows = [
        f"{json.dumps(k)}: {json.dumps(v, separators=(',', ':'))}"
        for k, v in fold_frames(plan, most_frames).items()
    ]
    write_atomic(path, ("{\n" + ",\n".join(rows) + "\n}\n").encode())


def _rounded(points: NDArray[np.float64]) -> list[list[float]]:
    values: list[list[float]] = (np.round(points, _DIGITS) + 0.0).tolist()
    return values


def _split_vertices(
    plan: FoldPlan,
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """(F, 3) faces over vertices that no slit joins, their flat places (V, 3), and the net vertex of each."""
    net = plan.net
    corner = np.arange(3 * len(net.faces)).reshape(-1, 3)
    for face in net.order[1:].tolist():
        up = int(net.parent[face])
        for vertex in net.edges[int(net.crease_of[face])].tolist():
            mine = corner[face][net.faces[face] == vertex][0]
            theirs = corner[up][net.faces[up] == vertex][0]
            corner[corner == mine] = theirs
    names, faces = np.unique(corner, return_inverse=True)
    faces = faces.reshape(-1, 3)
    source = net.faces.reshape(-1)[names]
    return faces, np.column_stack([net.vertices[source], np.zeros(len(names))]), source


def _edges(
    plan: FoldPlan, faces: NDArray[np.int64], source: NDArray[np.int64]
) -> tuple[list[list[int]], list[str], list[float], list[int]]:
    """Edges of the split vertices with assignment, final angle, and the crease of the net (-1: a cut)."""
    net = plan.net
    crease = {
        tuple(sorted(net.edges[k].tolist())): k for k in range(len(net.edges)) if net.assignment[k] != "B"
    }
    users: dict[tuple[int, int], int] = {}
    for a, b, c in faces.tolist():
        for ends in ((a, b), (b, c), (c, a)):
            key = (min(ends), max(ends))
            users[key] = users.get(key, 0) + 1
    edges, letters, angles, index = [], [], [], []
    final = plan.final_angles
    for (a, b), count in sorted(users.items()):
        number = crease.get(tuple(sorted((int(source[a]), int(source[b])))), -1) if count > 1 else -1
        edges.append([a, b])
        index.append(number)
        angle = float(final[number]) if number >= 0 else 0.0
        if number < 0:
            letters.append("B")
        elif angle == 0.0:
            letters.append("F")
        else:
            letters.append("V" if angle > 0.0 else "M")
        angles.append(round(math.degrees(angle), _DIGITS))
    return edges, letters, angles, index
