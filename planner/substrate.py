"""The sheet around the net: outline, clamped frame and the triangulated substrate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.errors import PlanError
from planner.fold_plan import MachineLimits, Sheet
from planner.net import Net
from planner.net_region import LEAST_KERF_MM, THREAD_SHARE, burnt, grown, rectangle
from planner.placement import clamp_region, sheet_extent
from planner.triangulate import triangulate_polygons

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["EDGE_MM", "EDGE_SHARE", "LEAST_PIECE_MM2", "make_sheet", "substrate_region"]

EDGE_MM, EDGE_SHARE = 8.0, 1.0 / 12.0
"""No edge of the substrate is longer than this, or than this share of the longer side of the sheet."""

LEAST_PIECE_MM2 = 0.05
"""Smaller islands of metal inside the net are dust and not part of the substrate."""

_CRUMB_MM2 = 1e-7
_DECIMALS = 4  # of coordinates in mm: frame and substrate must share their corners


def make_sheet(net: Net, limits: MachineLimits, along: Geometry | None = None) -> Sheet:
    """The sheet for a placed net, its substrate triangulated, tabs still to be chosen.

    The substrate is the rectangle around the net less the net and its kerf; threads narrower than a tenth of
    the kerf count as melted. The clamped frame is a strip of ``limits.frame_margin`` all around, and what
    lies under ``limits.clamps``.

    Args:
        net: the net, placed by ``place_net``.
        limits: what the machine allows.
        along: shapely polygons whose borders shall be edges of the triangulation, if any.

    Raises:
        PlanError: if the frame has no width.
    """
    import shapely

    if limits.frame_margin <= 0.0:
        raise PlanError(
            f"frame_margin is {limits.frame_margin:g} mm: the rig needs a strip of the sheet to clamp, "
            "at least 1 mm wide"
        )
    outer = np.round(sheet_extent(net, limits), _DECIMALS)
    inner = np.round(outer + limits.frame_margin * np.array([[1.0], [-1.0]]), _DECIMALS)
    clamps = clamp_region(limits)
    strip = rectangle(outer).difference(rectangle(inner).difference(clamps))
    pieces = substrate_region(net, limits, rectangle(inner).difference(clamps))
    clamped = [part for part in shapely.get_parts(strip).tolist() if part.geom_type == "Polygon"]
    longest = max(EDGE_MM, EDGE_SHARE * float(np.ptp(outer, axis=0).max()))
    polygons = [*clamped, *pieces]
    frame = np.arange(len(polygons)) < len(clamped)
    if along is not None and not along.is_empty:
        polygons, frame = _divided(polygons, len(clamped), along)
    vertices, faces, region = triangulate_polygons(polygons, longest)
    (x0, y0), (x1, y1) = outer.tolist()
    middle = 0.0 if y0 < 0.0 < y1 else 0.5 * (y0 + y1)
    return Sheet(
        outline=np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]),
        vertices=vertices,
        faces=faces,
        frame_faces=frame[region],
        tabs=(),
        rotary_axis=np.array([[x0, middle], [x1, middle]]),
        clamp_height=limits.clamp_height,
    )


def _divided(
    polygons: list[Geometry], clamped: int, along: Geometry
) -> tuple[list[Geometry], NDArray[np.bool_]]:
    """``polygons``, the first of them the frame, divided along borders, and which parts are of the frame."""
    import shapely

    grid = 10.0**-_DECIMALS
    borders = shapely.boundary([*polygons, along])
    noded = shapely.union_all(borders, grid_size=grid)
    parts = shapely.get_parts(shapely.polygonize([noded]))
    spots = shapely.point_on_surface(parts)
    out: list[Geometry] = []
    frame: list[bool] = []
    which, polygon = shapely.STRtree(polygons).query(spots, predicate="within")
    for part, owner in sorted(zip(which.tolist(), polygon.tolist(), strict=True)):
        if parts[part].area > _CRUMB_MM2:
            out.append(shapely.normalize(parts[part]))
            frame.append(owner < clamped)
    order = sorted(range(len(out)), key=lambda k: (not frame[k], -out[k].area, out[k].bounds))
    return [out[k] for k in order], np.array([frame[k] for k in order])


def substrate_region(net: Net, limits: MachineLimits, inside: Geometry) -> list[Geometry]:
    """Polygons of the metal in ``inside`` that is neither net nor kerf, in a deterministic order."""
    import shapely

    kerf = max(limits.kerf, LEAST_KERF_MM)
    hole = burnt(net, kerf)
    metal = inside.difference(hole)
    # Opening removes threads that the beam melts when it cuts beside them.
    opened = grown(grown(metal, -0.5 * THREAD_SHARE * kerf), 0.5 * THREAD_SHARE * kerf)
    grid = 10.0**-_DECIMALS
    snapped = shapely.set_precision(opened.simplify(0.02 * kerf), grid)
    inside_only = shapely.set_precision(snapped.intersection(inside), grid)
    polygons = [
        shapely.normalize(piece)
        for piece in shapely.get_parts(inside_only)
        if piece.geom_type == "Polygon" and piece.area >= LEAST_PIECE_MM2
    ]
    return sorted(polygons, key=lambda piece: (-piece.area, piece.bounds))
