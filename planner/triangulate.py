"""Well-shaped triangles in polygons: constrained triangulation, bounded edges, Delaunay flips, smoothing."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["triangulate_polygons"]

_ROUND = 6  # decimals of coordinates, mm
_LEAST_DOUBLED_AREA = 1e-7
_SMOOTHING_PASSES = 3


def triangulate_polygons(
    polygons: Sequence[Geometry], longest_edge_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Triangulate polygons that touch along whole sides as one conforming mesh.

    The constrained triangulation of each polygon is refined by halving edges (borders too) until none is
    longer than ``longest_edge_mm``, kept Delaunay by flips, and smoothed. The border of every polygon is a
    chain of edges of the result.

    Args:
        polygons: shapely polygons, holes allowed; polygons that share a border share its corners.
        longest_edge_mm: bound on every edge.

    Returns:
        (vertices (S, 2) in mm, triangles (T, 3) counter-clockwise, polygon number of each triangle (T,)).

    Raises:
        ValueError: if a polygon is not valid.
    """
    mesh = _Mesh()
    for number, polygon in enumerate(polygons):
        mesh.add_polygon(polygon, number)
    mesh.fix_borders()
    mesh.restore_delaunay()
    mesh.halve_edges(longest_edge_mm)
    for _ in range(_SMOOTHING_PASSES):
        mesh.smooth(longest_edge_mm)
        mesh.restore_delaunay()
        mesh.halve_edges(longest_edge_mm)
    return mesh.arrays()


