"""Draws the pictures of the documents: ``python docs/make_pictures.py`` writes docs/pictures/*.png."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from painter import INSIDE, OUTSIDE, PAPER, SHEET, Painting, camera, projection, write_png

from models.goals import goal_names, goal_path
from planner.fold_plan import Clip, Fold, FoldPlan
from planner.kinematics import folded_triangles

PICTURES = Path(__file__).parent / "pictures"
TILE, COLUMNS = 300, 4


def read_obj(path: Path) -> NDArray[np.float64]:
    """(F, 3, 3) triangles of a plain OBJ file."""
    rows = [line.split() for line in path.read_text(encoding="ascii").splitlines()]
    vertices = np.array([[float(x) for x in row[1:4]] for row in rows if row[0] == "v"])
    return vertices[[[int(x) - 1 for x in row[1:4]] for row in rows if row[0] == "f"]]


def goals_picture() -> NDArray[np.uint8]:
    """All shipped goal shapes in rows, in the order of their names: outside blue, inside orange."""
    names = goal_names()
    rows = -(-len(names) // COLUMNS)
    sheet = np.tile(PAPER.astype(np.uint8), (rows * TILE, COLUMNS * TILE, 1))
    for number, name in enumerate(names):
        triangles = read_obj(goal_path(name))
        matrix, offset = projection(triangles.reshape(-1, 3), camera(), TILE, TILE)
        painting = Painting(TILE, TILE)
        draw_net(painting, triangles @ matrix.T + offset)
        row, column = divmod(number, COLUMNS)
        sheet[row * TILE : (row + 1) * TILE, column * TILE : (column + 1) * TILE] = painting.pixels()
    return sheet


def draw_net(painting: Painting, triangles: NDArray[np.float64]) -> None:
    """Paint triangles (F, 3, 3) given in pixels, and their edges."""
    for corners in triangles:
        painting.triangle(corners, OUTSIDE, INSIDE)
    for corners in triangles:
        for k in range(3):
            painting.line(corners[k], corners[(k + 1) % 3])


def folding_picture(plan: FoldPlan, frames: int, height: int, width: int) -> NDArray[np.uint8]:
    """The part in its sheet at evenly spread moments of a plan, and at last without the sheet."""
    flat = np.column_stack([plan.sheet.outline, np.zeros(len(plan.sheet.outline))])
    final = folded_triangles(plan.net, plan.final_angles).reshape(-1, 3)
    matrix, offset = projection(np.vstack([flat, final]), camera(-30.0, 42.0), height, width)
    folds = [number for number, step in enumerate(plan.steps) if isinstance(step, Fold)]
    moments = [folds[k] for k in np.linspace(0, len(folds) - 1, frames - 1).round().astype(int)[1:]]
    pictures = []
    for last in [folds[0] - 1, *moments]:
        angles = np.zeros(len(plan.net.edges))
        present = np.ones(len(plan.sheet.faces), dtype=bool)
        for step in plan.steps[: last + 1]:
            if isinstance(step, Fold):
                angles[step.crease] = step.to_rad
            elif isinstance(step, Clip):
                present[list(step.faces)] = False
        painting = Painting(height, width)
        for triangle in plan.sheet.triangles[present]:
            corners = np.column_stack([triangle, np.zeros(3)])
            painting.triangle(corners @ matrix.T + offset, SHEET, SHEET)
        draw_net(painting, folded_triangles(plan.net, angles) @ matrix.T + offset)
        pictures.append(painting.pixels())
    matrix, offset = projection(final, camera(-30.0, 42.0), height, width)
    painting = Painting(height, width)
    draw_net(painting, folded_triangles(plan.net, plan.final_angles) @ matrix.T + offset)
    return np.concatenate([*pictures, painting.pixels()], axis=1)


if __name__ == "__main__":
    write_png(PICTURES / "goals.png", goals_picture())
    from planner import make_net, plan_folds, read_goal
    from rigs import load_material, load_rig, machine_limits

    limits = machine_limits(load_rig("grbl-4axis"), load_material("304"))
    net = make_net(read_goal(goal_path("bug_robot"), limits=limits), seed=0)
    write_png(PICTURES / "folding.png", folding_picture(plan_folds(net, limits, seed=0), 4, 300, 400))
