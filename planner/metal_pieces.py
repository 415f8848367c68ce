"""Which metal hangs together after some cuts: the pieces of the sheet, and what lies on which."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import Sheet
from planner.net_region import LEAST_KERF_MM, THREAD_SHARE

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["NOWHERE", "clipped_pieces", "incentres", "metal_left", "piece_of", "thread_mm"]

NOWHERE = -1
"""Number of the piece where there is no metal."""


def thread_mm(kerf_mm: float) -> float:
    """Width up to which a bridge of metal does not join what it touches: it melts beside the cut."""
    return 1.2 * THREAD_SHARE * max(kerf_mm, LEAST_KERF_MM)


def metal_left(outline: Geometry, cuts: Geometry, gone: Sequence[Geometry], kerf_mm: float) -> Geometry:
    """The metal of ``outline`` after the beam ran along ``cuts`` and the polygons ``gone`` fell.

    Threads are taken off, so the parts of the result are the pieces that hang together; every piece is
    smaller by half a thread all around.
    """
    import shapely

    half = 0.5 * max(kerf_mm, LEAST_KERF_MM)
    taken = shapely.union_all([shapely.buffer(cuts, half, quad_segs=6), *gone])
    return outline.difference(taken).buffer(-0.5 * thread_mm(kerf_mm), join_style="mitre")


def clipped_pieces(sheet: Sheet, clipped: Collection[int]) -> list[Geometry]:
    """The connected pieces (shapely polygons) that substrate triangles ``clipped`` fall in."""
    import shapely

    whole = shapely.union_all(shapely.polygons(sheet.triangles[sorted(clipped)]), grid_size=1e-6)
    return [part for part in shapely.get_parts(whole).tolist() if part.geom_type == "Polygon"]


def piece_of(pieces: Sequence[Geometry], spots: NDArray[np.float64]) -> NDArray[np.int64]:
    """(N,) number of the piece that holds each of the spots (N, 2), ``NOWHERE`` where there is no metal."""
    import shapely

    out = np.full(len(spots), NOWHERE, dtype=np.int64)
    if len(pieces) and len(spots):
        which, piece = shapely.STRtree(pieces).query(shapely.points(spots), predicate="within")
        out[which] = piece
    return out


def incentres(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 2) centres of the inscribed circles of triangles (N, 3, 2): the last spot of each to be lost."""
    sides = np.linalg.norm(np.roll(triangles, -1, axis=1) - np.roll(triangles, -2, axis=1), axis=2)
    centres: NDArray[np.float64] = (sides[:, :, None] * triangles).sum(axis=1) / sides.sum(axis=1)[:, None]
    return centres
