"""The flat net as regions of the plane: its union, and the edges along which it is cut."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.net import Net

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["LEAST_KERF_MM", "THREAD_SHARE", "boundary_edges", "burnt", "grown", "net_union", "rectangle"]

LEAST_KERF_MM = 0.02
"""Narrower cuts are planned as if they were this wide."""

THREAD_SHARE = 0.1
"""Metal narrower than this share of the kerf melts when the beam cuts beside it."""


def net_union(net: Net) -> Geometry:
    """Union of the flat faces (a shapely polygon or multipolygon), places snapped to 1e-7 mm."""
    import shapely

    return shapely.union_all(shapely.polygons(net.vertices[net.faces]), grid_size=1e-7)


def grown(region: Geometry, distance_mm: float) -> Geometry:
    """``region`` grown by ``distance_mm`` with mitred corners, very sharp ones blunted."""
    import shapely

    return shapely.buffer(region, distance_mm, join_style="mitre", mitre_limit=2.0)


def burnt(net: Net, kerf_mm: float) -> Geometry:
    """The net and the kerf around it.

    The beam runs along the mitred contour half a kerf outside; what it burns beyond is bevelled here, a
    little less than it takes in truth, so that metal which stays joined is never taken for an island.
    """
    import shapely

    return shapely.buffer(grown(net_union(net), 0.5 * kerf_mm), 0.5 * kerf_mm, join_style="bevel")


def rectangle(corners: NDArray[np.float64]) -> Geometry:
    """Axis-aligned rectangle from (2, 2) lower and upper corner."""
    import shapely

    return shapely.box(*corners[0].tolist(), *corners[1].tolist())


def boundary_edges(net: Net) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The cut edges of the net: (edge numbers (B,), their faces (B,), net vertices of start and end (B, 2)).

    The face lies to the left of start to end, so the outward normal points to the right.
    """
    number = {(min(a, b), max(a, b)): e for e, (a, b) in enumerate(net.edges.tolist())}
    rows = []
    for face, corners in enumerate(net.faces.tolist()):
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            edge = number[min(a, b), max(a, b)]
            if net.assignment[edge] == "B":
                rows.append((edge, face, a, b))
    rows.sort()
    table = np.array(rows, dtype=np.int64).reshape(-1, 4)
    return table[:, 0], table[:, 1], table[:, 2:]
