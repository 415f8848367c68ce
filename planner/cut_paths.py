"""Cut lines: in the middle of the kerf around the net, in slits, and along the seams of clipped substrate."""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.corner_tabs import is_corner_tab, neck_of
from planner.fold_plan import Point, Polyline, Sheet, Tab
from planner.net import Net
from planner.net_region import LEAST_KERF_MM, boundary_edges, grown, net_union

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["clip_seams", "contour_lines", "in_travel_order", "polylines", "split_at_tabs", "tab_strip"]

_SHORTEST_MM = 0.02  # shorter pieces of path are dropped
_GRID_MM = 1e-6
_SAME_MM = 1e-4
_WIDE_GAP_RAD = math.radians(30.0)


def contour_lines(net: Net, kerf_mm: float) -> Geometry:
    """All lines along which the net is cut out of the sheet, tabs not yet left standing (shapely lines).

    Where the gap beside an edge is at least a kerf wide, the line runs half a kerf outside of the net. In
    narrower gaps between two faces it runs along the middle of the gap, once for both.
    """
    import shapely

    kerf = max(kerf_mm, LEAST_KERF_MM)
    ring = shapely.boundary(grown(net_union(net), 0.5 * kerf)).simplify(0.01 * kerf)
    slits = _slits(net, kerf)
    around = shapely.get_parts(_as_lines(ring))
    narrow = shapely.get_parts(shapely.line_merge(_as_lines(shapely.union_all(slits, grid_size=_GRID_MM))))
    return shapely.MultiLineString([*around, *narrow])


def split_at_tabs(
    net: Net, lines: Geometry, tabs: Iterable[Tab], kerf_mm: float
) -> tuple[Geometry, Geometry]:
    """(lines to cut now, lines across the tabs for the release).

    Beside a neck at a corner of the base panel the cuts run where ``corner_tabs`` says.

    Raises:
        ValueError: if such a neck does not lie free between petals.
    """
    import shapely

    strips, necks = [], []
    for tab in tabs:
        if not is_corner_tab(net, tab):
            strips.append(tab_strip(tab, kerf_mm, 1.2 * kerf_mm + 0.01, 0.5 * kerf_mm))
            continue
        neck = neck_of(net, tab, kerf_mm)
        if neck is None:
            raise ValueError(f"the tab at {tab.start} is no neck between petals of this net")
        necks.append(neck)
    parts = shapely.get_parts(lines)  # one by one, so that lines that touch are not broken up
    later = []
    if strips:
        zone = shapely.union_all(strips)
        later.append(_as_lines(shapely.intersection(parts, zone)))
        parts = shapely.difference(parts, zone)
    for neck in necks:
        parts = shapely.difference(parts, neck.zone)
        later.append(_as_lines(neck.release()))
    now = [_as_lines(parts), *(_as_lines(neck.sides()) for neck in necks)]
    return _joined(now), _joined(later)


def tab_strip(tab: Tab, kerf_mm: float, reach_mm: float, inward_mm: float = 0.0) -> Geometry:
    """Shapely rectangle over the stretch of ``tab``, ``kerf_mm`` longer, from the net edge outwards.

    The stretch runs counter-clockwise along the net, so outward is to its right.
    """
    import shapely

    start, end = np.array(tab.start), np.array(tab.end)
    along = (end - start) / np.linalg.norm(end - start)
    outward = np.array([along[1], -along[0]])
    a, b = start - 0.5 * kerf_mm * along, end + 0.5 * kerf_mm * along
    return shapely.Polygon(
        [a - inward_mm * outward, a + reach_mm * outward, b + reach_mm * outward, b - inward_mm * outward]
    )


def clip_seams(sheet: Sheet, clipped: Collection[int], lines: Geometry, kerf_mm: float) -> Geometry:
    """Lines between clipped and kept substrate, drawn out to the contour where they end beside the net."""
    import shapely

    gone = set(clipped)
    owner: dict[tuple[int, int], int] = {}
    for t, corners in enumerate(sheet.faces.tolist()):
        for k in range(3):
            owner[corners[k], corners[(k + 1) % 3]] = t
    seams = [
        sheet.vertices[[a, b]]
        for (a, b), t in sorted(owner.items())
        if t in gone and owner.get((b, a), t) not in gone
    ]
    if not seams:
        return shapely.MultiLineString()
    merged = shapely.line_merge(shapely.multilinestrings(np.array(seams)))
    out = []
    for part in shapely.get_parts(merged):
        points = [tuple(p) for p in shapely.get_coordinates(part).tolist()]
        if points[0] != points[-1]:
            points = _reach(lines, points[0], kerf_mm) + points + _reach(lines, points[-1], kerf_mm)
        out.append(shapely.LineString(points))
    return shapely.MultiLineString(out)


def polylines(lines: Geometry) -> tuple[Polyline, ...]:
    """The parts of shapely ``lines`` as tuples of points in mm, sorted; crumbs are dropped."""
    import shapely

    if lines.is_empty:
        return ()
    out = []
    for part in shapely.get_parts(lines):
        if part.length < _SHORTEST_MM:
            continue
        line: list[Point] = []
        for x, y in shapely.get_coordinates(part).tolist():
            point = (round(x, 6) + 0.0, round(y, 6) + 0.0)
            if not line or point != line[-1]:
                line.append(point)
        if len(line) > 1:
            out.append(tuple(line))
    return tuple(sorted(out))


