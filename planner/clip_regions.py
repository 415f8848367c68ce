"""What is clipped of the sheet: the places that the folds sweep, as few well-shaped pieces, and no more."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.fold_plan import MachineLimits, Sheet
from planner.fold_problem import FlatTree, FoldProblem, FoldResult
from planner.holding import Hold, held_again
from planner.metal_pieces import NOWHERE, clipped_pieces, incentres, piece_of
from planner.net import Net
from planner.net_region import LEAST_KERF_MM, grown
from planner.sheet_hits import sheet_hits, sheet_solids
from planner.substrate import make_sheet
from planner.swept_region import swept_region

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["MARGIN_MM", "Clipping", "clip_region", "clip_swept"]

MARGIN_MM = 0.1
"""Least distance from what is swept to the metal that stays, beside half a kerf."""

_SIMPLIFY_MM = 0.15  # the border of a piece may wander so far outwards, for fewer corners
_CLOSE_MM = 0.6  # gaps up to twice as wide between two clipped places, and bays, are clipped too
_LEAST_WIDTH_MM = 0.5  # narrower metal beside a clipped place goes with it
_DUST_MM2 = 1e-2
_TRIES = 3
_LAP_MM = 0.02


@dataclass(frozen=True, eq=False)
class Clipping:
    """The sheet triangulated along what is clipped.

    Attributes:
        sheet: the same metal as before, with the clipped pieces as triangles of their own.
        hold: the hold as it was, in triangles of ``sheet``.
        hits: triangles of ``sheet`` that the folds sweep → number of the first fold that does.
        swept_area: area of the swept region of the metal, mm², without margins; no triangulation enters it.
        pieces: in how many connected pieces the clipped metal falls.
    """

    sheet: Sheet
    hold: Hold
    hits: dict[int, int]
    swept_area: float
    pieces: int


def clip_swept(
    net: Net,
    sheet: Sheet,
    hold: Hold,
    hits: Mapping[int, int],
    tree: FlatTree,
    result: FoldResult,
    problem: FoldProblem,
) -> Clipping:
    """Clip only what the folds of ``result`` sweep, instead of whole triangles of ``sheet``.

    The swept region is bounded from outside, rounded to pieces that can be cut, and the sheet is triangulated
    along them. The contact kernel has the last word: what the folds still touch goes as well.

    Args:
        net: the placed net.
        sheet: its sheet.
        hold: what holds the base in it; nothing of its tether is clipped.
        tree: the net as arrays.
        result: the folds.
        problem: limits and insets.
        hits: what the folds sweep of ``sheet``, from ``sheet_hits``.

    Returns:
        The new sheet; the old one where this would clip no less, touch the tether, or not be found for shapes
        that nearly coincide.
    """
    import shapely

    limits = problem.limits
    swept = swept_region(tree, result, problem)
    polygons = shapely.polygons(sheet.triangles)
    metal = shapely.union_all(polygons[~sheet.frame_faces], grid_size=1e-7)
    stays = np.array(sheet.frame_faces)
    stays[sorted(hold.tether)] = True
    kept = shapely.union_all(polygons[stays], grid_size=1e-7)
    before = Clipping(
        sheet,
        hold,
        dict(hits),
        float(swept.intersection(metal).area),
        len(clipped_pieces(sheet, hold.clipped)),
    )
    best = before
    touched: list[Geometry] = []
    for _ in range(_TRIES):
        try:
            region = clip_region(swept, metal, kept, limits, touched)
            fine = make_sheet(net, limits, region)
        except shapely.errors.GEOSException:
            break  # shapes that nearly coincide: what is known to work stays
        spots = incentres(fine.triangles)
        found = sheet_hits(tree, result, problem, sheet_solids(fine, limits.thickness))
        tied = piece_of([kept], spots) != NOWHERE
        if tied[sorted(found)].any():
            break
        wanted = piece_of(_parts(region), spots) != NOWHERE
        missed = [t for t in sorted(found) if not wanted[t]]
        wanted[missed] = True
        tether = np.flatnonzero(tied & ~fine.frame_faces).tolist()
        again = held_again(net, fine, hold, tether, np.flatnonzero(wanted & ~tied).tolist())
        if again is not None and _area(fine, again) < _area(best.sheet, best.hold):
            best = Clipping(fine, again, found, before.swept_area, len(clipped_pieces(fine, again.clipped)))
        if not missed:
            break
        touched += shapely.polygons(fine.triangles[missed]).tolist()
    return best


def clip_region(
    swept: Geometry,
    metal: Geometry,
    stays: Geometry,
    limits: MachineLimits,
    touched: Sequence[Geometry] = (),
) -> Geometry:
    """The part of ``metal`` to clip so that nothing of ``swept`` is left: few pieces with plain borders.

    It is the swept metal, ``MARGIN_MM`` and half a kerf around it, gaps and bays closed, and the slivers that
    would be left beside it.

    Args:
        swept: what the folds sweep.
        metal: the substrate inside of the frame.
        stays: frame and tether, of which nothing is clipped.
        limits: for kerf and thickness.
        touched: polygons of metal that the folds are known to touch: threads of ``swept`` there count too.
    """
    import shapely

    bound = 0.5 * limits.thickness  # what is narrower than twice this may be in the bound of ``swept`` only
    sure = shapely.union_all(list(touched))
    hit = shapely.union_all(
        [
            part
            for part in _parts(swept.intersection(metal))
            if part.intersects(sure) or not part.buffer(-bound).is_empty
        ]
    )
    if hit.is_empty:
        return hit
    margin = MARGIN_MM + 0.5 * max(limits.kerf, LEAST_KERF_MM)
    wide = hit.buffer(margin + _SIMPLIFY_MM + _CLOSE_MM, quad_segs=4).buffer(-_CLOSE_MM, join_style="mitre")
    plain = wide.simplify(_SIMPLIFY_MM).intersection(metal).difference(stays)
    # A margin may not reach across the net to other metal.
    gone = shapely.union_all([part for part in _parts(plain) if part.intersects(hit)])
    left = metal.difference(gone)
    firm = grown(grown(left, -0.5 * _LEAST_WIDTH_MM), 0.5 * _LEAST_WIDTH_MM + _LAP_MM)
    slivers = [
        part
        for part in _parts(left.difference(firm).difference(stays))
        if part.area > _DUST_MM2 and part.distance(gone) < _LAP_MM
    ]
    # The pieces lap over the kerf, so that their borders cross those of the metal and do not run along them.
    lapped = shapely.union_all([grown(gone, _LAP_MM), *(grown(part, 2.0 * _LAP_MM) for part in slivers)])
    return lapped.simplify(0.5 * _LAP_MM).difference(stays)


def _parts(shape: Geometry) -> list[Geometry]:
    """The polygons of ``shape``."""
    import shapely

    parts = shapely.get_parts(shapely.get_parts(shape))
    return [part for part in parts.tolist() if part.geom_type == "Polygon" and not part.is_empty]


def _area(sheet: Sheet, hold: Hold) -> float:
    """Area of the clipped metal, mm²."""
    chosen = sheet.triangles[sorted(hold.clipped)]
    u, v = chosen[:, 1] - chosen[:, 0], chosen[:, 2] - chosen[:, 0]
    return float(0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum())
