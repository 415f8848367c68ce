"""The net on its sheet as an SVG picture for the report: layers, classes for colours, ids for linking."""

from __future__ import annotations

import numpy as np

from planner.fold_plan import Bend, Clip, Cut, FoldPlan
from planner.relief import is_relief

__all__ = ["net_svg"]


def _number(value: float) -> str:
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _points(points: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    return " ".join(f"{_number(x)},{_number(-y)}" for x, y in points.tolist())


def net_svg(plan: FoldPlan) -> str:
    """An ``<svg>`` element in sheet coordinates (mm, y up drawn upwards).

    Classes: ``sheet``, ``frame``, ``clip``, ``face``, ``base``, ``cut``, ``valley``, ``mountain``, ``joint``,
    ``relief``, ``tab``, ``axis``; creases that stay blocked also have ``blocked``. Faces carry ``data-face``,
    creases ``data-crease``.
    """
    net, sheet = plan.net, plan.sheet
    low, high = sheet.outline.min(axis=0) - 3.0, sheet.outline.max(axis=0) + 3.0
    clipped = {f for s in plan.steps if isinstance(s, Clip | Bend) for f in s.faces}
    blocked = {b.crease for b in plan.blocked}
    panel = set(net.base_panel.tolist())
    out = [
        f'<svg id="net" xmlns="http://www.w3.org/2000/svg" viewBox="{_number(low[0])} {_number(-high[1])} '
        f'{_number(high[0] - low[0])} {_number(high[1] - low[1])}" role="img" tabindex="0" '
        f'aria-label="The flat net of {len(net.faces)} faces on its sheet. '
        'Arrow keys go from face to face.">',
        f'<polygon class="sheet" points="{_points(sheet.outline)}"/>',
    ]
    for kind, members in (
        ("frame", np.flatnonzero(sheet.frame_faces).tolist()),
        ("clip", sorted(clipped)),
    ):
        path = "".join(f"M{_points(sheet.triangles[f])}Z" for f in members)
        out.append(f'<path class="{kind}" d="{path}"/>')
    out.append('<g class="faces">')
    for face in range(len(net.faces)):
        base = " base" if face in panel else ""
        corners = _points(net.vertices[net.faces[face]])
        out.append(f'<polygon class="face{base}" data-face="{face}" points="{corners}"/>')
    out.append("</g>")
    for letter, kind in (("B", "cut"), ("F", "joint"), ("M", "mountain"), ("V", "valley")):
        out.append(f'<g class="{kind}">')
        for edge in np.flatnonzero(net.assignment == letter).tolist():
            a, b = net.vertices[net.edges[edge]]
            mark = ' class="blocked"' if edge in blocked else ""
            link = "" if letter == "B" else f' data-crease="{edge}"'
            out.append(
                f'<line{mark}{link} x1="{_number(a[0])}" y1="{_number(-a[1])}" '
                f'x2="{_number(b[0])}" y2="{_number(-b[1])}"/>'
            )
        out.append("</g>")
    holes = [p for s in plan.steps if isinstance(s, Cut) and is_relief(s) for p in s.paths]
    out.append(f'<path class="relief" d="{"".join(f"M{_points(np.array(path))}" for path in holes)}"/>')
    out.append('<g class="tab">')
    for tab in sheet.tabs:
        (ax, ay), (bx, by) = tab.start, tab.end
        out.append(f'<line x1="{_number(ax)}" y1="{_number(-ay)}" x2="{_number(bx)}" y2="{_number(-by)}"/>')
    out.append("</g>")
    (ax, ay), (bx, by) = sheet.rotary_axis.tolist()
    out.append(
        f'<line class="axis" x1="{_number(ax)}" y1="{_number(-ay)}" x2="{_number(bx)}" y2="{_number(-by)}"/>'
    )
    out.append("</svg>")
    return "\n".join(out)
