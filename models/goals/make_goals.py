"""Writes the shipped goal shapes: ``python -m models.goals.make_goals [FOLDER]``.

Without a folder they are written beside this file. The same bytes come out on every machine: coordinates
are rounded to 1e-6 mm, nothing is random.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from models.goals.creature import creature_coarse, creature_fine
from models.goals.folded_panels import Mesh
from models.goals.sheet_shapes import (
    antenna,
    box_with_lid,
    bracket,
    bug_robot,
    crown,
    drone_frame,
    flower,
)
from models.goals.solid_shapes import snail_tube, star

__all__ = ["LONGEST_SIDE_MM", "SHAPES", "goal_text", "make_goals"]

LONGEST_SIDE_MM = 60.0

SHAPES: dict[str, Callable[[], Mesh]] = {
    "antenna": antenna,
    "box_with_lid": box_with_lid,
    "bracket": bracket,
    "bug_robot": bug_robot,
    "creature_coarse": creature_coarse,
    "creature_fine": creature_fine,
    "crown": crown,
    "drone_frame": drone_frame,
    "flower": flower,
    "snail_tube": snail_tube,
    "star": star,
}


def _scaled(vertices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vertices (V, 3) with a longest side of 60 mm, centred over the origin, lowest point at z = 0."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    origin = np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]])
    scaled: NDArray[np.float64] = (vertices - origin) * (LONGEST_SIDE_MM / float((high - low).max()))
    return scaled


def goal_text(name: str) -> str:
    """The OBJ file of a shape, mm."""
    vertices, faces = SHAPES[name]()
    lines = [f"# {name}: goal shape of Metal Blossom, mm; made by make_goals.py, Apache-2.0"]
    lines += [
        "v " + " ".join(f"{value:.6f}".rstrip("0").rstrip(".") for value in point)
        for point in np.round(_scaled(vertices), 6) + 0.0
    ]
    lines += ["f " + " ".join(str(k + 1) for k in face) for face in faces.tolist()]
    return "\n".join(lines) + "\n"


def make_goals(folder: Path) -> list[Path]:
    """Write every shape to ``folder`` and return the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name in SHAPES:
        path = folder / f"{name}.obj"
        path.write_bytes(goal_text(name).encode("ascii"))
        paths.append(path)
    return paths


if __name__ == "__main__":
    make_goals(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
