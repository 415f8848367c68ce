"""The steps of a plan: what is cut and clipped while the sheet is flat, the folds, and the release."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from planner.cut_paths import clip_seams, contour_lines, in_travel_order, polylines, split_at_tabs
from planner.fold_plan import Clip, Cut, Fold, Polyline, Release, Rotate, Sheet, Step, Wait
from planner.held_check import check_held
from planner.holding import Hold
from planner.metal_pieces import clipped_pieces
from planner.net import Net
from planner.net_region import net_union

__all__ = ["check_held", "fabrication_steps"]


def fabrication_steps(
    net: Net,
    sheet: Sheet,
    hold: Hold,
    folds: Sequence[Fold | Rotate | Wait],
    hits: Mapping[int, int] | Collection[int] = (),
) -> tuple[Step, ...]:
    """All steps of a plan: cuts and clips on the flat sheet, then ``folds`` as given, then the release.

    Cut are first the seams of the substrate that goes, while the net still stiffens it; then the gaps inside
    the net; then its contour, the part around the base panel last; the tabs stay. So nothing is cut that
    carries something, and every clipped piece is free when its step comes.

    Args:
        net: the placed net.
        sheet: its sheet.
        hold: tabs and clipped triangles, from ``hold_base``.
        folds: the steps of the fold planner, the rotary at 0 before the first.
        hits: substrate triangles that the folds sweep (for the words in the plan).
    """
    kerf = hold.kerf_mm
    lines = contour_lines(net, kerf)
    contour, across_tabs = split_at_tabs(net, lines, hold.tabs, kerf)
    seams = in_travel_order(polylines(clip_seams(sheet, hold.clipped, lines, kerf)))
    inner, outer, around_base = _grouped(net, polylines(contour), kerf)
    steps: list[Step] = []
    if seams:
        pieces, swept = len(clipped_pieces(sheet, hold.clipped)), len(hold.clipped & set(hits))
        steps.append(
            Cut(
                seams,
                f"outlines what the folds would hit of the sheet: {pieces} pieces, {swept} triangles touched",
            )
        )
    if inner:
        steps.append(Cut(in_travel_order(inner), "opens the gaps inside the net"))
    if outer:
        steps.append(Cut(in_travel_order(outer), "frees the faces from the sheet"))
    if around_base:
        steps.append(Cut(in_travel_order(around_base), "frees the base panel but for its tabs"))
    if hold.clipped:
        steps.append(Clip(tuple(sorted(hold.clipped))))
    steps += folds
    release = in_travel_order(polylines(across_tabs))
    steps.append(Release(release))
    return tuple(steps)


def _grouped(
    net: Net, paths: Sequence[Polyline], kerf_mm: float
) -> tuple[list[Polyline], list[Polyline], list[Polyline]]:
    """Paths inside the net, along its contour, and around the base panel."""
    import shapely

    if not paths:
        return [], [], []
    lines = [shapely.LineString(path) for path in paths]
    panel = shapely.union_all(shapely.polygons(net.vertices[net.faces[net.base_panel]]), grid_size=1e-7)
    outline = shapely.union_all([shapely.Polygon(p.exterior) for p in shapely.get_parts(net_union(net))])
    beside_base = panel.buffer(1.2 * kerf_mm)
    # A path belongs to the base panel if a good part of it runs there.
    share = [line.intersection(beside_base).length / line.length for line in lines]
    inside = shapely.contains(outline, lines)
    groups: tuple[list[Polyline], list[Polyline], list[Polyline]] = ([], [], [])
    for path, part, within in zip(paths, share, inside.tolist(), strict=True):
        groups[0 if within else 2 if part > 0.5 else 1].append(path)
    return groups
