"""Where the folds pass through the sheet: a region of the plane, proven from outside, of no triangulation."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.kinematics import rotation_about_line

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["CHORD_MM", "ROUGH_MM", "passage", "swept_region"]

CHORD_MM = 0.01
"""How far the border may be from the arcs that it is drawn through; the region is grown by it."""

ROUGH_MM = 0.1
"""The same for a rough region."""

SNAP_MM = 1e-6
"""Grid on which the shapes are joined, far below what the region is grown by."""

_MOST_CHORDS = 64
_LEAST_TURN_RAD = 1e-9
_ROUND = math.cos(math.pi / 8.0)  # a quarter circle of two chords lies outside of one smaller by this
_FLAT_MM = 1e-6


def swept_region(
    tree: FlatTree, result: FoldResult, problem: FoldProblem, *, rough: bool = False
) -> Geometry:
    """All places of the sheet plane where some moving face is in the slab of the sheet at some angle.

    Every turn is about a line in the sheet plane (outside-in: all creases nearer to the base are flat). In
    cylinder coordinates about it, a moving point at (along, radius, angle) passes through the plane beyond
    the hinge if its angle is within the turn before 180 degrees, and on its own side if it is within the turn
    before 0. So the swept part of the plane is the image under (along, radius) of the part of the solid
    between the two positions of the sheet plane, seen from the solid. That map shortens all distances, so the
    middle of every solid, cut by half-spaces that are half a thickness wider on either side and its image
    grown by the thickness, bounds the swept region of the whole solid in the whole slab from outside.

    Args:
        tree: the flat net.
        result: what the fold planner did with it, its steps in order.
        problem: thickness and insets.
        rough: ten times as coarse, in a fraction of the time: threads of the region may be missing.

    Returns:
        A shapely polygon or multipolygon in mm. Faces that rise out of the sheet sweep their own place,
        inside of the kerf around them; that is not counted.
    """
    import shapely

    thickness = problem.limits.thickness
    middles = problem.solids(tree)[:, 6:9].copy()
    preorder, first, last = tree.subtrees
    hinges, _ = tree.hinge_lines
    angle = np.zeros(len(tree.parent))
    shapes: list[Geometry] = []
    for _, which, value in result.steps[result.steps[:, 0] == 1].tolist():
        face = int(which)
        turn = value - angle[face]
        members = preorder[first[face] : last[face]]
        moving = middles[members]
        shapes += passage(moving, hinges[face], turn, thickness, rough=rough)
        start = np.append(hinges[face, :2], 0.0)
        pose = rotation_about_line(start, start + np.append(hinges[face, 2:], 0.0), turn)
        middles[members] = moving @ pose[:3, :3].T + pose[:3, 3]
        angle[face] = value
    if not shapes:
        return shapely.MultiPolygon()
    # Once placed, a shape may cross itself by a rounding error, and nearly equal edges can end in an error.
    # The grid is far below the margin of the bound.
    return shapely.union_all(shapely.make_valid(np.array(shapes)), grid_size=SNAP_MM)


def passage(
    triangles: NDArray[np.float64],
    hinge: NDArray[np.float64],
    turn_rad: float,
    thickness: float,
    *,
    rough: bool = False,
) -> list[Geometry]:
    """Shapely shapes that cover where ``triangles`` pass through the slab of the sheet during one turn.

    Args:
        triangles: (N, 3, 3) middles of the moving solids before the turn, mm.
        hinge: (4,) a point of the hinge and its unit direction, in the sheet plane.
        turn_rad: the turn, right-handed about the direction, at most pi.
        thickness: of the solids and of the sheet, mm.
        rough: as in ``swept_region``.
    """
    if abs(turn_rad) < _LEAST_TURN_RAD or not len(triangles):
        return []
    ox, oy, ux, uy = hinge.tolist()
    x, y = triangles[..., 0] - ox, triangles[..., 1] - oy
    own = np.stack(
        [x * ux + y * uy, y * ux - x * uy, math.copysign(1.0, turn_rad) * triangles[..., 2]], axis=-1
    )
    turn = abs(turn_rad)
    out: list[Geometry] = []
    for side in (1.0, -1.0):
        # The wedge of angles that pass: [-turn, 0] on the own side, [pi - turn, pi] beyond the hinge.
        middle = -0.5 * turn if side > 0.0 else math.pi - 0.5 * turn
        planes = np.array(
            [
                [0.0, 0.0, -side],  # not beyond the sheet plane at the start
                [0.0, side * math.sin(turn), side * math.cos(turn)],  # nor short of it at the end
                [0.0, math.cos(middle), math.sin(middle)],
            ]
        )
        passes = (np.einsum("ntk,pk->ntp", own, planes).max(axis=1) > -thickness).all(axis=1)
        if side > 0.0:
            passes &= np.abs(own[..., 2]).max(axis=1) > _FLAT_MM
        for number in np.flatnonzero(passes).tolist():
            part = own[number]
            for plane in planes:
                part = _clipped(part, plane, -thickness)
            out += _images(part, side, thickness, rough)
    return [_placed(shape, ox, oy, ux, uy) for shape in out]


def _clipped(polygon: NDArray[np.float64], normal: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """The part of a convex polygon (K, 3) with ``normal`` · p >= ``least`` (Sutherland and Hodgman 1974)."""
    if not len(polygon):
        return polygon
    height = polygon @ normal - least
    if (height >= 0.0).all():
        return polygon
    out = []
    for k in range(len(polygon)):
        a, b = height[k - 1], height[k]
        if (a >= 0.0) != (b >= 0.0):
            out.append(polygon[k - 1] + a / (a - b) * (polygon[k] - polygon[k - 1]))
        if b >= 0.0:
            out.append(polygon[k])
    return np.array(out).reshape(-1, 3)


def _images(polygon: NDArray[np.float64], side: float, thickness: float, rough: bool) -> list[Geometry]:
    """Images of a convex polygon (K, 3) under (along, radius), on one side of the hinge, grown."""
    import shapely

    if len(polygon) < 3:
        return []
    normal = np.cross(polygon[1] - polygon[0], polygon[2] - polygon[0])
    # On a line across the hinge the radius is least at the foot of the perpendicular: split there.
    foot = np.array([0.0, -normal[2], normal[1]])
    size = float(np.linalg.norm(foot))
    parts = [polygon]
    if size > 1e-12:
        parts = [_clipped(polygon, sign * foot / size, 0.0) for sign in (1.0, -1.0)]
    chord_mm = ROUGH_MM if rough else CHORD_MM
    grow_mm = thickness + chord_mm
    out = []
    for part in parts:
        if len(part) < 3:
            continue
        flat = _chords(part, chord_mm)
        flat[:, 1] *= side
        if rough:
            out.append(shapely.make_valid(shapely.Polygon(flat)).buffer(grow_mm, quad_segs=2))
            continue
        # One chord at a time: GEOS cuts the tips of narrow rings off (seen with shapely 2.2).
        chords = shapely.linestrings(np.stack([flat, np.roll(flat, -1, axis=0)], axis=1))
        out.append(shapely.union_all(shapely.buffer(chords, grow_mm / _ROUND, quad_segs=2)))
        filled = shapely.Polygon(flat)
        out.append(filled if filled.is_valid else shapely.make_valid(filled))
    return out


def _chords(polygon: NDArray[np.float64], chord_mm: float) -> NDArray[np.float64]:
    """The border of a polygon (K, 3) as points (along, radius), each arc within ``chord_mm`` of its chords.

    Along a segment the radius is a hyperbola sqrt(d² + s²) with its least value d; a chord over a length l is
    off by at most l² / (8 d), and by at most l / 2.
    """
    out = []
    for k in range(len(polygon)):
        a, b = polygon[k - 1], polygon[k]
        along = b[1:] - a[1:]
        length = float(np.hypot(along[0], along[1]))
        count = 1
        if length > chord_mm:
            nearest = max(abs(float(along[0] * a[2] - along[1] * a[1])) / length, 0.25 * chord_mm)
            count = min(_MOST_CHORDS, 1 + int(length / math.sqrt(8.0 * nearest * chord_mm)))
            if length / count > 2.0 * chord_mm and nearest < chord_mm:  # through the axis: a sharp bend
                count = 1
        share = np.arange(count)[:, None] / count
        points = a + share * (b - a)
        if count == 1 and length > chord_mm:
            foot = float(np.clip(-(a[1:] @ along) / length**2, 0.0, 1.0))
            points = np.stack([a, a + foot * (b - a)]) if 0.0 < foot < 1.0 else points
        out.append(np.column_stack([points[:, 0], np.hypot(points[:, 1], points[:, 2])]))
    return np.concatenate(out)


def _placed(shape: Geometry, ox: float, oy: float, ux: float, uy: float) -> Geometry:
    """From the frame of the hinge back to the sheet."""
    from shapely import affinity

    return affinity.affine_transform(shape, [ux, -uy, uy, ux, ox, oy])
