"""How far the edges of a face are set in when contact is tested, and the prism that is left.

Planner and twin test contact with the same bodies: one prism per face, as thick as the sheet, whose walls
stand back from the edges so far that two faces joined along an edge do not touch at their goal angle, nor do
faces that share a corner. This module is the one place of that rule.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from planner.goal_mesh import GoalMesh
from planner.net import Net

__all__ = [
    "LARGEST_SHARE",
    "MITRE_PLAY_MM",
    "edge_insets",
    "goal_dihedrals",
    "inset_triangles",
    "is_sharp",
    "plain_insets",
    "prism_corners",
]

MITRE_PLAY_MM = 0.005
"""Play beyond the mitre: two walls that would just meet at the goal angle stand twice this far apart."""

LARGEST_SHARE = 0.75
"""Largest share of a face's inradius that equal insets may take: no face vanishes from the contact test."""


def goal_dihedrals(goal: GoalMesh) -> NDArray[np.float64]:
    """(F, 3) angle in rad between each face and its neighbour across edge k (corner k to corner k + 1).

    0 where the neighbour is coplanar or the edge is a boundary; always positive, at most pi.
    """
    start = goal.faces
    end = np.roll(goal.faces, -1, axis=1)
    key = np.minimum(start, end) * np.int64(len(goal.vertices)) + np.maximum(start, end)
    flat = key.ravel()
    order = np.argsort(flat, kind="stable")
    same = np.flatnonzero(flat[order][1:] == flat[order][:-1])
    first, second = order[same], order[same + 1]
    a, b = goal.face_normals[first // 3], goal.face_normals[second // 3]
    turn = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
    out = np.zeros(flat.size)
    out[first] = turn
    out[second] = turn
    return out.reshape(-1, 3)


def edge_insets(
    net: Net,
    thickness: float,
    clearance: float,
    max_angle_rad: NDArray[np.float64] | None = None,
) -> NDArray[np.float64]:
    """(F, 3) distance in mm by which edge k (corner k to corner k + 1) of every face is set in.

    ``max(clearance, thickness/2 * tan(|angle|/2) + MITRE_PLAY_MM)`` with the largest angle that the edge
    reaches: the goal's dihedral (cut edges close to it too), or ``max_angle_rad`` where that is larger. Where
    such insets would take more than ``LARGEST_SHARE`` of a face, the largest of them are cut down to a common
    value, so that every face keeps a prism. Source: the mitre joint of two plates of equal thickness.

    Args:
        net: the net.
        thickness: of the sheet, mm.
        clearance: least inset, mm.
        max_angle_rad: (E,) largest absolute fold angle of every net edge, if a plan goes beyond the goal.

    Raises:
        ValueError: if a length is negative or not finite, or ``max_angle_rad`` has the wrong shape.
    """
    if not (np.isfinite(thickness) and thickness >= 0.0 and np.isfinite(clearance) and clearance >= 0.0):
        raise ValueError(f"thickness {thickness} and clearance {clearance} must be finite and not negative")
    angle = goal_dihedrals(net.goal)
    if max_angle_rad is not None:
        if np.shape(max_angle_rad) != (len(net.edges),):
            raise ValueError(
                f"max_angle_rad must have shape ({len(net.edges)},), got {np.shape(max_angle_rad)}"
            )
        angle = np.maximum(angle, np.abs(max_angle_rad)[_edge_of_side(net)])
    half_tangent = np.tan(np.minimum(angle, np.pi - 1e-6) / 2.0)
    wanted = np.maximum(clearance, thickness / 2.0 * half_tangent + MITRE_PLAY_MM)
    return _keep_a_core(net, wanted)


def plain_insets(triangles: NDArray[np.float64], clearance: float) -> NDArray[np.float64]:
    """(..., 3) insets of the middle triangle that is tested beside the prism of a face slim for its mitre.

    The clearance on every side, but at most ``LARGEST_SHARE`` of the inradius.

    Args:
        triangles: (..., 3, D) corners, mm.
        clearance: wanted inset, mm.
    """
    lengths, doubled_area = _sides(triangles)
    inradius = doubled_area / lengths.sum(axis=-1)
    insets: NDArray[np.float64] = np.minimum(clearance, LARGEST_SHARE * inradius[..., None]).repeat(
        3, axis=-1
    )
    return insets


def is_sharp(insets: NDArray[np.float64], plain: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(...,) True where the plainly inset triangle sticks out of the prism, so that it is tested too."""
    sharp: NDArray[np.bool_] = np.any(insets > plain + 1e-9, axis=-1)
    return sharp


def inset_triangles(triangles: NDArray[np.float64], insets: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., 3, D) corners of ``triangles`` (..., 3, D) with edge k moved inwards by ``insets[..., k]`` mm.

    Corner k of the result lies at distance ``insets[k]`` from edge k and ``insets[k - 1]`` from edge k - 1;
    the result is similar to the triangle as long as the insets leave anything of it.
    """
    lengths, doubled_area = _sides(triangles)
    share = insets * lengths / doubled_area[..., None]
    before = np.roll(share, 1, axis=-1)
    following = np.roll(triangles, -1, axis=-2)
    opposite = np.roll(triangles, -2, axis=-2)
    rest = 1.0 - share - before
    corners: NDArray[np.float64] = (
        rest[..., None] * triangles + before[..., None] * following + share[..., None] * opposite
    )
    return corners


def prism_corners(
    triangle: NDArray[np.float64], insets: NDArray[np.float64], half_thickness: float
) -> NDArray[np.float64]:
    """(..., 6, 3) corners of the prism of each face: three on its outer side, then three on its inner side.

    Args:
        triangle: (..., 3, 3) corners in mm, in any pose, counter-clockwise seen from the outer side.
        insets: (..., 3) distances by which the edges are set in, mm.
        half_thickness: half the thickness of the sheet, mm.
    """
    middle = inset_triangles(triangle, insets)
    normal = np.cross(triangle[..., 1, :] - triangle[..., 0, :], triangle[..., 2, :] - triangle[..., 0, :])
    offset = half_thickness * normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.concatenate([middle + offset[..., None, :], middle - offset[..., None, :]], axis=-2)


def _sides(triangles: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lengths (..., 3) of the edges and twice the area (...,) of triangles in 2-D or 3-D."""
    along = np.roll(triangles, -1, axis=-2) - triangles
    lengths = np.linalg.norm(along, axis=-1)
    a, b = along[..., 0, :], along[..., 1, :]
    if triangles.shape[-1] == 2:
        doubled_area = np.abs(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
    else:
        doubled_area = np.linalg.norm(np.cross(a, b), axis=-1)
    return lengths, doubled_area


def _edge_of_side(net: Net) -> NDArray[np.int64]:
    """(F, 3) net edge that joins corner k to corner k + 1 of every face."""
    scale = np.int64(len(net.vertices))
    ends = np.sort(net.edges, axis=1)
    keys = ends[:, 0] * scale + ends[:, 1]
    order = np.argsort(keys, kind="stable")
    start, end = net.faces, np.roll(net.faces, -1, axis=1)
    sides = np.minimum(start, end) * scale + np.maximum(start, end)
    at = np.searchsorted(keys[order], sides)
    found = order[np.minimum(at, len(order) - 1)]
    if not np.array_equal(keys[found], sides):
        face = int(np.argwhere(keys[found] != sides)[0, 0])
        raise ValueError(f"face {face} has a side that is not among the edges of the net")
    edge: NDArray[np.int64] = found.astype(np.int64)
    return edge


def _keep_a_core(net: Net, wanted: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cut the largest insets of a face to one value so that sum(inset * side) <= LARGEST_SHARE * 2 * area."""
    lengths, doubled_area = _sides(net.vertices[net.faces])
    allowed = LARGEST_SHARE * doubled_area
    rank = np.argsort(wanted, axis=1, kind="stable")
    inset = np.take_along_axis(wanted, rank, axis=1)
    side = np.take_along_axis(lengths, rank, axis=1)
    # Level c solves sum(min(inset, c) * side) = allowed: 1, 2 or 3 sides lie at it, the largest first.
    level = (allowed - inset[:, 0] * side[:, 0] - inset[:, 1] * side[:, 1]) / side[:, 2]
    two = (allowed - inset[:, 0] * side[:, 0]) / (side[:, 1] + side[:, 2])
    three = allowed / side.sum(axis=1)
    level = np.where(level < inset[:, 1], two, level)
    level = np.where(level < inset[:, 0], three, level)
    return np.minimum(wanted, np.where(np.sum(inset * side, axis=1) > allowed, level, np.inf)[:, None])
