"""What holds the base panel until the end: tabs, the way through the substrate to the frame, islands."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.corner_tabs import CORNER_WIDTHS_MM, Neck, corner_tabs
from planner.cut_paths import clip_seams, contour_lines, split_at_tabs
from planner.errors import PlanError
from planner.fold_plan import MachineLimits, Sheet, Tab
from planner.metal_pieces import NOWHERE, incentres, metal_left, piece_of
from planner.net import Net
from planner.net_region import boundary_edges
from planner.substrate_ways import Place, SubstrateGraph, Ways
from planner.tab_strength import TabResistance

__all__ = ["MOST_TABS", "TAB_WIDTHS_MM", "Hold", "held_again", "hold_base"]

TAB_WIDTHS_MM = (1.0, 2.0, 3.0, 0.6, 0.35)
"""Widths of a tab: of the first three the one whose tabs carry most, the others where there is no room."""

_USUAL = 3  # of these widths
MOST_TABS = 3

SAFE_NECK_SHARE = 0.5
"""Share of what necks at corners are sure to carry that the flat net may weigh; else wider ones are taken."""

_LEAST_APART_MM = 3.0
_DOWN = np.array([0.0, 0.0, 1.0])
_PLACES_PER_EDGE = 4


@dataclass(frozen=True)
class Hold:
    """How the base panel is held.

    Attributes:
        tabs: the uncut stretches.
        tether: substrate triangles between the tabs and the frame that must stay.
        needed: triangles of ``tether`` that the folds sweep; empty if the part is held as it is.
        clipped: triangles that are cut off: those that the folds sweep and those left without a way to the
            frame.
        kerf_mm: width of the cuts that the tabs were chosen for.
    """

    tabs: tuple[Tab, ...]
    tether: frozenset[int]
    needed: frozenset[int]
    clipped: frozenset[int]
    kerf_mm: float = 0.1


def hold_base(
    net: Net,
    sheet: Sheet,
    limits: MachineLimits,
    hit: Collection[int],
    stays_clear: Callable[[Neck], bool] | None = None,
) -> Hold:
    """Choose the tabs of the base panel and the substrate that ties them to the frame.

    They are stretches of free edges of the panel. Where none of these can be had without metal that the folds
    sweep, they are necks at corners of the panel, if these are strong enough or there is no free edge at all:
    they cost the petals beside them their corners.

    Args:
        net: the placed net.
        sheet: its sheet.
        limits: what the machine allows.
        hit: substrate triangles that the folds sweep, which therefore are to go.
        stays_clear: says whether the folds stay clear of a neck; all do where it is not given.

    Returns:
        The hold. If no tab can reach the frame without triangles in ``hit``, ``needed`` names those of the
        cheapest way; the folds have to be planned again around ``tether``, or another base be taken.

    Raises:
        PlanError: if no free edge of the base panel has substrate beside it, and no corner a neck.
    """
    swept = frozenset(int(t) for t in hit if not sheet.frame_faces[int(t)])
    substrate = SubstrateGraph(sheet)
    places: list[Place] = []
    found: list[tuple[float, list[Place], Ways]] = []
    centre = _centre(net)
    for number, width in enumerate(TAB_WIDTHS_MM):
        if number >= _USUAL and (places or found):
            break
        here = _tab_places(net, substrate, limits, width)
        places = places or here
        for neck in (width, 0.5 * width):
            ways = substrate.ways(neck, swept)
            held = [p for p in here if all(t in ways.cost and not ways.blocked[t] for t in p.contact)]
            if held:
                chosen = _spread(held)
                share = TabResistance([p.tab for p in chosen], limits).share(centre, _DOWN)
                found.append((round(share, 9), chosen, ways))
                break
    if found:
        _, chosen, ways = min(found, key=lambda one: one[0])
        return _held(net, substrate, chosen, ways, swept, limits.kerf)
    at_corners = _hold_corners(net, substrate, limits, swept, stays_clear)
    if at_corners is not None and (at_corners[1] or not places):
        return at_corners[0]
    if not places:
        raise PlanError(
            f"the base face {net.base_face} has no free edge with sheet metal beside it, and at no corner of "
            "it has a neck room, so no tab can hold it; choose another base face with --base"
        )
    ways = substrate.ways(0.0, swept)
    reaching = [p for p in places if all(t in ways.cost for t in p.contact)]
    if not reaching and at_corners is not None:
        return at_corners[0]
    if not reaching:
        raise PlanError(
            f"the sheet metal beside the base face {net.base_face} is enclosed by the net and reaches the "
            "frame nowhere; choose another base face with --base"
        )
    cheapest = min(reaching, key=lambda p: (max(ways.cost[t] for t in p.contact), p.tab.edge, p.tab.start))
    tether = substrate.corridor(cheapest, ways)
    gone = substrate.cut_off(swept - tether)
    return Hold((cheapest.tab,), tether, tether & swept, gone, limits.kerf)


def _hold_corners(
    net: Net,
    substrate: SubstrateGraph,
    limits: MachineLimits,
    swept: frozenset[int],
    stays_clear: Callable[[Neck], bool] | None,
) -> tuple[Hold, bool] | None:
    """Necks at corners of the base panel, and whether they are strong enough; None if there is no room.

    The narrowest that are strong enough are taken, or else the strongest.
    """
    weight = limits.weight_n_mm2 * float(_areas(net).sum())
    best: tuple[float, list[Place], Ways] | None = None
    for width in CORNER_WIDTHS_MM:
        ways = substrate.ways(0.5 * width, swept)
        held = []
        for neck in corner_tabs(net, limits, width):
            place = substrate.through(neck)
            if (
                place is not None
                and all(t in ways.cost and not ways.blocked[t] for t in place.contact)
                and not swept.intersection(place.beside)
                and (stays_clear is None or stays_clear(neck))
            ):
                held.append(place)
        if not held:
            continue
        chosen = _spread(held)
        share = TabResistance([p.tab for p in chosen], limits).share(_centre(net), _DOWN)
        if best is None or share < best[0]:
            best = (share, chosen, ways)
        if share * weight <= SAFE_NECK_SHARE:
            break
    if best is None:
        return None
    share, chosen, ways = best
    return _held(net, substrate, chosen, ways, swept, limits.kerf), share * weight <= SAFE_NECK_SHARE


def held_again(
    net: Net, sheet: Sheet, hold: Hold, tether: Collection[int], gone: Collection[int]
) -> Hold | None:
    """``hold`` in another triangulation of the same metal, in which other triangles go.

    Args:
        net: the placed net.
        sheet: the new sheet.
        hold: tabs and kerf.
        tether: triangles of ``sheet`` that must stay.
        gone: triangles that must go, none of them in ``tether``.

    Returns:
        The hold with what is left without a way to the frame clipped too; None if some of the tether were.
    """
    substrate = SubstrateGraph(sheet)
    stays = frozenset(tether)
    clipped = _with_loose(net, substrate, hold.tabs, substrate.cut_off(frozenset(gone)), hold.kerf_mm)
    return None if stays & clipped else Hold(hold.tabs, stays, frozenset(), clipped, hold.kerf_mm)


def _centre(net: Net) -> NDArray[np.float64]:
    """(3,) centre of mass of the flat net, mm."""
    area = _areas(net)
    return np.append(area @ net.vertices[net.faces].mean(axis=1) / area.sum(), 0.0)


def _areas(net: Net) -> NDArray[np.float64]:
    """(F,) areas of the faces, mm²."""
    corners = net.vertices[net.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    areas: NDArray[np.float64] = 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return areas


def _held(
    net: Net,
    substrate: SubstrateGraph,
    chosen: list[Place],
    ways: Ways,
    swept: frozenset[int],
    kerf_mm: float,
) -> Hold:
    """The hold with ``chosen`` tabs, none of which needs swept substrate."""
    tether: frozenset[int] = frozenset()
    for place in chosen:
        tether |= substrate.corridor(place, ways)
    tabs = tuple(sorted((p.tab for p in chosen), key=lambda tab: (tab.edge, tab.start)))
    gone = _with_loose(net, substrate, tabs, substrate.cut_off(swept), kerf_mm)
    return Hold(tabs, tether - gone, frozenset(), gone, kerf_mm)


def _with_loose(
    net: Net, substrate: SubstrateGraph, tabs: tuple[Tab, ...], gone: frozenset[int], kerf_mm: float
) -> frozenset[int]:
    """``gone`` and the triangles that fall with it, because the beam leaves too little metal beside them."""
    import shapely

    lines = contour_lines(net, kerf_mm)
    contour, _ = split_at_tabs(net, lines, tabs, kerf_mm)
    outline = shapely.Polygon(substrate.sheet.outline)
    spots = incentres(substrate.sheet.triangles)
    while True:
        seams = clip_seams(substrate.sheet, gone, lines, kerf_mm)
        cuts = shapely.MultiLineString([*shapely.get_parts(contour), *shapely.get_parts(seams)])
        metal = metal_left(outline, cuts, substrate.polygons[sorted(gone)].tolist(), kerf_mm)
        piece = piece_of(shapely.get_parts(metal).tolist(), spots)
        held = set(piece[sorted(substrate.frame)].tolist()) | {NOWHERE}
        loose = {t for t, number in enumerate(piece.tolist()) if number not in held} - gone
        if not loose:
            return gone
        gone = substrate.cut_off(gone | loose)


def _tab_places(net: Net, substrate: SubstrateGraph, limits: MachineLimits, width: float) -> list[Place]:
    """Stretches of free edges of the base panel with substrate all along them."""
    panel = set(net.base_panel.tolist())
    numbers, faces, corners = boundary_edges(net)
    places = []
    for edge, face, (start, end) in zip(numbers.tolist(), faces.tolist(), net.vertices[corners], strict=True):
        length = float(np.linalg.norm(end - start))
        spare = length - width - 4.0 * limits.kerf
        if face not in panel or spare < 0.0:
            continue
        along = (end - start) / length
        count = min(_PLACES_PER_EDGE, 1 + int(spare / (2.0 * width)))
        shares = [0.5] if count == 1 else [k / (count - 1) for k in range(count)]
        for share in shares:
            a = start + (2.0 * limits.kerf + share * spare) * along
            tab = Tab(edge, _point(a), _point(a + width * along))
            contact = substrate.beside(tab, limits.kerf)
            if contact:
                places.append(Place(tab, width, contact))
    return places


def _point(xy: NDArray[np.float64]) -> tuple[float, float]:
    return round(float(xy[0]), 6) + 0.0, round(float(xy[1]), 6) + 0.0


def _spread(places: list[Place]) -> list[Place]:
    """Up to ``MOST_TABS`` places: the two farthest apart, then the one farthest from those."""
    if len(places) == 1:
        return places
    spots = np.array([p.middle for p in places])
    apart = np.linalg.norm(spots[:, None] - spots[None], axis=2)
    first, second = np.unravel_index(int(np.argmax(np.round(apart, 6))), apart.shape)
    chosen = [int(first)]
    follower = int(second)
    while len(chosen) < MOST_TABS and apart[chosen, follower].min() >= _LEAST_APART_MM:
        chosen.append(follower)
        follower = int(np.argmax(np.round(apart[chosen].min(axis=0), 6)))
    return [places[k] for k in chosen]
