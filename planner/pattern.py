"""The pattern: the net as it is cut and lit, every face moved a little so that bends of a radius fit.

The net itself stays exact. A path of a plan is in the frame of the net; the pattern says where the beam runs.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.bend_allowance import face_shifts
from planner.fold_plan import FoldPlan, Point, Polyline
from planner.net import Net
from planner.net_region import LEAST_KERF_MM
from planner.relief import lit_creases
from planner.values import frozen_array

if TYPE_CHECKING:
    from shapely import STRtree

__all__ = ["Pattern", "pattern_of"]

_SAME_MM = 1e-6
_FADE = 10.0  # substrate moves less and less over so many times the largest shift


@dataclass(frozen=True, eq=False)
class Pattern:
    """Where everything of a plan lies in the flat once the bends are allowed for.

    Attributes:
        net: the net.
        shifts: (F, 2) how every face moves, mm; 0 for the base panel.
        creases: crease → ends of the line that is lit, moved, relief holes left out.
        kerf_mm: width of a cut.
    """

    net: Net
    shifts: NDArray[np.float64]
    creases: dict[int, tuple[Point, Point]]
    kerf_mm: float

    def __post_init__(self) -> None:
        """Freeze the shifts."""
        object.__setattr__(self, "shifts", frozen_array(self.shifts, np.float64, (len(self.net.faces), 2)))

    @cached_property
    def largest_shift_mm(self) -> float:
        """How far the face moves that moves most."""
        return float(np.linalg.norm(self.shifts, axis=1).max())

    @cached_property
    def triangles(self) -> NDArray[np.float64]:
        """(F, 3, 2) corners of the moved faces."""
        moved = self.net.vertices[self.net.faces] + self.shifts[:, None]
        return frozen_array(moved, np.float64, (None, 3, 2))

    def path(self, path: Polyline) -> Polyline:
        """``path`` of the plan where the beam runs, mm.

        A piece beside a face moves with it, and one in a slit with the mean of the two faces; where the face
        changes the ends are joined. Other points, as of seams in the sheet, move with the nearest face, less
        the farther away it is, so that a seam still ends at the contour.
        """
        if not self.largest_shift_mm > 0.0:
            return path
        out: list[Point] = []
        for start, end in itertools.pairwise(path):
            for a, b in itertools.pairwise(self._marks(start, end)):
                middle = 0.5 * (np.array(a) + b)
                beside = self._beside(middle, np.array(b) - a)
                ends = (beside, beside) if beside is not None else (self._nearest(a), self._nearest(b))
                for point, shift in zip((a, b), ends, strict=True):
                    _append(out, (point[0] + float(shift[0]), point[1] + float(shift[1])))
        if path[0] == path[-1]:
            _append(out, out[0])
            out[-1] = out[0]
        return tuple(out)

    def paths(self, paths: Iterable[Polyline]) -> tuple[Polyline, ...]:
        """All of ``paths`` where the beam runs."""
        return tuple(self.path(path) for path in paths)

    def spots(self, spots: NDArray[np.float64]) -> NDArray[np.float64]:
        """(N, 2) points of the sheet outside of the net, moved as seams move."""
        return np.array([p + self._nearest((p[0], p[1])) for p in spots]).reshape(-1, 2)

    @cached_property
    def _reach(self) -> float:
        return 0.5 * max(self.kerf_mm, LEAST_KERF_MM)

    @cached_property
    def _faces(self) -> tuple[STRtree, NDArray[np.object_]]:
        import shapely

        polygons = shapely.polygons(self.net.vertices[self.net.faces])
        return shapely.STRtree(polygons), polygons

    @cached_property
    def _corners(self) -> STRtree:
        import shapely

        return shapely.STRtree(shapely.points(self.net.vertices))

    def _marks(self, start: Point, end: Point) -> list[Point]:
        """``start``, the places where a net vertex lies beside the line, ``end``."""
        import shapely

        length = math.dist(start, end)
        if length <= _SAME_MM:
            return [start, end]
        line = shapely.LineString([start, end])
        near = self._corners.query(line, predicate="dwithin", distance=2.1 * self._reach)
        u = (np.array(end) - start) / length
        along = {round(float((self.net.vertices[k] - start) @ u), 6) for k in near.tolist()}
        stops = [s for s in sorted(along) if _SAME_MM < s < length - _SAME_MM]
        return [start, *((start[0] + s * float(u[0]), start[1] + s * float(u[1])) for s in stops), end]

    def _near(self, point: NDArray[np.float64], reach: float) -> list[tuple[float, int]]:
        """(distance, face) of the faces within ``reach``, nearest first."""
        import shapely

        tree, polygons = self._faces
        spot = shapely.Point(point)
        found = tree.query(spot, predicate="dwithin", distance=reach)
        away = shapely.distance(polygons[found], spot)
        return sorted(zip(np.round(away, 6).tolist(), found.tolist(), strict=True))

    def _beside(self, middle: NDArray[np.float64], along: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Shift of a piece of contour or slit; None if it is neither."""
        near = self._near(middle, 1.04 * self._reach + 1e-4)
        if not near:
            near = self._near(middle, 2.1 * self._reach)[:1]  # across a blunted corner
        sides: dict[bool, int] = {}
        for _, face in near:
            centre = self.net.vertices[self.net.faces[face]].mean(axis=0) - middle
            sides.setdefault(bool(along[0] * centre[1] > along[1] * centre[0]), face)
        if not sides:
            return None
        mean: NDArray[np.float64] = self.shifts[list(sides.values())].mean(axis=0)
        return mean

    def _nearest(self, point: Point) -> NDArray[np.float64]:
        """Shift of a point that belongs to no contour."""
        fade = max(_FADE * self.largest_shift_mm, 4.0 * self._reach)
        near = self._near(np.array(point), 2.2 * self._reach + fade)
        if not near:
            return np.zeros(2)
        away, face = near[0]
        moved: NDArray[np.float64] = self.shifts[face] * min(
            1.0, max(0.0, 1.0 - (away - 2.2 * self._reach) / fade)
        )
        return moved


def pattern_of(plan: FoldPlan) -> Pattern:
    """The pattern of ``plan`` for the angles that it ends with."""
    limits = plan.limits
    shifts = face_shifts(plan.net, plan.final_angles, limits.bend_width, limits.neutral_shift)
    creases = dict(_moved_creases(plan, shifts))
    return Pattern(plan.net, shifts, creases, limits.kerf)


def _moved_creases(plan: FoldPlan, shifts: NDArray[np.float64]) -> Iterator[tuple[int, tuple[Point, Point]]]:
    """Every crease half-way between where its two faces put it: the middle of the strip that bends."""
    for crease, ends in lit_creases(plan).items():
        face = plan.net.child_of[crease]
        x, y = (0.5 * (shifts[face] + shifts[plan.net.parent[face]])).tolist()
        (ax, ay), (bx, by) = ends
        yield crease, ((ax + x, ay + y), (bx + x, by + y))


def _append(out: list[Point], point: Point) -> None:
    rounded = (round(point[0], 6) + 0.0, round(point[1], 6) + 0.0)
    if not out or math.dist(out[-1], rounded) > 2.0 * _SAME_MM:
        out.append(rounded)
