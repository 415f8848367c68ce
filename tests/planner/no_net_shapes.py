"""Goals that have no net: fans whose angles add up to more than a full turn, and a body with tall spikes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planner.goal_mesh import GoalMesh


def overlapping_fan(
    total_deg: float, count: int = 12, turn_deg: float = 340.0, size: float = 20.0
) -> GoalMesh:
    """An open fan of equal triangles around vertex 0 whose angles there add up to ``total_deg``.

    The rim goes up and down. Each inner edge has to be a crease, so above 360 degrees the one flat pattern
    overlaps: the last triangles lie on the first.
    """
    around = np.radians(np.linspace(0.0, turn_deg, count + 1))
    cosine, share = np.cos(np.radians(total_deg / count)), np.cos(around[1] - around[0])
    # neighbours at latitudes +e and -e: cos(angle) = cos(e)^2 cos(step) - sin(e)^2
    high = np.arccos(np.sqrt((1.0 + cosine) / (1.0 + share)))
    latitude = np.where(np.arange(count + 1) % 2 == 0, high, -high)
    flat = np.cos(latitude)
    rim = size * np.stack([flat * np.cos(around), flat * np.sin(around), np.sin(latitude)], axis=1)
    faces = [[0, k + 1, k + 2] for k in range(count)]
    return GoalMesh(np.concatenate([np.zeros((1, 3)), rim]), np.array(faces), name="fan")


def write_obj(goal: GoalMesh, path: Path) -> None:
    """Write a mesh with all digits."""
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in goal.vertices.tolist()]
    rows += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in goal.faces.tolist()]
    path.write_text("\n".join(rows) + "\n")
