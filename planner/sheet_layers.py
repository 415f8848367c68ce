"""What a drawing of the sheet shows, layer by layer, for SVG and DXF alike."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from planner.fold_plan import Clip, Cut, FoldPlan, Polyline, Release, Sheet

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["LAYERS", "LAYER_COLOURS", "sheet_layers"]

LAYERS = ("VALLEY", "MOUNTAIN", "CLIP", "CUT", "TAB")
"""Names of the layers in the order in which a sheet would be worked."""

LAYER_COLOURS = {
    "VALLEY": "#0000FF",
    "MOUNTAIN": "#FF0000",
    "CLIP": "#FF8000",
    "CUT": "#000000",
    "TAB": "#00E000",
}
"""Colours as in LightBurn's palette, which sorts imported lines by colour."""

_SEAM_MM = 1e-3


def sheet_layers(plan: FoldPlan) -> dict[str, tuple[Polyline, ...]]:
    """Polylines in mm on each layer of ``LAYERS``.

    CUT holds the cuts beside the net, CLIP those between clipped and kept substrate, TAB the cuts of the
    release, VALLEY and MOUNTAIN the creases by the sign of their goal angle. No line is on two layers.
    """
    cuts = [path for step in plan.steps if isinstance(step, Cut) for path in step.paths]
    tabs = [path for step in plan.steps if isinstance(step, Release) for path in step.paths]
    clipped = {t for step in plan.steps if isinstance(step, Clip) for t in step.faces}
    seam = _seam_zone(plan.sheet, clipped)
    net = plan.net
    creases: dict[str, list[Polyline]] = {"V": [], "M": []}
    for edge, letter in zip(net.edges.tolist(), net.assignment.tolist(), strict=True):
        if letter in creases:
            a, b = net.vertices[edge].tolist()
            creases[letter].append(((a[0], a[1]), (b[0], b[1])))
    along_seam = [_runs_along(path, seam) for path in cuts]
    return {
        "VALLEY": tuple(creases["V"]),
        "MOUNTAIN": tuple(creases["M"]),
        "CLIP": tuple(path for path, is_seam in zip(cuts, along_seam, strict=True) if is_seam),
        "CUT": tuple(path for path, is_seam in zip(cuts, along_seam, strict=True) if not is_seam),
        "TAB": tuple(tabs),
    }


def _seam_zone(sheet: Sheet, clipped: Iterable[int]) -> Geometry:
    """A thin band around the edges between clipped and kept substrate."""
    import shapely

    gone = set(clipped)
    owner = {(row[k], row[(k + 1) % 3]): t for t, row in enumerate(sheet.faces.tolist()) for k in range(3)}
    edges = [edge for edge, t in owner.items() if t in gone and owner.get(edge[::-1], t) not in gone]
    if not edges:
        return shapely.Polygon()
    return shapely.multilinestrings(sheet.vertices[np.array(sorted(edges))]).buffer(_SEAM_MM)


def _runs_along(path: Polyline, seam: Geometry) -> bool:
    import shapely

    line = shapely.LineString(path)
    return bool(line.intersection(seam).length > 0.5 * line.length)
