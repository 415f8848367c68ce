"""Necks: tabs at a corner of the base panel, between the cuts of two petals, where no side of it is free.

The neck runs straight outwards through the gap between the petals. Near the corner the gap is narrower than
the neck, so the cuts run inside the petals there, and what they cut off the petals stays with the neck.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.fold_plan import MachineLimits, Tab
from planner.net import Net
from planner.net_region import LEAST_KERF_MM, grown

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["CORNER_WIDTHS_MM", "Neck", "corner_tabs", "is_corner_tab", "neck_notice", "neck_of"]

CORNER_WIDTHS_MM = (0.35, 0.6, 1.0, 1.5)
"""Widths of a neck; the narrowest that is strong enough is taken, as the petals lose their corners to it."""

LONGEST_MM = 6.0
"""A neck leaves the petals beside it after this length at the latest."""

CREASE_SHARE = 0.2
"""Largest share of a crease that a neck at its end may take."""

LEAST_GAP_RAD = math.radians(4.0)
_LEAST_ANGLE_RAD = math.radians(25.0)  # between the neck and a side of the base panel, and the way back
_BACK = 1.1 / math.tan(_LEAST_ANGLE_RAD)  # of half the width: how far the sides reach back beside the corner
_SAME_MM = 1e-6
_BEHIND_MM = 0.01


def is_corner_tab(net: Net, tab: Tab) -> bool:
    """True for a neck at a corner: its edge is a crease, while a tab on a side lies on a cut edge."""
    return bool(net.assignment[tab.edge] != "B")


@dataclass(frozen=True, eq=False)
class Neck:
    """A corner tab with the petals that it runs between.

    Attributes:
        net: the net.
        tab: its section through the corner; the way out is to the right of start to end.
        kerf_mm: width of a cut.
        fan: faces, not of the base panel, that have a corner there; their corners go to the neck.
        reach_mm: length from the corner to where it leaves the petals.
    """

    net: Net
    tab: Tab
    kerf_mm: float
    fan: tuple[int, ...]
    reach_mm: float

    @cached_property
    def corner(self) -> NDArray[np.float64]:
        """(2,) the corner of the base panel, mm."""
        middle: NDArray[np.float64] = 0.5 * (np.array(self.tab.start) + self.tab.end)
        return middle

    @cached_property
    def outward(self) -> NDArray[np.float64]:
        """(2,) unit direction of the neck."""
        return _outward(self.tab)

    @property
    def width_mm(self) -> float:
        """Width of the neck."""
        return math.dist(self.tab.start, self.tab.end)

    def band(self, wider_mm: float = 0.0, farther_mm: float = 0.0, back_mm: float = 0.0) -> Geometry:
        """Shapely rectangle from ``back_mm`` behind the corner to ``farther_mm`` beyond the petals.

        Args:
            wider_mm: on either side beyond the width of the neck.
            farther_mm: beyond ``reach_mm``.
            back_mm: behind the corner.
        """
        half = 0.5 * self.width_mm + wider_mm
        return _rectangle(self.corner, self.outward, half, -back_mm, self.reach_mm + farther_mm)

    @property
    def back_mm(self) -> float:
        """How far behind the corner the cuts beside the neck may meet the sides of the base panel."""
        return _BACK * (0.5 * self.width_mm + self.kerf_mm)

    @property
    def zone(self) -> Geometry:
        """Shapely region in which nothing of the contour is cut before the release."""
        return self.band(0.5 * self.kerf_mm, 2.0 * self.kerf_mm, 0.5 * self.kerf_mm)

    @property
    def lost(self) -> Geometry:
        """Shapely region that the neck and its cuts take from the petals: no crease is lit there."""
        return self.band(self.kerf_mm, 0.0, self.back_mm)

    def sides(self) -> Geometry:
        """Shapely lines of the cuts on either side of the neck, from the base panel to beyond the petals."""
        import shapely

        petals = shapely.union_all(shapely.polygons(self.net.vertices[self.net.faces[list(self.fan)]]))
        region = grown(petals, 0.5 * self.kerf_mm).difference(self.panel)
        half = 0.5 * (self.width_mm + self.kerf_mm)
        across = np.array([-self.outward[1], self.outward[0]])
        lines = []
        for side in (-half, half):
            middle = self.corner + side * across
            start = middle - self.back_mm * self.outward
            end = middle + (self.reach_mm + 2.0 * self.kerf_mm) * self.outward
            inside = shapely.get_coordinates(shapely.LineString([start, end]).intersection(self.panel))
            if len(inside):  # from where it leaves the panel for the last time
                start = middle + float(((inside - middle) @ self.outward).max()) * self.outward
            parts = shapely.get_parts(shapely.LineString([start, end]).intersection(region))
            lines += [part for part in parts.tolist() if part.geom_type == "LineString"]
        return shapely.MultiLineString(lines)

    def release(self) -> Geometry:
        """Shapely lines that cut the neck off, half a kerf outside of the base panel."""
        import shapely

        around = shapely.boundary(grown(self.panel, 0.5 * self.kerf_mm))
        return around.intersection(self.band(0.5 * self.kerf_mm, 0.0, self.back_mm))

    def apart(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N,) how far points (N, 2) are to the left of the middle of the neck, mm."""
        away = points - self.corner
        left: NDArray[np.float64] = away[:, 1] * self.outward[0] - away[:, 0] * self.outward[1]
        return left

    def half(self, side: float) -> Geometry:
        """Shapely rectangle of the neck to the left of its middle (``side`` 1) or to the right (-1)."""
        across = np.array([-self.outward[1], self.outward[0]])
        quarter = 0.25 * self.width_mm
        middle = self.corner + side * quarter * across
        return _rectangle(middle, self.outward, quarter, -self.back_mm, self.reach_mm + self.kerf_mm)

    @cached_property
    def panel(self) -> Geometry:
        """Shapely region of the base panel."""
        import shapely

        return shapely.union_all(
            shapely.polygons(self.net.vertices[self.net.faces[self.net.base_panel]]), grid_size=1e-7
        )