class _Mesh:
    """Triangles as maps from each directed edge to the corner opposite of it and to its polygon."""

    def __init__(self) -> None:
        self.points: list[tuple[float, float]] = []
        self.number: dict[tuple[float, float], int] = {}
        self.apex: dict[tuple[int, int], int] = {}
        self.region: dict[tuple[int, int], int] = {}
        self.fixed: set[tuple[int, int]] = set()

    def add_polygon(self, polygon: Geometry, region: int) -> None:
        """Triangulate ``polygon`` on its own corners and add the triangles."""
        import shapely

        if not polygon.is_valid:
            raise ValueError(f"polygon {region} is not valid: {shapely.is_valid_reason(polygon)}")
        pieces = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon))
        area = 0.0
        for ring in shapely.get_coordinates(pieces).reshape(-1, 4, 2):
            corners = [self.vertex(x, y) for x, y in ring[:3].tolist()]
            a, b, c = corners
            if len({a, b, c}) < 3:
                continue
            doubled = self.orient(a, b, c)
            if doubled < 0.0:
                b, c = c, b
            self._put(a, b, c, region)
            area += 0.5 * abs(doubled)
        if abs(area - polygon.area) > 1e-6 * polygon.area + 1e-6:
            raise ValueError(f"the triangulation of polygon {region} covers {area} of {polygon.area} mm2")

    def vertex(self, x: float, y: float) -> int:
        """Number of the point (x, y), made if there is none."""
        key = (round(x, _ROUND) + 0.0, round(y, _ROUND) + 0.0)
        if key not in self.number:
            self.number[key] = len(self.points)
            self.points.append(key)
        return self.number[key]

    def orient(self, a: int, b: int, c: int) -> float:
        """Twice the signed area of the triangle a b c."""
        (ax, ay), (bx, by), (cx, cy) = self.points[a], self.points[b], self.points[c]
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    def length(self, a: int, b: int) -> float:
        """Length of the edge a b in mm."""
        return math.dist(self.points[a], self.points[b])

    def fix_borders(self) -> None:
        """No flip may remove an edge with other metal, or none, on its far side."""
        for (a, b), region in self.region.items():
            if self.region.get((b, a)) != region:
                self._fix(a, b)

    def restore_delaunay(self) -> None:
        """Flip edges until every one that may be flipped is Delaunay."""
        self._flip([edge for edge in self.apex if edge[0] < edge[1]])

    def halve_edges(self, longest_mm: float) -> None:
        """Halve the longest edge until none is longer than ``longest_mm``."""
        heap = [
            (-self.length(a, b), a, b)
            for a, b in self.apex
            if (a < b or (b, a) not in self.apex) and self.length(a, b) > longest_mm
        ]
        heapq.heapify(heap)
        while heap:
            _, a, b = heapq.heappop(heap)
            if (a, b) not in self.apex:
                continue
            for c, d in self._split(a, b):
                if self.length(c, d) > longest_mm:
                    heapq.heappush(heap, (-self.length(c, d), c, d))

    def smooth(self, longest_mm: float) -> None:
        """Move inner points to the middle of their neighbours where that makes the worst triangle better."""
        around: dict[int, list[tuple[int, int]]] = {}
        for (a, b), c in self.apex.items():
            around.setdefault(c, []).append((a, b))
        border = {v for edge in self.fixed for v in edge}
        for v in sorted(around):
            if v in border:
                continue
            ring = around[v]
            ends = sorted({a for a, _ in ring} | {b for _, b in ring})
            middle = (
                round(sum(self.points[w][0] for w in ends) / len(ends), _ROUND) + 0.0,
                round(sum(self.points[w][1] for w in ends) / len(ends), _ROUND) + 0.0,
            )
            before, old = min(self._shape(a, b, v) for a, b in ring), self.points[v]
            if middle in self.number:
                continue
            self.points[v] = middle
            after = min(self._shape(a, b, v) for a, b in ring)
            if after > before and all(self.length(v, w) <= longest_mm for w in ends):
                del self.number[old]
                self.number[middle] = v
            else:
                self.points[v] = old

    def arrays(self) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
        """Vertices, triangles and their polygons in an order that depends on the places only."""
        rows = []
        for (a, b), c in self.apex.items():
            if a < b and a < c:
                rows.append((self.region[a, b], a, b, c))
        used = sorted({v for row in rows for v in row[1:]}, key=lambda v: self.points[v])
        new = {v: k for k, v in enumerate(used)}
        final = []
        for region, *corners in rows:
            a, b, c = (new[v] for v in corners)
            first = min(a, b, c)
            final.append((region, *((a, b, c) if a == first else (b, c, a) if b == first else (c, a, b))))
        final.sort()
        table = np.array(final, dtype=np.int64).reshape(-1, 4)
        return np.array([self.points[v] for v in used]).reshape(-1, 2), table[:, 1:], table[:, 0]

    def _put(self, a: int, b: int, c: int, region: int) -> None:
        for p, q, r in ((a, b, c), (b, c, a), (c, a, b)):
            self.apex[p, q] = r
            self.region[p, q] = region

    def _drop(self, a: int, b: int, c: int) -> None:
        for p, q in ((a, b), (b, c), (c, a)):
            del self.apex[p, q]
            del self.region[p, q]

    def _fix(self, a: int, b: int) -> None:
        self.fixed.add((min(a, b), max(a, b)))

    def _shape(self, a: int, b: int, c: int) -> float:
        """Area over the sum of squared sides: 1 for equilateral, negative when turned over."""
        squares = sum(self.length(p, q) ** 2 for p, q in ((a, b), (b, c), (c, a)))
        return 2.0 * math.sqrt(3.0) * self.orient(a, b, c) / squares

    def _flip(self, edges: list[tuple[int, int]]) -> list[tuple[int, int]]:
        """Lawson's flips from ``edges`` on; returns the edges that were made."""
        made, stack = [], edges[::-1]
        budget = 50 * len(self.apex) + 1000
        while stack and budget:
            budget -= 1
            a, b = stack.pop()
            if (min(a, b), max(a, b)) in self.fixed or (a, b) not in self.apex or (b, a) not in self.apex:
                continue
            c, d, region = self.apex[a, b], self.apex[b, a], self.region[a, b]
            left, right = self.orient(a, d, c), self.orient(d, b, c)
            if not self._should_flip(a, b, c, d, left, right):
                continue
            self._drop(a, b, c)
            self._drop(b, a, d)
            self._put(a, d, c, region)
            self._put(d, b, c, region)
            made.append((c, d))
            stack += [(a, d), (d, b), (b, c), (c, a)]
        return made

    def _should_flip(self, a: int, b: int, c: int, d: int, left: float, right: float) -> bool:
        """True if a b is not locally Delaunay (sum of opposite angles) and c d can take its place."""
        if left <= _LEAST_DOUBLED_AREA or right <= _LEAST_DOUBLED_AREA:
            return False
        old = min(self.orient(a, b, c), self.orient(b, a, d))
        if old <= _LEAST_DOUBLED_AREA:
            return min(left, right) > old
        cos_c, sin_c = self._angle(c, a, b)
        cos_d, sin_d = self._angle(d, b, a)
        return sin_c * cos_d + cos_c * sin_d < -1e-9 * math.hypot(cos_c, sin_c) * math.hypot(cos_d, sin_d)

    def _angle(self, at: int, p: int, q: int) -> tuple[float, float]:
        """(cos, sin) of the angle at corner ``at`` from p to q, times the two lengths."""
        (x, y), (px, py), (qx, qy) = self.points[at], self.points[p], self.points[q]
        ux, uy, vx, vy = px - x, py - y, qx - x, qy - y
        return ux * vx + uy * vy, ux * vy - uy * vx

    def _split(self, a: int, b: int) -> list[tuple[int, int]]:
        """Put a point in the middle of edge a b; returns the edges that were made."""
        (ax, ay), (bx, by) = self.points[a], self.points[b]
        m = self.vertex(0.5 * (ax + bx), 0.5 * (ay + by))
        made, outer = [(a, m), (m, b)], []
        for p, q in ((a, b), (b, a)):
            if (p, q) not in self.apex:
                continue
            c, region = self.apex[p, q], self.region[p, q]
            self._drop(p, q, c)
            self._put(p, m, c, region)
            self._put(m, q, c, region)
            made.append((m, c))
            outer += [(q, c), (c, p)]
        if (min(a, b), max(a, b)) in self.fixed:
            self.fixed.discard((min(a, b), max(a, b)))
            self._fix(a, m)
            self._fix(m, b)
        made += self._flip(outer + made)
        return [
            (p, q) if (p, q) in self.apex else (q, p) for p, q in made if {(p, q), (q, p)} & self.apex.keys()
        ]
