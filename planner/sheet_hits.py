"""Which triangles of the sheet the folds of a plan touch, by the exact contact kernel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Sheet
from planner.fold_problem import FlatTree, FoldProblem, FoldResult, bounding_spheres

__all__ = ["sheet_hits", "sheet_solids"]


def sheet_solids(sheet: Sheet, thickness: float) -> NDArray[np.float64]:
    """(T, 12, 3) the substrate triangles as solids: prism, triangle, triangle; the frame with its bars."""
    flat = np.zeros((len(sheet.faces), 3, 3))
    flat[:, :, :2] = sheet.triangles
    up = np.zeros((len(flat), 1, 3))
    up[:, 0, 2] = np.where(sheet.frame_faces, max(0.5 * thickness, sheet.clamp_height), 0.5 * thickness)
    return np.concatenate([flat + up, flat - up, flat, flat], axis=1)


def sheet_hits(
    tree: FlatTree, result: FoldResult, problem: FoldProblem, bodies: NDArray[np.float64]
) -> dict[int, int]:
    """Substrate triangles that the folds sweep → number of the first fold that does."""
    from planner._kernels.contact_kernels import turn_contact
    from planner._kernels.plan_kernels import turn_solids

    count = len(tree.parent)
    solids = np.concatenate([problem.solids(tree), bodies])
    centres, radii = bounding_spheres(solids)
    preorder, first, last = tree.subtrees
    hinges, _ = tree.hinge_lines
    present = np.arange(len(solids)) >= count
    moving, work = np.zeros(len(solids), np.bool_), np.empty((30, 3))
    sharp = np.concatenate([problem.sharp, np.zeros(len(bodies), np.bool_)])
    angle = np.zeros(count)
    found: dict[int, int] = {}
    for number, (_, which, value) in enumerate(result.steps[result.steps[:, 0] == 1].tolist()):
        face = int(which)
        turn = value - angle[face]
        members = preorder[first[face] : last[face]]
        ox, oy, ux, uy = (float(x) for x in hinges[face])
        sign = math.copysign(1.0, turn)
        moving[members] = True
        while True:
            _, _, body = turn_contact(
                face, int(tree.parent[face]), members, moving, solids, centres, radii, sharp, present,
                ox, oy, sign * ux, sign * uy, abs(turn), work,
            )  # fmt: skip
            if body < 0:
                break
            found[int(body) - count] = number
            present[body] = False
        moving[members] = False
        turn_solids(solids, centres, members, ox, oy, ux, uy, turn)
        angle[face] = value
    return found
