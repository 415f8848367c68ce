"""Figures that describe a goal mesh."""

from __future__ import annotations

import numpy as np

from planner.goal_mesh import GoalMesh
from planner.mesh_edges import boundary_loops, edge_table, face_heights, fold_angles
from planner.net import FLAT_FOLD_RAD

__all__ = ["describe_mesh"]


def describe_mesh(goal: GoalMesh) -> dict[str, object]:
    """Figures of a goal mesh, ready for JSON.

    Returns:
        ``name``, ``faces``, ``vertices``, ``edges``, ``closed``, ``boundary_loops``, ``genus``,
        ``size_mm`` (x, y, z), ``longest_side_mm``, ``area_mm2``, ``volume_mm3`` (None if open),
        ``min_edge_mm``, ``max_edge_mm``, ``min_height_mm``, the numbers of ``convex_edges``,
        ``reflex_edges``, ``flat_edges`` and ``boundary_edges``, ``steepest_fold_deg`` and ``notices``.
    """
    table = edge_table(goal.faces)
    folds = fold_angles(goal.vertices, goal.faces, table)
    ends = goal.vertices[table.edges]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    size = np.ptp(goal.vertices, axis=0)
    a, b, c = (goal.vertices[goal.faces[:, k]] - goal.vertices[0] for k in range(3))
    normals = np.cross(b - a, c - a)
    loops = boundary_loops(table)
    euler = len(goal.vertices) - len(table.edges) + len(goal.faces)
    return {
        "name": goal.name,
        "faces": len(goal.faces),
        "vertices": len(goal.vertices),
        "edges": len(table.edges),
        "closed": loops == 0,
        "boundary_loops": loops,
        "genus": (2 - loops - euler) // 2,
        "size_mm": [float(s) for s in size],
        "longest_side_mm": goal.longest_side_mm,
        "area_mm2": float(np.linalg.norm(normals, axis=1).sum() / 2.0),
        "volume_mm3": None if loops else float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0),
        "min_edge_mm": float(lengths.min()),
        "max_edge_mm": float(lengths.max()),
        "min_height_mm": float(face_heights(goal.vertices, goal.faces).min()),
        "convex_edges": int((folds >= FLAT_FOLD_RAD).sum()),
        "reflex_edges": int((folds <= -FLAT_FOLD_RAD).sum()),
        "flat_edges": int((np.abs(folds) < FLAT_FOLD_RAD).sum()),
        "boundary_edges": int((table.count == 1).sum()),
        "steepest_fold_deg": float(np.degrees(np.abs(folds).max(initial=0.0))),
        "notices": list(goal.notices),
    }
