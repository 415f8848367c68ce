"""The sheet around the net: outline, clamped frame and the triangulated substrate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import PlanError
from planner.fold_plan import MachineLimits, Sheet
from planner.net import Net
from planner.net_region import LEAST_KERF_MM, THREAD_SHARE, burnt, grown, rectangle
from planner.placement import sheet_extent
from planner.triangulate import triangulate_polygons

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["EDGE_MM", "EDGE_SHARE", "LEAST_PIECE_MM2", "make_sheet", "substrate_region"]

EDGE_MM, EDGE_SHARE = 8.0, 1.0 / 12.0
"""No edge of the substrate is longer than this, or than this share of the longer side of the sheet."""

LEAST_PIECE_MM2 = 0.05
"""Smaller islands of metal inside the net are dust and not part of the substrate."""

_DECIMALS = 4  # of coordinates in mm: frame and substrate must share their corners


def make_sheet(net: Net, limits: MachineLimits) -> Sheet:
    """The sheet for a placed net, its substrate triangulated, tabs still to be chosen.

    The substrate is the rectangle around the net less the net and its kerf; threads narrower than a tenth of
    the kerf count as melted. The clamped frame is a strip of ``limits.frame_margin`` all around.

    Args:
        net: the net, placed by ``place_net``.
        limits: what the machine allows.

    Raises:
        PlanError: if the frame has no width.
    """
    if limits.frame_margin <= 0.0:
        raise PlanError(
            f"frame_margin is {limits.frame_margin:g} mm: the rig needs a strip of the sheet to clamp, "
            "at least 1 mm wide"
        )
    outer = np.round(sheet_extent(net, limits), _DECIMALS)
    inner = np.round(outer + limits.frame_margin * np.array([[1.0], [-1.0]]), _DECIMALS)
    strip = rectangle(outer).difference(rectangle(inner))
    pieces = substrate_region(net, limits, rectangle(inner))
    longest = max(EDGE_MM, EDGE_SHARE * float(np.ptp(outer, axis=0).max()))
    vertices, faces, region = triangulate_polygons([strip, *pieces], longest)
    (x0, y0), (x1, y1) = outer.tolist()
    middle = 0.0 if y0 < 0.0 < y1 else 0.5 * (y0 + y1)
    return Sheet(
        outline=np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]),
        vertices=vertices,
        faces=faces,
        frame_faces=region == 0,
        tabs=(),
        rotary_axis=np.array([[x0, middle], [x1, middle]]),
    )


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
