"""Whether the folds of a plan stay clear of a neck at a corner of the base panel, by the contact kernel."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from planner.corner_tabs import Neck
from planner.fold_problem import FlatTree, FoldProblem, FoldResult, bounding_spheres

__all__ = ["neck_bodies", "petal_rests", "stays_clear"]

_SLIVER_MM2 = 1e-9
_THIN_MM = 1e-3  # half the height of a middle triangle as a body: the kernel wants solids


def stays_clear(neck: Neck, tree: FlatTree, result: FoldResult, problem: FoldProblem) -> bool:
    """True if no face touches the neck while the folds of ``result`` are made.

    The petals beside the neck move without the corners that they lost to it; a kerf lies between.

    Args:
        neck: the neck, in the plane of ``tree``.
        tree: the placed net.
        result: what the fold planner did with it, its steps in order.
        problem: thickness and insets.
    """
    from planner._kernels.contact_kernels import turn_contact
    from planner._kernels.plan_kernels import turn_solids

    faces = problem.solids(tree)
    owner, rests = petal_rests(neck, faces, problem.sharp)
    bodies = neck_bodies(neck, problem.limits.thickness)
    count, extra = len(faces), len(rests)
    solids = np.concatenate([faces, rests, bodies])
    centres, radii = bounding_spheres(solids)
    present = np.arange(len(solids)) >= count + extra
    sharp = np.concatenate([problem.sharp, np.zeros(len(solids) - count, np.bool_)])
    trimmed = np.zeros(count, np.bool_)
    trimmed[list(neck.fan)] = True
    preorder, first, last = tree.subtrees
    hinges, _ = tree.hinge_lines
    moving, work = np.zeros(len(solids), np.bool_), np.empty((30, 3))
    angle = np.zeros(count)
    for _, which, value in result.steps[result.steps[:, 0] == 1].tolist():
        face = int(which)
        turn = value - angle[face]
        subtree = preorder[first[face] : last[face]]
        own = count + np.flatnonzero(np.isin(owner, subtree))
        members = np.concatenate([subtree[~trimmed[subtree]], own])
        ox, oy, ux, uy = (float(x) for x in hinges[face])
        sign = math.copysign(1.0, turn)
        if len(members):
            moving[members] = True
            _, _, body = turn_contact(
                face, int(tree.parent[face]), members, moving, solids, centres, radii, sharp, present,
                ox, oy, sign * ux, sign * uy, abs(turn), work,
            )  # fmt: skip
            moving[members] = False
            if body >= 0:
                return False
        turn_solids(solids, centres, np.concatenate([subtree, own]), ox, oy, ux, uy, turn)
        angle[face] = value
    return True


def petal_rests(
    neck: Neck, faces: NDArray[np.float64], sharp: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """What is left of the petals beside a neck: (K,) face that each body is of, (K, 12, 3) bodies.

    Args:
        neck: the neck.
        faces: (F, 12, 3) solids of the whole faces, flat in the sheet.
        sharp: (F,) faces whose middle sticks out of the prism.
    """
    owner: list[int] = []
    out: list[NDArray[np.float64]] = []
    least = 0.5 * neck.width_mm + neck.kerf_mm
    for face in neck.fan:
        middle = neck.net.vertices[neck.net.faces[face]].mean(axis=0)[None]
        side = 1.0 if neck.apart(middle)[0] > 0.0 else -1.0
        half = 0.5 * float(np.ptp(faces[face, :6, 2]))
        outlines = [(faces[face, 0:3, :2], half)] + (
            [(faces[face, 6:9, :2], _THIN_MM)] if sharp[face] else []
        )
        for outline, height in outlines:
            rest = _beyond(outline, side * neck.apart(outline) - least)
            made = _prisms(rest, height)
            owner += [face] * len(made)
            out.append(made)
    return np.array(owner, np.int64), np.concatenate([*out, np.zeros((0, 12, 3))])


def neck_bodies(neck: Neck, thickness: float) -> NDArray[np.float64]:
    """(K, 12, 3) the neck as solids, from the sides of the base panel to beyond the petals."""
    import shapely

    region = neck.band(0.0, neck.kerf_mm, neck.back_mm).difference(neck.panel)
    halves = shapely.get_parts(
        shapely.MultiPolygon(
            [
                part
                for half in (neck.half(1.0), neck.half(-1.0))
                for part in shapely.get_parts(region.intersection(half)).tolist()
                if part.geom_type == "Polygon" and part.area > _SLIVER_MM2
            ]
        )
    )
    made = [_prisms(np.asarray(part.exterior.coords)[:-1], 0.5 * thickness) for part in halves.tolist()]
    return np.concatenate([*made, np.zeros((0, 12, 3))])


def _beyond(outline: NDArray[np.float64], height: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a convex outline (K, 2) where the linear ``height`` (K,) is not negative."""
    out = []
    for k in range(len(outline)):
        a, b = float(height[k - 1]), float(height[k])
        if (a >= 0.0) != (b >= 0.0):
            out.append(outline[k - 1] + a / (a - b) * (outline[k] - outline[k - 1]))
        if b >= 0.0:
            out.append(outline[k])
    return np.array(out).reshape(-1, 2)


def _prisms(outline: NDArray[np.float64], half: float) -> NDArray[np.float64]:
    """(K - 2, 12, 3) a convex outline (K, 2) as triangular solids of the kernel."""
    corners = [outline[[0, k, k + 1]] for k in range(1, len(outline) - 1)]
    flat = np.zeros((len(corners), 3, 3))
    flat[:, :, :2] = np.array(corners).reshape(-1, 3, 2)
    up = np.array([0.0, 0.0, half])
    return np.concatenate([flat + up, flat - up, flat, flat], axis=1)