def neck_of(net: Net, tab: Tab, kerf_mm: float) -> Neck | None:
    """The neck of a corner tab; None if it does not lie free between petals.

    It is free if it runs straight out of the base panel, if within ``LONGEST_MM`` it leaves all faces behind,
    if only faces with a corner there are in its way, and if of no crease that ends there more than
    ``CREASE_SHARE`` is lost.
    """
    import shapely

    kerf = max(kerf_mm, LEAST_KERF_MM)
    corner, outward = 0.5 * (np.array(tab.start) + tab.end), _outward(tab)
    half = 0.5 * math.dist(tab.start, tab.end) + kerf
    flat = net.vertices[net.faces]
    panel = set(net.base_panel.tolist())
    behind = shapely.Point(corner - _BEHIND_MM * outward)
    if not shapely.dwithin(shapely.polygons(flat[sorted(panel)]), behind, _SAME_MM).any():
        return None
    touches = (np.linalg.norm(flat - corner, axis=2) < 1e-5).any(axis=1)
    others = np.ones(len(flat), dtype=np.bool_)
    others[net.base_panel] = False
    way = _rectangle(corner, outward, half, 0.0, LONGEST_MM)
    shapely.prepare(way)
    reach = 0.0
    for face in np.flatnonzero(others & touches).tolist():
        inside = way.intersection(shapely.Polygon(flat[face]))
        if not inside.is_empty:
            reach = max(reach, float(((shapely.get_coordinates(inside) - corner) @ outward).max()))
    if reach > LONGEST_MM - kerf:
        return None
    needed = _rectangle(corner, outward, half, 0.5 * kerf, reach + 3.0 * kerf)
    strange = np.flatnonzero(others & ~touches)
    if len(strange) and shapely.intersects(shapely.polygons(flat[strange]), needed).any():
        return None
    fan = tuple(f for f in np.flatnonzero(touches).tolist() if f not in panel)
    for crease, child in net.child_of.items():
        if child in panel:
            continue
        ends = net.vertices[net.edges[crease]]
        near = np.linalg.norm(ends - corner, axis=1) < 1e-5
        if near.any():
            along = ends[1 - int(near.argmax())] - corner
            length = float(np.linalg.norm(along))
            sine = abs(along[0] * outward[1] - along[1] * outward[0]) / length
            if half > sine * CREASE_SHARE * length:
                return None
    return Neck(net, tab, kerf, fan, reach)


def neck_notice(net: Net, tabs: Sequence[Tab], kerf_mm: float) -> tuple[str, ...]:
    """What the user should know about the necks among ``tabs``; nothing where there are none."""
    import shapely

    necks = [neck for tab in tabs if is_corner_tab(net, tab) and (neck := neck_of(net, tab, kerf_mm))]
    if not necks:
        return ()
    lost = 0.0
    for neck in necks:
        petals = shapely.union_all(shapely.polygons(net.vertices[net.faces[list(neck.fan)]]), grid_size=1e-7)
        lost += float(petals.intersection(neck.lost).area)
    count = "a neck" if len(necks) == 1 else f"{len(necks)} necks"
    return (
        f"no side of the base can hold it, so {count} {necks[0].width_mm:.2g} mm wide at corners of the base "
        f"will: the faces beside them lose {lost:.2g} mm² there",
    )


