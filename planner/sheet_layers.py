"""What a drawing of the sheet shows, layer by layer, for SVG and DXF alike."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from planner.fold_plan import Clip, Cut, FoldPlan, Polyline, Release, Sheet
from planner.pattern import pattern_of
from planner.relief import is_relief

if TYPE_CHECKING:
    from shapely import Geometry

__all__ = ["LAYERS", "LAYER_COLOURS", "sheet_layers"]

LAYERS = ("RELIEF", "VALLEY", "MOUNTAIN", "CLIP", "CUT", "TAB")
"""Names of the layers in the order in which a sheet would be worked."""

LAYER_COLOURS = {
    "RELIEF": "#FF00FF",
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

    RELIEF holds the holes where creases meet, CUT the cuts beside the net, CLIP those between clipped and
    kept substrate, TAB the cuts of the release, VALLEY and MOUNTAIN the creases by the sign of their goal
    angle. No line is on two layers. All lie where the pattern has them, which allows for the bends.
    """
    pattern = pattern_of(plan)
    relief = [p for step in plan.steps if isinstance(step, Cut) and is_relief(step) for p in step.paths]
    cuts = [p for step in plan.steps if isinstance(step, Cut) and not is_relief(step) for p in step.paths]
    tabs = [path for step in plan.steps if isinstance(step, Release) for path in step.paths]
    clipped = {t for step in plan.steps if isinstance(step, Clip) for t in step.faces}
    seam = _seam_zone(plan.sheet, clipped)
    net = plan.net
    creases: dict[str, list[Polyline]] = {"V": [], "M": []}
    for edge, letter in enumerate(net.assignment.tolist()):
        if letter in creases:
            creases[letter].append(pattern.creases[edge])
    along_seam = [_runs_along(path, seam) for path in cuts]
    return {
        "RELIEF": pattern.paths(relief),
        "VALLEY": tuple(creases["V"]),
        "MOUNTAIN": tuple(creases["M"]),
        "CLIP": pattern.paths(p for p, is_seam in zip(cuts, along_seam, strict=True) if is_seam),
        "CUT": pattern.paths(p for p, is_seam in zip(cuts, along_seam, strict=True) if not is_seam),
        "TAB": pattern.paths(tabs),
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
