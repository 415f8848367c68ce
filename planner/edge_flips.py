"""Flipping edges of a goal mesh: which can be flipped, and how far the surface deviates when they are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from planner.dual_graph import DualGraph
from planner.goal_mesh import GoalMesh

__all__ = ["Flip", "flipped", "possible_flips"]

CROSSING_MARGIN = 0.02
"""The diagonals of a quadrilateral cross at least this share of their length away from their ends."""


@dataclass(frozen=True)
class Flip:
    """An edge of a goal that may be replaced by the other diagonal of its two faces.

    Attributes:
        edge: interior edge of the dual graph.
        faces: the two faces, which keep their numbers.
        corners: their corners after the flip.
        ends: goal vertices of the new edge, the lower number first.
        flat: the two faces are coplanar, so the shape stays the same.
        deviation_mm: old and new surface are nowhere further apart than this.
    """

    edge: int
    faces: tuple[int, int]
    corners: tuple[tuple[int, int, int], tuple[int, int, int]]
    ends: tuple[int, int]
    flat: bool
    deviation_mm: float


def possible_flips(graph: DualGraph, most_mm: float) -> list[Flip]:
    """Flips by which the surface deviates by at most ``most_mm``, least deviation first.

    Seen along the common perpendicular of its diagonals, a quadrilateral whose diagonals cross is convex, and
    old and new surface are graphs over it. Their difference is linear on the four triangles that the
    diagonals make and 0 on the sides, so it is largest where the diagonals cross: their distance.
    """
    goal = graph.goal
    points, faces = goal.vertices, goal.faces
    known = {
        (min(a, b), max(a, b)) for row in faces.tolist() for a, b in zip(row, [*row[1:], row[0]], strict=True)
    }
    found = []
    for edge, (one, other) in enumerate(graph.faces.tolist()):
        a, c = (int(faces[one, (graph.slots[edge, 0] + k) % 3]) for k in range(2))
        b = int(faces[one, (graph.slots[edge, 0] + 2) % 3])
        d = int(faces[other, (graph.slots[edge, 1] + 2) % 3])
        ends = (min(b, d), max(b, d))
        if b == d or ends in known:
            continue
        old, new = points[c] - points[a], points[d] - points[b]
        normal = np.cross(old, new)
        size = float(np.linalg.norm(normal))
        if size < 1e-9 * float(np.linalg.norm(old) * np.linalg.norm(new)):
            continue
        normal /= size
        gap = points[b] - points[a]
        # points a + s old and b + t new are nearest to each other
        s = float(np.dot(np.cross(gap, new), normal)) / size
        t = float(np.dot(np.cross(gap, old), normal)) / size
        if not all(CROSSING_MARGIN < share < 1.0 - CROSSING_MARGIN for share in (s, t)):
            continue
        deviation = abs(float(np.dot(gap, normal)))
        if deviation <= most_mm:
            corners = ((a, d, b), (d, c, b))
            found.append(Flip(edge, (one, other), corners, ends, bool(graph.flat[edge]), deviation))
    return sorted(found, key=lambda flip: (round(flip.deviation_mm, 9), flip.edge))


def flipped(goal: GoalMesh, flips: list[Flip]) -> GoalMesh:
    """``goal`` after ``flips``, none of which share a face.

    Raises:
        ValueError: if two of them share a face, so that their deviations would add up.
    """
    touched = [face for flip in flips for face in flip.faces]
    if len(set(touched)) < len(touched):
        raise ValueError("two flips share a face; flip edges of separate faces only")
    faces = goal.faces.copy()
    for flip in flips:
        faces[list(flip.faces)] = flip.corners
    return replace(goal, faces=faces)
