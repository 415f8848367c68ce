"""Whether a pattern can be cut as it is: faces that overlap, metal that would come loose."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.bend_allowance import bent_triangles
from planner.fold_plan import Clip, Cut, FoldPlan, Polyline
from planner.held_check import check_held
from planner.kinematics import folded_triangles
from planner.metal_pieces import NOWHERE, incentres, metal_left, piece_of
from planner.net import Net
from planner.net_region import LEAST_KERF_MM
from planner.pattern import Pattern, pattern_of
from planner.placement import GAP_MM
from planner.relief import is_relief, with_relief

__all__ = ["PatternFigures", "pattern_faults", "pattern_figures", "pattern_overlap", "with_pattern"]

_OVERLAP_SHARE = 0.5  # of a kerf: deeper overlaps of the pattern are told


@dataclass(frozen=True)
class PatternFigures:
    """What the pattern changes. Lengths in mm.

    Attributes:
        bend_width: width of the strip that bends, in the flat.
        neutral_shift: distance of the neutral fibre beyond the middle of the sheet.
        largest_shift: how far the face moves that moves most.
        shape_rms_without: root mean square distance of all face corners from where the plan has them, base
            at rest, if the net were cut as it is and bent with the same radius; the pattern makes it 0.
        overlap: how deep two moved faces lie over each other at most; each loses half of it along a slit.
        kerf_loss: deepest that a cut takes from a face, because the gap beside it is narrower than the kerf.
        kerf_loss_mm2: metal that cuts take from the faces in all, relief holes not counted.
    """

    bend_width: float
    neutral_shift: float
    largest_shift: float
    shape_rms_without: float
    overlap: float
    kerf_loss: float
    kerf_loss_mm2: float

    def to_values(self) -> dict[str, float]:
        """Plain values for JSON, rounded to a tenth of a micrometre."""
        return {
            "bend_width_mm": round(self.bend_width, 4),
            "neutral_shift_mm": round(self.neutral_shift, 4),
            "largest_shift_mm": round(self.largest_shift, 4),
            "shape_rms_without_mm": round(self.shape_rms_without, 4),
            "overlap_mm": round(self.overlap, 4),
            "kerf_loss_mm": round(self.kerf_loss, 4),
            "kerf_loss_mm2": round(self.kerf_loss_mm2, 3),
        }


def with_pattern(plan: FoldPlan) -> FoldPlan:
    """``plan`` with the relief holes of its limits, its bend allowance checked; what cannot be is said.

    Relief holes that would drop something, and an allowance whose pattern would cut off a face or leave the
    sheet, are taken out of ``limits``, with a notice that says why. Faces that come to lie over each other by
    more than half a kerf are told too.
    """
    if plan.limits.relief_mm > 0.0:
        relieved = with_relief(plan)
        problems = [] if "held" in plan.without else check_held(relieved)
        if problems:
            plan = _without(plan, f"no relief holes, they would cut too much: {problems[0]}", relief_mm=0.0)
        else:
            plan = relieved
    pattern = pattern_of(plan)
    if not pattern.largest_shift_mm > 0.0:
        return plan
    faults = pattern_faults(plan, pattern)
    if faults:
        words = f"no bend allowance, the pattern could not be cut: {faults[0]}"
        return _without(plan, words, bend_width=0.0, neutral_shift=0.0)
    overlap = pattern_overlap(pattern)
    if overlap > _OVERLAP_SHARE * plan.limits.kerf:
        words = f"faces of the pattern overlap by up to {overlap:.2f} mm: some edges come out shorter by half"
        return replace(plan, notices=(*plan.notices, words))
    return plan


def pattern_faults(plan: FoldPlan, pattern: Pattern) -> list[str]:
    """Why the pattern cannot be cut; empty if it can.

    Before the release every face must hang on the clamped frame, and metal that is clipped must be free of
    both; nothing may come near to the frame's clamps.
    """
    import shapely

    sheet = plan.sheet
    low, high = sheet.outline.min(axis=0), sheet.outline.max(axis=0)
    border = plan.limits.frame_margin + 0.5 * GAP_MM
    moved = pattern.triangles.reshape(-1, 2)
    if (moved < low + border).any() or (moved > high - border).any():
        return [f"faces move by up to {pattern.largest_shift_mm:.2f} mm and come too near to the frame"]
    cuts = [p for step in plan.steps if isinstance(step, Cut) for p in pattern.paths(step.paths)]
    metal = metal_left(shapely.Polygon(sheet.outline), shapely.MultiLineString(cuts), (), plan.limits.kerf)
    pieces = shapely.get_parts(metal)
    faces = piece_of(pieces, incentres(pattern.triangles))
    held = set(piece_of(pieces, incentres(sheet.triangles[sheet.frame_faces])).tolist()) - {NOWHERE}
    loose = [f for f, piece in enumerate(faces.tolist()) if piece != NOWHERE and piece not in held]
    if loose:
        return [f"face {loose[0]} would be cut off"]
    clipped = [t for step in plan.steps if isinstance(step, Clip) for t in step.faces]
    for t, piece in zip(
        clipped, piece_of(pieces, pattern.spots(incentres(sheet.triangles[clipped]))).tolist(), strict=True
    ):
        if piece in held:
            return [f"substrate triangle {t} is to be clipped and would stay joined"]
    return []


def pattern_overlap(pattern: Pattern) -> float:
    """How deep two moved faces lie over each other at most, mm.

    The two panels at a crease lie over each other by its deduction on purpose; only what is more counts.
    Nor does an overlap count that stays in a corner which both share, nearer than four times what they move
    against each other: their bends meet there.

    The depth is the least way by which two triangles must be moved apart. Source: separating axes; for convex
    shapes the least way is along the normal of a side.
    """
    import shapely

    net, triangles, shifts = pattern.net, pattern.triangles, pattern.shifts
    polygons = shapely.polygons(triangles)
    left, right = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    pairs = np.column_stack([left, right])[left < right]
    if not len(pairs):
        return 0.0
    against = np.linalg.norm(shifts[pairs[:, 0]] - shifts[pairs[:, 1]], axis=1)
    panel, above = _panels(net)
    one, other = panel[pairs].T
    joined = (one == other) | (above[one] == other) | (above[other] == one)
    depth = _depth(triangles[pairs[:, 0]], triangles[pairs[:, 1]]) - np.where(joined, against + 1e-9, 0.0)
    deepest = 0.0
    for k in np.flatnonzero(depth > 0.0).tolist():
        f, g = pairs[k].tolist()
        both = np.intersect1d(net.faces[f], net.faces[g])
        if len(both):
            places = net.vertices[both] + 0.5 * (shifts[f] + shifts[g])
            corner = shapely.MultiPoint(places).buffer(4.0 * against[k] + 1e-6)
            if corner.covers(polygons[f].intersection(polygons[g])):
                continue
        deepest = max(deepest, float(depth[k]))
    return deepest


def _depth(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N,) least way that moves triangles (N, 3, 2) apart, pair by pair; 0 or less where they are."""
    depth = np.full(len(first), np.inf)
    for sides in (first, second):
        along = np.roll(sides, -1, axis=1) - sides
        normal = np.stack([along[:, :, 1], -along[:, :, 0]], axis=2)
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        one, other = np.einsum("nkd,ncd->nkc", normal, first), np.einsum("nkd,ncd->nkc", normal, second)
        way = np.minimum(one.max(axis=2) - other.min(axis=2), other.max(axis=2) - one.min(axis=2))
        depth = np.minimum(depth, way.min(axis=1))
    return depth


