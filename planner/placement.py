"""Where the flat net lies under the machine: turned so that it fits, centred on the rotary axis."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.errors import PlanError
from planner.fold_plan import MachineLimits
from planner.net import Net

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["GAP_MM", "clamp_region", "frame_gap", "place_net", "sheet_extent"]

GAP_MM = 5.0
"""Least distance between the net and the clamped frame of the sheet."""

_STEEPEST_RAD = math.radians(80.0)
_EXTRA_TURNS = 180


def frame_gap(limits: MachineLimits) -> float:
    """Distance between the net and the frame, mm: so large that the bars of the frame never hide a crease.

    Light that leans by the angle a passes a bar of height h at the distance h tan a from its foot; the beam's
    radius there comes on top. The light leans by the tilt of the rotary and, where it comes from one point,
    by what the farthest corner of the work area adds.
    """
    lean = limits.max_tilt_rad
    if limits.beam_source is not None:
        x, y, z = limits.beam_source
        lean += math.atan2(0.5 * math.hypot(*limits.work_area) + math.hypot(x, y), z)
    height = limits.clamp_height
    radius = limits.beam_radius + limits.beam_spread * height
    return max(GAP_MM, height * math.tan(min(lean, _STEEPEST_RAD)) + radius)


def clamp_region(limits: MachineLimits) -> Geometry:
    """Shapely region under the clamps that reach over the sheet beside its frame; empty without any."""
    import shapely

    return shapely.union_all([shapely.make_valid(shapely.Polygon(points)) for points in limits.clamps])


def place_net(net: Net, limits: MachineLimits, axis_rad: float | None = None) -> Net:
    """Turn and shift ``net``: rotary axis on the line y = 0, sheet centred on the origin.

    Args:
        net: the net, anywhere in its plane.
        limits: what the machine allows; ``work_area`` and ``frame_margin`` are used.
        axis_rad: direction of the rotary axis in the plane of ``net``. If it is None, the direction is chosen
            that makes the sheet narrowest across the axis (least swept radius) among those that fit.

    Returns:
        The same net with its vertices moved rigidly: no mirror, no scale.

    Raises:
        PlanError: if the sheet is larger than the work area; the message names the largest size that fits. Or
            if it would come to lie under a clamp.
    """
    points = net.vertices[np.unique(net.faces)]
    turns = _candidate_turns(points) if axis_rad is None else [-float(axis_rad)]
    room = 2.0 * (frame_gap(limits) + limits.frame_margin)
    sizes = [np.ptp(points @ _turn(turn).T, axis=0) for turn in turns]
    fitting = [
        number
        for number, size in enumerate(sizes)
        if size[0] + room <= limits.work_area[0] + 1e-9 and size[1] + room <= limits.work_area[1] + 1e-9
    ]
    if not fitting:
        raise PlanError(_too_large(net, sizes, room, limits))
    if limits.clamps:
        fitting = [number for number in fitting if _beside_clamps(_moved(net, turns[number]), net, limits)]
        if not fitting:
            raise PlanError(
                f"the net of {net.goal.name} comes within {frame_gap(limits):.3g} mm of a clamp that reaches "
                "over the sheet, in every direction that was tried; make the part smaller with --size, or "
                "move the clamps"
            )
    best = min(fitting, key=lambda number: (round(float(sizes[number][1]), 6), number))
    return replace(net, vertices=_moved(net, turns[best]))


def _moved(net: Net, turn_rad: float) -> NDArray[np.float64]:
    """(N, 2) vertices of ``net`` turned, its bounds centred on the origin."""
    moved = net.vertices @ _turn(turn_rad).T
    used = moved[np.unique(net.faces)]
    centred: NDArray[np.float64] = moved - 0.5 * (used.min(axis=0) + used.max(axis=0))
    return centred


def _beside_clamps(vertices: NDArray[np.float64], net: Net, limits: MachineLimits) -> bool:
    """True if the net with these vertices keeps clear of the clamps."""
    import shapely

    faces = shapely.polygons(vertices[net.faces])
    return not shapely.dwithin(faces, clamp_region(limits), frame_gap(limits)).any()


def sheet_extent(net: Net, limits: MachineLimits) -> NDArray[np.float64]:
    """(2, 2) lower and upper corner of the sheet around a placed net: its bounds, the gap and the frame."""
    points = net.vertices[np.unique(net.faces)]
    border = frame_gap(limits) + limits.frame_margin
    return np.array([points.min(axis=0) - border, points.max(axis=0) + border])


def _turn(angle_rad: float) -> NDArray[np.float64]:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s], [s, c]])


def _candidate_turns(points: NDArray[np.float64]) -> list[float]:
    """Turns that lay a side of the convex hull along x (one of them is the narrowest), then even steps.

    Source: the minimum width of a convex polygon is attained with a side flush with a supporting line
    (Freeman and Shapira 1975; Houle and Toussaint 1988).
    """
    from scipy.spatial import ConvexHull

    corners = points[ConvexHull(points).vertices]
    sides = np.roll(corners, -1, axis=0) - corners
    flush = [-math.atan2(y, x) for x, y in sides.tolist() if math.hypot(x, y) > 1e-9]
    return flush + [math.pi * k / _EXTRA_TURNS for k in range(_EXTRA_TURNS)]


def _too_large(net: Net, sizes: list[NDArray[np.float64]], room: float, limits: MachineLimits) -> str:
    """Message for a sheet that fits in no turn."""
    free = np.array(limits.work_area) - room
    shares = [float((free / np.maximum(size, 1e-9)).min()) for size in sizes]
    best = int(np.argmax(shares))
    sheet = sizes[best] + room
    words = (
        f"the sheet of {net.goal.name} needs {sheet[0]:.1f} x {sheet[1]:.1f} mm (net {sizes[best][0]:.1f} x "
        f"{sizes[best][1]:.1f} mm plus {room / 2:g} mm all around), but the work area is "
        f"{limits.work_area[0]:g} x {limits.work_area[1]:g} mm. "
    )
    largest = math.floor(10.0 * net.goal.longest_side_mm * shares[best]) / 10.0
    if shares[best] <= 0.0 or largest <= 0.0:
        return words + "The work area is too small for any net: use a rig with a larger one."
    return words + f"The largest size that fits this net is --size {largest:g}; or use a larger rig."