def in_travel_order(paths: Iterable[Polyline], start: Point = (0.0, 0.0)) -> tuple[Polyline, ...]:
    """``paths`` in the order of a greedy tour from ``start``; open ones may be turned round."""
    rest = list(paths)
    out: list[Polyline] = []
    here = start
    while rest:
        options = [
            (round(math.dist(here, p[0 if forward else -1]), 6), k, forward)
            for k, p in enumerate(rest)
            for forward in (True, False)
        ]
        _, k, forward = min(options, key=lambda option: (option[0], option[1], not option[2]))
        path = rest.pop(k)
        out.append(path if forward else path[::-1])
        here = out[-1][-1]
    return tuple(out)


def _joined(lines: list[Geometry]) -> Geometry:
    import shapely

    return shapely.MultiLineString([part for shape in lines for part in shapely.get_parts(shape)])


def _as_lines(shape: Geometry) -> Geometry:
    """Only the lines of ``shape`` (one or an array), those of one part merged, as one multi-line."""
    import shapely

    merged = shapely.line_merge(np.atleast_1d(shape))
    parts = shapely.get_parts(shapely.get_parts(merged))
    flat = [p for p in parts if p.geom_type in ("LineString", "LinearRing") and p.length > 0.0]
    return shapely.MultiLineString([shapely.get_coordinates(p) for p in flat])


def _reach(lines: Geometry, point: tuple[float, ...], kerf_mm: float) -> list[tuple[float, ...]]:
    """The way from the end of a seam to the contour beside it; nothing if it ends elsewhere."""
    import shapely

    spot = shapely.Point(point)
    if not 1e-9 < lines.distance(spot) <= 4.0 * kerf_mm:
        return []
    near = shapely.get_coordinates(shapely.shortest_line(lines, spot))[0]
    return [tuple(near.tolist())]


def _slits(net: Net, kerf: float) -> list[Geometry]:
    """Middle lines of the gaps narrower than ``kerf`` between two cut edges."""
    import shapely

    _, _, corners = boundary_edges(net)
    ends = net.vertices[corners]
    lines = shapely.linestrings(ends)
    tree = shapely.STRtree(lines)
    left, right = tree.query(lines, predicate="dwithin", distance=kerf)
    out: list[Geometry] = []
    for i, j in sorted(zip(left.tolist(), right.tolist(), strict=True)):
        follows = corners[i, 1] == corners[j, 0] and corners[i, 0] != corners[j, 1]
        if follows and _gap_angle(ends[i], ends[j]) >= _WIDE_GAP_RAD:
            out += _into_corner(ends[i], ends[j], kerf)
        elif i < j and not (corners[j, 1] == corners[i, 0] and _gap_angle(ends[j], ends[i]) >= _WIDE_GAP_RAD):
            out += _slit(ends[i], ends[j], kerf)
    if not out:
        return []
    # Where three faces meet in a point, a sharp one may lie between the two that face each other.
    cores = shapely.union_all(shapely.buffer(shapely.polygons(net.vertices[net.faces]), -0.2 * kerf))
    return [line for line in shapely.difference(out, cores) if not line.is_empty]


def _slit(first: NDArray[np.float64], second: NDArray[np.float64], kerf: float) -> list[Geometry]:
    """Middle line of the gap between two edges (2, 2), each with its face to the left."""
    import shapely

    one, other = shapely.LineString(first), shapely.LineString(second)
    near = one.intersection(other.buffer(kerf, quad_segs=16))
    if near.geom_type != "LineString" or near.is_empty:
        return []
    length = float(np.linalg.norm(first[1] - first[0]))
    along = (first[1] - first[0]) / length
    normal = np.array([along[1], -along[0]])
    reach = [float((p - first[0]) @ along) for p in shapely.get_coordinates(near)]
    low, high = max(0.0, min(reach)), min(length, max(reach))
    stops = sorted({low, high} | {s for s in ((p - first[0]) @ along for p in second) if low < s < high})
    away = second[1] - second[0]
    other_normal = np.array([away[1], -away[0]]) / np.linalg.norm(away)
    out = []
    for s, t in itertools.pairwise(stops):
        pairs = [
            (first[0] + u * along, _nearest(second, first[0] + u * along)) for u in (s, 0.5 * (s + t), t)
        ]
        p, q = pairs[1]
        facing = (q - p) @ normal > -_SAME_MM and (p - q) @ other_normal > -_SAME_MM
        if facing and float(normal @ other_normal) < 0.0:
            line = shapely.LineString([0.5 * (a + b) for a, b in (pairs[0], pairs[2])])
            if line.length > _GRID_MM:
                out.append(line)
    return out


def _gap_angle(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Angle in rad of the gap to the right of ``first`` and of ``second``, which starts where it ends."""
    u, v = first[0] - first[1], second[1] - second[0]
    gap = math.atan2(u[0] * v[1] - u[1] * v[0], float(u @ v)) % (2.0 * math.pi)
    return 0.0 if gap > 2.0 * math.pi - 1e-3 else gap  # a closed slit, not a face as thin as a hair


def _into_corner(first: NDArray[np.float64], second: NDArray[np.float64], kerf: float) -> list[Geometry]:
    """The short way from the contour into the corner between two edges; none if the corner is not hollow."""
    import shapely

    gap = _gap_angle(first, second)
    if gap >= math.radians(179.0):
        return []
    u, v = first[0] - first[1], second[1] - second[0]
    middle = u / np.linalg.norm(u) + v / np.linalg.norm(v)
    middle /= np.linalg.norm(middle)
    corner = second[0]
    return [shapely.LineString([corner, corner + 0.5 * kerf / math.sin(0.5 * gap) * middle])]


def _nearest(edge: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """The point of ``edge`` (2, 2) nearest to ``point``."""
    along = edge[1] - edge[0]
    share = float(np.clip((point - edge[0]) @ along / (along @ along), 0.0, 1.0))
    nearest: NDArray[np.float64] = edge[0] + share * along
    return nearest