def _panels(net: Net) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """(F,) panel of each face, named by its first face; (F,) the panel that such a panel hangs on, or -1."""
    panel = np.arange(len(net.faces))
    above = np.full(len(net.faces), -1)
    for face in net.order[1:].tolist():
        over = int(panel[net.parent[face]])
        if net.assignment[net.crease_of[face]] == "F":
            panel[face] = over
        else:
            above[face] = over
    return panel, above


def pattern_figures(plan: FoldPlan, pattern: Pattern | None = None) -> PatternFigures:
    """The figures of the pattern of ``plan`` (made if it is not given)."""
    limits = plan.limits
    pattern = pattern_of(plan) if pattern is None else pattern
    wanted = folded_triangles(plan.net, plan.final_angles)
    still = np.zeros((len(plan.net.faces), 2))
    bent = bent_triangles(plan.net, plan.final_angles, limits.bend_width, limits.neutral_shift, still)
    loss, area = _kerf_loss(plan)
    return PatternFigures(
        bend_width=limits.bend_width,
        neutral_shift=limits.neutral_shift,
        largest_shift=pattern.largest_shift_mm,
        shape_rms_without=float(np.sqrt(((bent - wanted) ** 2).sum(axis=2).mean())),
        overlap=pattern_overlap(pattern),
        kerf_loss=loss,
        kerf_loss_mm2=area,
    )


def _kerf_loss(plan: FoldPlan) -> tuple[float, float]:
    """Deepest loss of a face to the kerf of a cut, and the lost area, both of the net before it moves."""
    import shapely

    kerf = max(plan.limits.kerf, LEAST_KERF_MM)
    paths: list[Polyline] = [
        path for step in plan.steps if isinstance(step, Cut) and not is_relief(step) for path in step.paths
    ]
    if not paths:
        return 0.0, 0.0
    lines = shapely.MultiLineString(paths)
    faces = shapely.polygons(plan.net.vertices[plan.net.faces])
    area = shapely.area(shapely.intersection(faces, shapely.buffer(lines, 0.5 * kerf))).sum()
    # In the middle of each side: at corners, where cuts end, the round end of the kerf always reaches in.
    middles: NDArray[np.float64] = plan.net.vertices[plan.net.edges[plan.net.assignment == "B"]].mean(axis=1)
    away = shapely.distance(shapely.points(middles), lines)
    return float(max(0.5 * kerf - away.min(), 0.0)), float(area)


def _without(plan: FoldPlan, words: str, **limits: float) -> FoldPlan:
    changed = replace(plan.limits, **limits)  # type: ignore[arg-type]  # all of them are plain lengths
    return replace(plan, limits=changed, notices=(*plan.notices, words))
