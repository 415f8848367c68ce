"""What holds the base panel until the end: tabs, the way through the substrate to the frame, islands."""

from __future__ import annotations

import heapq
import math
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.cut_paths import clip_seams, contour_lines, split_at_tabs, tab_strip
from planner.errors import PlanError
from planner.fold_plan import MachineLimits, Sheet, Tab
from planner.metal_pieces import NOWHERE, incentres, metal_left, piece_of
from planner.net import Net
from planner.net_region import boundary_edges
from planner.tab_strength import TabResistance

__all__ = ["MOST_TABS", "TAB_WIDTHS_MM", "Hold", "held_again", "hold_base"]

TAB_WIDTHS_MM = (1.0, 2.0, 3.0, 0.6, 0.35)
"""Widths of a tab: of the first three the one whose tabs carry most, the others where there is no room."""

_USUAL = 3  # of these widths
MOST_TABS = 3
_PAD_MM = 0.25  # depth of substrate that a tab must reach beyond the kerf
_LEAST_APART_MM = 3.0
_DOWN = np.array([0.0, 0.0, 1.0])
_PLACES_PER_EDGE = 4
_HIT_PENALTY_MM = 1e4  # a way through substrate that the folds sweep is the last resort


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


@dataclass(frozen=True)
class _Place:
    """Where a tab could be: the stretch, and the substrate triangles that it would be joined to."""

    tab: Tab
    width_mm: float
    contact: tuple[int, ...]

    @cached_property
    def middle(self) -> tuple[float, float]:
        (ax, ay), (bx, by) = self.tab.start, self.tab.end
        return 0.5 * (ax + bx), 0.5 * (ay + by)


def hold_base(net: Net, sheet: Sheet, limits: MachineLimits, hit: Collection[int]) -> Hold:
    """Choose the tabs of the base panel and the substrate that ties them to the frame.

    Args:
        net: the placed net.
        sheet: its sheet.
        limits: what the machine allows.
        hit: substrate triangles that the folds sweep, which therefore are to go.

    Returns:
        The hold. If no tab can reach the frame without triangles in ``hit``, ``needed`` names those of the
        cheapest way; the folds have to be planned again around ``tether``, or another base be taken.

    Raises:
        PlanError: if no free edge of the base panel has substrate beside it.
    """
    swept = frozenset(int(t) for t in hit if not sheet.frame_faces[int(t)])
    substrate = _Substrate(sheet)
    places: list[_Place] = []
    found: list[tuple[float, list[_Place], _Ways]] = []
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
    if not places:
        raise PlanError(
            f"the base face {net.base_face} has no free edge with sheet metal beside it, so no tab can hold "
            "it; choose another base face with --base"
        )
    ways = substrate.ways(0.0, swept)
    reaching = [p for p in places if all(t in ways.cost for t in p.contact)]
    if not reaching:
        raise PlanError(
            f"the sheet metal beside the base face {net.base_face} is enclosed by the net and reaches the "
            "frame nowhere; choose another base face with --base"
        )
    cheapest = min(reaching, key=lambda p: (max(ways.cost[t] for t in p.contact), p.tab.edge, p.tab.start))
    tether = substrate.corridor(cheapest, ways)
    gone = substrate.cut_off(swept - tether)
    return Hold((cheapest.tab,), tether, tether & swept, gone, limits.kerf)


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
    substrate = _Substrate(sheet)
    stays = frozenset(tether)
    clipped = _with_loose(net, substrate, hold.tabs, substrate.cut_off(frozenset(gone)), hold.kerf_mm)
    return None if stays & clipped else Hold(hold.tabs, stays, frozenset(), clipped, hold.kerf_mm)


def _centre(net: Net) -> NDArray[np.float64]:
    """(3,) centre of mass of the flat net, mm."""
    corners = net.vertices[net.faces]
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return np.append(area @ corners.mean(axis=1) / area.sum(), 0.0)


def _held(
    net: Net,
    substrate: _Substrate,
    chosen: list[_Place],
    ways: _Ways,
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
    net: Net, substrate: _Substrate, tabs: tuple[Tab, ...], gone: frozenset[int], kerf_mm: float
) -> frozenset[int]:
    """``gone`` and the triangles that fall with it, because the beam leaves too little metal beside them."""
    import shapely

    lines = contour_lines(net, kerf_mm)
    contour, _ = split_at_tabs(lines, tabs, kerf_mm)
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


