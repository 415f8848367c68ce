"""Relief: a small hole where creases meet in a corner, so that bends do not tear or push at one another."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from planner.corner_tabs import Neck, is_corner_tab, neck_of
from planner.cut_paths import in_travel_order, polylines, tab_strip
from planner.fold_plan import Cut, Fold, FoldPlan, Point, Polyline, Tab
from planner.net import Net
from planner.net_region import LEAST_KERF_MM

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = [
    "CREASE_SHARE", "RELIEF_WHY", "is_relief", "lit_creases", "relief_mm_for", "relief_paths", "relief_radii",
    "with_relief",
]  # fmt: skip

RELIEF_WHY = "relief"
"""How the words of the step begin that cuts the holes."""

CREASE_SHARE = 0.1
"""Largest share of a crease that the hole at one of its ends takes: at least 80 % of it stays."""

_NECK_SHARE = 0.25  # of the way to the nearest edge that does not end in the corner
_LEAST_KERFS = 0.6  # smaller holes than this many kerfs in radius are none
_MEET_MM = 1e-4
_CHORD_MM = 0.002  # how far the path may be from a true circle


def relief_mm_for(spot_mm: float, thickness_mm: float) -> float:
    """Usual radius of a relief hole in mm: as large as the spot or the sheet is thick, whichever is more.

    Two strips of half width b that bend beside each other at an angle a overlap up to b / sin(a / 2) from
    their common corner: with b half a spot, one spot clears all angles from 60 degrees. Sheet metal practice
    asks for a relief of at least the thickness plus the inner radius of the bend, which is about 0 here.
    Grade C: a rule of thumb, measure on a test piece.
    """
    return max(spot_mm, thickness_mm)


def relief_radii(
    net: Net, folds: Iterable[int], tabs: Iterable[Tab], relief_mm: float, kerf_mm: float
) -> dict[int, float]:
    """Net vertex → radius in mm of its hole, for every vertex in which at least two of ``folds`` meet.

    A hole is at most ``relief_mm``, a tenth of the shortest crease that ends in the corner or as near to it
    as the beam may reach, and a quarter of the way to the nearest other edge of the faces in the corner. It
    is left out (0) where too little would be left of it to be cut, and where it would reach a tab.

    Args:
        net: the net.
        folds: creases (edge numbers) that are folded.
        tabs: what holds the base.
        relief_mm: largest radius; 0 for no holes at all.
        kerf_mm: width of a cut.
    """
    import shapely

    kerf = max(kerf_mm, LEAST_KERF_MM)
    folded = np.array(sorted(set(folds)), dtype=np.int64)
    if relief_mm <= 0.0 or not len(folded):
        return {}
    corners, meeting = np.unique(net.edges[folded], return_counts=True)
    ends = net.vertices[net.edges[folded]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    held = shapely.union_all([_beside_tab(net, tab, kerf) for tab in tabs])
    around = _faces_around(net)
    out: dict[int, float] = {}
    for vertex in corners[meeting >= 2].tolist():
        place = net.vertices[vertex]
        close = np.linalg.norm(ends - place, axis=2).min(axis=1) <= relief_mm + 0.5 * kerf
        room = _room(net, vertex, around[vertex])
        radius = min(relief_mm, CREASE_SHARE * float(lengths[close].min()), _NECK_SHARE * room)
        near_tab = shapely.Point(place).distance(held) < radius + kerf
        out[vertex] = 0.0 if near_tab or radius < _LEAST_KERFS * kerf else radius
    return out


def relief_paths(net: Net, radii: dict[int, float], kerf_mm: float) -> tuple[Polyline, ...]:
    """Where the beam runs to cut the holes: half a kerf inside of their edge, over the faces only.

    Beside the faces the contour is cut anyway; the kerf of the arcs ends in its kerf.
    """
    import shapely

    kerf = max(kerf_mm, LEAST_KERF_MM)
    around = _faces_around(net)
    out: list[Polyline] = []
    for vertex, radius in radii.items():
        if radius <= 0.0:
            continue
        beam = radius - 0.5 * kerf
        count = max(8, math.ceil(math.pi / math.acos(1.0 - min(0.5, _CHORD_MM / beam))))
        turn = 2.0 * math.pi * np.arange(count + 1) / count
        x, y = net.vertices[vertex].tolist()
        circle = shapely.LineString(np.column_stack([x + beam * np.cos(turn), y + beam * np.sin(turn)]))
        faces = shapely.union_all(shapely.polygons(net.vertices[net.faces[around[vertex]]]), grid_size=1e-7)
        arcs = circle.intersection(faces.buffer(_MEET_MM))
        out += polylines(_lines(arcs))
    return tuple(out)


def with_relief(plan: FoldPlan) -> FoldPlan:
    """``plan`` with a first step that cuts the relief holes of ``plan.limits.relief_mm``; as it is if none.

    The step's words say how many corners have a hole, and how large the holes are.
    """
    limits = plan.limits
    folds = {step.crease for step in plan.steps if isinstance(step, Fold)}
    radii = relief_radii(plan.net, folds, plan.sheet.tabs, limits.relief_mm, limits.kerf)
    paths = in_travel_order(relief_paths(plan.net, radii, limits.kerf))
    if not paths:
        return plan
    made = sorted(radius for radius in radii.values() if radius > 0.0)
    span = f"{made[0]:.2g}" if made[-1] - made[0] < 5e-4 else f"{made[0]:.2g} to {made[-1]:.2g}"
    why = f"{RELIEF_WHY}: holes at {len(made)} of {len(radii)} corners where creases meet, radius {span} mm"
    return replace(plan, steps=(Cut(paths, why), *plan.steps))


def is_relief(cut: Cut) -> bool:
    """True for the step that cuts the relief holes."""
    return cut.why.partition(":")[0] == RELIEF_WHY


def lit_creases(plan: FoldPlan) -> dict[int, tuple[Point, Point]]:
    """Crease → ends of the line that is lit, in the frame of the net: the crease less what its ends lose.

    That is a relief hole, or the neck of a tab at a corner of the base panel.

    Every crease of the net is there, in the order of its face's boundary; flat joints too.
    """
    import shapely

    net = plan.net
    half = 0.5 * max(plan.limits.kerf, LEAST_KERF_MM)
    cuts = [step for step in plan.steps if isinstance(step, Cut) and is_relief(step)]
    holes = [*shapely.buffer([shapely.LineString(path) for cut in cuts for path in cut.paths], half)]
    holes += [neck.lost for neck in _necks(net, plan.sheet.tabs, plan.limits.kerf)]
    tree = shapely.STRtree(holes)
    out: dict[int, tuple[Point, Point]] = {}
    for crease, face in sorted(net.child_of.items()):
        start, end = net.hinge(face)
        along = end - start
        line = shapely.LineString([start, end])
        low, high = 0.0, 1.0
        for hole in tree.query(line, predicate="intersects").tolist():
            points = shapely.get_coordinates(line.intersection(holes[hole]))
            shares = (points - start) @ along / float(along @ along)
            if shares.mean() < 0.5:
                low = max(low, float(shares.max()))
            else:
                high = min(high, float(shares.min()))
        a, b = (start + share * along for share in (low, high))
        out[crease] = ((float(a[0]), float(a[1])), (float(b[0]), float(b[1])))
    return out


def _beside_tab(net: Net, tab: Tab, kerf: float) -> Geometry:
    """Where no hole may be, as it would weaken a tab."""
    necks = _necks(net, [tab], kerf)
    return necks[0].lost if necks else tab_strip(tab, kerf, 2.0 * kerf, 2.0 * kerf)


def _necks(net: Net, tabs: Iterable[Tab], kerf_mm: float) -> list[Neck]:
    """The necks at corners of the base panel among ``tabs``."""
    made = [neck_of(net, tab, kerf_mm) for tab in tabs if is_corner_tab(net, tab)]
    return [neck for neck in made if neck is not None]


def _faces_around(net: Net) -> dict[int, list[int]]:
    around: dict[int, list[int]] = {}
    for face, corners in enumerate(net.faces.tolist()):
        for vertex in corners:
            around.setdefault(vertex, []).append(face)
    return around


def _room(net: Net, vertex: int, faces: list[int]) -> float:
    """Distance from a vertex to the nearest edge of its faces that does not end in it."""
    out = math.inf
    for face in faces:
        corners = net.faces[face].tolist()
        k = corners.index(vertex)
        a, b = net.vertices[corners[(k + 1) % 3]], net.vertices[corners[(k + 2) % 3]]
        out = min(out, _distance(net.vertices[vertex], a, b))
    return out


def _distance(point: NDArray[np.float64], a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    along = b - a
    share = float(np.clip((point - a) @ along / (along @ along), 0.0, 1.0))
    return float(np.linalg.norm(point - a - share * along))


def _lines(shape: Geometry) -> Geometry:
    """Only the lines of ``shape``, pieces that touch joined."""
    import shapely

    merged = shapely.line_merge(shape)
    parts = [p for p in shapely.get_parts(merged) if p.geom_type in ("LineString", "LinearRing")]
    return shapely.MultiLineString([shapely.get_coordinates(p) for p in parts])