def corner_tabs(net: Net, limits: MachineLimits, width_mm: float) -> list[Neck]:
    """Necks of one width at all corners of the base panel in which a crease ends, one for every gap there."""
    kerf = max(limits.kerf, LEAST_KERF_MM)
    if width_mm < max(3.0 * kerf, 2.0 * limits.thickness):
        return []
    flat = net.vertices[net.faces]
    out = []
    for corner, sides in _panel_corners(net):
        sectors = []
        for face, k in np.argwhere(np.linalg.norm(flat - corner, axis=2) < 1e-5).tolist():
            a, b = flat[face, (k + 1) % 3] - corner, flat[face, (k + 2) % 3] - corner
            start = math.atan2(a[1], a[0])
            sectors.append((start, (math.atan2(b[1], b[0]) - start) % math.tau))
        for middle in _gap_middles(sectors):
            outward = np.array([math.cos(middle), math.sin(middle)])
            if any(_angle(direction, outward) > math.pi - _LEAST_ANGLE_RAD for _, direction in sides) or any(
                _angle(direction, outward) < _LEAST_ANGLE_RAD for _, direction in sides
            ):
                continue
            edge = min(number for number, _ in sides if net.assignment[number] != "B")
            across = 0.5 * width_mm * np.array([-outward[1], outward[0]])
            tab = Tab(edge, _point(corner - across), _point(corner + across))
            # the way out is to the right of start to end
            tab = Tab(edge, tab.end, tab.start) if _outward(tab) @ outward < 0.0 else tab
            neck = neck_of(net, tab, kerf)
            if neck is not None:
                out.append(neck)
    return out


def _panel_corners(net: Net) -> list[tuple[NDArray[np.float64], list[tuple[int, NDArray[np.float64]]]]]:
    """Corners of the base panel where a crease ends, each with its sides there: edge and direction."""
    number = {(min(a, b), max(a, b)): e for e, (a, b) in enumerate(net.edges.tolist())}
    panel = net.base_panel.tolist()
    count: dict[int, int] = {}
    ends: dict[int, tuple[int, int]] = {}
    for face in panel:
        corners = net.faces[face].tolist()
        for k in range(3):
            a, b = corners[k], corners[(k + 1) % 3]
            edge = number[min(a, b), max(a, b)]
            count[edge] = count.get(edge, 0) + 1
            ends[edge] = (a, b)
    at: dict[int, list[tuple[int, NDArray[np.float64]]]] = {}
    for edge in sorted(edge for edge, times in count.items() if times == 1):
        a, b = ends[edge]
        at.setdefault(a, []).append((edge, net.vertices[b] - net.vertices[a]))
        at.setdefault(b, []).append((edge, net.vertices[a] - net.vertices[b]))
    return [
        (net.vertices[vertex], sides)
        for vertex, sides in sorted(at.items())
        if any(net.assignment[edge] != "B" for edge, _ in sides)
    ]


def _gap_middles(sectors: Sequence[tuple[float, float]]) -> list[float]:
    """Middles of the angles that no sector (start, width) covers, rad."""
    starts = sorted((start % math.tau, width) for start, width in sectors)
    out = []
    first = starts[0][0]
    end = first
    for start, width in [*starts, (first + math.tau, 0.0)]:
        if start - end >= LEAST_GAP_RAD:
            out.append(0.5 * (start + end))
        end = max(end, start + width)
    return out


def _angle(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return math.atan2(abs(float(a[0] * b[1] - a[1] * b[0])), float(a @ b))


def _outward(tab: Tab) -> NDArray[np.float64]:
    along = np.array(tab.end) - tab.start
    return np.array([along[1], -along[0]]) / math.hypot(*along.tolist())


def _rectangle(
    origin: NDArray[np.float64], axis: NDArray[np.float64], half: float, low: float, high: float
) -> Geometry:
    import shapely

    across = half * np.array([-axis[1], axis[0]])
    near, far = origin + low * axis, origin + high * axis
    return shapely.Polygon([near - across, far - across, far + across, near + across])


def _point(xy: NDArray[np.float64]) -> tuple[float, float]:
    return round(float(xy[0]), 6) + 0.0, round(float(xy[1]), 6) + 0.0
