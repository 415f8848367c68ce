"""Substrate triangles as a graph: ways from a tab to the clamped frame, and what is left without one."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.corner_tabs import Neck
from planner.cut_paths import tab_strip
from planner.fold_plan import Sheet, Tab

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["PAD_MM", "Place", "SubstrateGraph", "Ways"]

PAD_MM = 0.25
"""Depth of substrate that a tab must reach beyond the kerf."""

LEAST_WAY_MM = 0.3
"""Narrowest metal that a way leads through: less is burnt away beside the cuts, or tears."""

_HIT_PENALTY_MM = 1e4  # a way through substrate that the folds sweep is the last resort


@dataclass(frozen=True, eq=False)
class Place:
    """Where a tab could be: the stretch, and the substrate triangles that it would be joined to.

    Attributes:
        tab: the stretch.
        width_mm: how wide it is.
        contact: triangles along its outer end.
        beside: triangles that a neck runs through before; they must stay too.
    """

    tab: Tab
    width_mm: float
    contact: tuple[int, ...]
    beside: tuple[int, ...] = ()

    @cached_property
    def middle(self) -> tuple[float, float]:
        """Middle of the stretch."""
        (ax, ay), (bx, by) = self.tab.start, self.tab.end
        return 0.5 * (ax + bx), 0.5 * (ay + by)


@dataclass(frozen=True)
class Ways:
    """Cheapest ways from every triangle to the frame: cost, next triangle, whether swept metal is needed."""

    cost: dict[int, float]
    following: dict[int, int]
    blocked: dict[int, bool]
    neck_mm: float


class SubstrateGraph:
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
        strip = tab_strip(tab, 0.0, kerf + PAD_MM)
        return self._all_over(strip.difference(tab_strip(tab, 1.0, 1.2 * kerf + 0.01, 1.0)))

    def through(self, neck: Neck) -> Place | None:
        """The place of a neck at a corner; None if there is a gap in the substrate beyond the petals."""
        import shapely

        end = neck.band(0.0, neck.kerf_mm + PAD_MM)
        contact = self._all_over(end.difference(neck.band(1.0, neck.kerf_mm, 1.0)))
        if not contact:
            return None
        near = self.tree.query(end, predicate="intersects")
        beside = near[shapely.area(shapely.intersection(self.polygons[near], end)) > 1e-6]
        return Place(neck.tab, neck.width_mm, contact, tuple(sorted(set(beside.tolist()) - set(contact))))

    def _all_over(self, pad: Geometry) -> tuple[int, ...]:
        """Triangles that cover ``pad``; none if they leave a gap."""
        import shapely

        near = np.sort(self.tree.query(pad, predicate="intersects"))
        shares = shapely.area(shapely.intersection(self.polygons[near], pad))
        if shares.sum() < 0.98 * pad.area:
            return ()
        return tuple(near[shares > 1e-6].tolist())

    def ways(self, neck_mm: float, swept: frozenset[int]) -> Ways:
        """Dijkstra from the frame through metal at least ``neck_mm`` wide; swept triangles cost a lot.

        So long must be the sides that a way crosses, and, where it turns round a corner of a triangle whose
        third side is an edge of the metal, the height over that side.
        """
        need = max(neck_mm, LEAST_WAY_MM)
        cost = dict.fromkeys(self.frame, 0.0)
        following: dict[int, int] = {}
        blocked = dict.fromkeys(self.frame, False)
        heap = [(0.0, t) for t in sorted(self.frame)]
        while heap:
            so_far, t = heapq.heappop(heap)
            if so_far > cost[t]:
                continue
            for other, length, _ in self.neighbours[t]:
                if length < need or other in self.frame:
                    continue
                if t in following and self._bend_mm(t, following[t], other, swept) < need:
                    continue
                step = math.dist(self.centres[t], self.centres[other])
                total = so_far + step + (_HIT_PENALTY_MM if other in swept else 0.0)
                if total < cost.get(other, math.inf):
                    cost[other] = total
                    following[other] = t
                    blocked[other] = blocked[t] or other in swept
                    heapq.heappush(heap, (total, other))
        return Ways(cost, following, blocked, neck_mm)

    def _bend_mm(self, t: int, one: int, other: int, swept: frozenset[int]) -> float:
        """Width of the metal where a way goes through triangle ``t`` from ``one`` neighbour to ``other``."""
        around = [neighbour for neighbour, _, _ in self.neighbours[t]]
        if any(third not in (one, other) and third not in swept for third in around):
            return math.inf  # there is metal beyond the third side
        corners = set(self.sheet.faces[t].tolist())
        shared = corners.intersection(self.sheet.faces[one].tolist(), self.sheet.faces[other].tolist())
        if len(shared) != 1:
            return math.inf
        a, b = (self.sheet.vertices[v] for v in sorted(corners - shared))
        apex = self.sheet.vertices[next(iter(shared))]
        along = b - a
        foot = float(np.clip((apex - a) @ along / max(float(along @ along), 1e-300), 0.0, 1.0))
        return float(np.linalg.norm(apex - (a + foot * along)))

    def corridor(self, place: Place, ways: Ways) -> frozenset[int]:
        """Triangles on the ways from ``place`` to the frame and beside them, as wide as the tab."""
        import shapely

        found: set[int] = {*place.contact, *place.beside}
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