def _tab_places(net: Net, substrate: _Substrate, limits: MachineLimits, width: float) -> list[_Place]:
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
                places.append(_Place(tab, width, contact))
    return places


def _point(xy: NDArray[np.float64]) -> tuple[float, float]:
    return round(float(xy[0]), 6) + 0.0, round(float(xy[1]), 6) + 0.0


def _spread(places: list[_Place]) -> list[_Place]:
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


@dataclass(frozen=True)
class _Ways:
    """Cheapest ways from every triangle to the frame: cost, next triangle, whether swept metal is needed."""

    cost: dict[int, float]
    following: dict[int, int]
    blocked: dict[int, bool]
    neck_mm: float


class _Substrate:
    """The triangles of a sheet as a graph."""

    def __init__(self, sheet: Sheet) -> None:
        import shapely

        self.sheet = sheet
        self.polygons = shapely.polygons(sheet.triangles)
        self.tree = shapely.STRtree(self.polygons)
        self.centres = sheet.triangles.mean(axis=1)
        self.frame = frozenset(np.flatnonzero(sheet.frame_faces).tolist())
        owner: dict[tuple[int, int], int] = {}
        self.neighbours: list[list[tuple[int, float, tuple[float, float]]]] = [[] for _ in sheet.faces]
        for t, corners in enumerate(sheet.faces.tolist()):
            for k in range(3):
                a, b = corners[k], corners[(k + 1) % 3]
                owner[a, b] = t
                if (b, a) in owner:
                    other = owner[b, a]
                    p, q = sheet.vertices[a], sheet.vertices[b]
                    length, middle = float(np.linalg.norm(q - p)), tuple((0.5 * (p + q)).tolist())
                    self.neighbours[t].append((other, length, middle))
                    self.neighbours[other].append((t, length, middle))

    def beside(self, tab: Tab, kerf: float) -> tuple[int, ...]:
        """Triangles along the outer side of ``tab``; none if there is a gap."""
        import shapely

        strip = tab_strip(tab, 0.0, kerf + _PAD_MM)
        pad = strip.difference(tab_strip(tab, 1.0, 1.2 * kerf + 0.01, 1.0))
        near = np.sort(self.tree.query(pad, predicate="intersects"))
        shares = shapely.area(shapely.intersection(self.polygons[near], pad))
        if shares.sum() < 0.98 * pad.area:
            return ()
        return tuple(near[shares > 1e-6].tolist())

    def ways(self, neck_mm: float, swept: frozenset[int]) -> _Ways:
        """Dijkstra from the frame through sides at least ``neck_mm`` long; swept triangles cost a lot."""
        cost = dict.fromkeys(self.frame, 0.0)
        following: dict[int, int] = {}
        blocked = dict.fromkeys(self.frame, False)
        heap = [(0.0, t) for t in sorted(self.frame)]
        while heap:
            so_far, t = heapq.heappop(heap)
            if so_far > cost[t]:
                continue
            for other, length, _ in self.neighbours[t]:
                if length < neck_mm or other in self.frame:
                    continue
                step = math.dist(self.centres[t], self.centres[other])
                total = so_far + step + (_HIT_PENALTY_MM if other in swept else 0.0)
                if total < cost.get(other, math.inf):
                    cost[other] = total
                    following[other] = t
                    blocked[other] = blocked[t] or other in swept
                    heapq.heappush(heap, (total, other))
        return _Ways(cost, following, blocked, neck_mm)

    def corridor(self, place: _Place, ways: _Ways) -> frozenset[int]:
        """Triangles on the ways from ``place`` to the frame and beside them, as wide as the tab."""
        import shapely

        found: set[int] = set(place.contact)
        for t in place.contact:
            line = [place.middle, tuple(self.centres[t])]
            while t not in self.frame:
                found.add(t)
                after = ways.following[t]
                line.append(next(middle for other, _, middle in self.neighbours[t] if other == after))
                t = after
            band = shapely.LineString(line).buffer(0.5 * place.width_mm)
            found.update(self.tree.query(band, predicate="intersects").tolist())
        return frozenset(found - self.frame)

    def cut_off(self, gone: frozenset[int]) -> frozenset[int]:
        """``gone`` and every triangle that then has no way to the frame."""
        reached = set(self.frame)
        stack = sorted(self.frame)
        while stack:
            t = stack.pop()
            for other, _, _ in self.neighbours[t]:
                if other not in reached and other not in gone:
                    reached.add(other)
                    stack.append(other)
        return frozenset(range(len(self.neighbours))) - reached
