"""``sheet.svg``: the sheet in real size, cuts and creases on layers that Inkscape and laser programs know."""

from __future__ import annotations

import os

from planner.atomic_file import write_atomic
from planner.fold_plan import FoldPlan, Polyline
from planner.sheet_layers import LAYER_COLOURS, LAYERS, sheet_layers

__all__ = ["sheet_svg", "write_sheet_svg"]


def write_sheet_svg(plan: FoldPlan, path: str | os.PathLike[str]) -> None:
    """Write the drawing of the sheet to ``path``, whole or not at all.

    Raises:
        OSError: if the file cannot be written.
    """
    write_atomic(path, sheet_svg(plan))


def sheet_svg(plan: FoldPlan) -> str:
    """The sheet as SVG 1.1: one user unit is 1 mm, top side up, one group per layer.

    The file's y axis points down, so y is turned round; the corner of the sheet is at the upper left.
    """
    low, high = plan.sheet.outline.min(axis=0), plan.sheet.outline.max(axis=0)
    width, height = (high - low).tolist()
    corners = plan.sheet.outline.tolist()
    outline: Polyline = tuple((x, y) for x, y in [*corners, corners[0]])
    origin = (float(low[0]), float(high[1]))
    groups = [_group("SHEET", "#A0A0A0", (outline,), origin)]
    layers = sheet_layers(plan)
    groups += [_group(name, LAYER_COLOURS[name], layers[name], origin) for name in LAYERS]
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            '<svg xmlns="http://www.w3.org/2000/svg" version="1.1"',
            '  xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"',
            f'  width="{_number(width)}mm" height="{_number(height)}mm"',
            f'  viewBox="0 0 {_number(width)} {_number(height)}">',
            *groups,
            "</svg>",
            "",
        ]
    )


def _group(name: str, colour: str, paths: tuple[Polyline, ...], origin: tuple[float, float]) -> str:
    lines = [
        f'<g id="{name}" inkscape:label="{name}" inkscape:groupmode="layer" fill="none" stroke="{colour}" '
        'stroke-width="0.1">'
    ]
    for path in paths:
        closed = len(path) > 2 and path[0] == path[-1]
        points = path[:-1] if closed else path
        places = " L".join(f"{_number(x - origin[0])},{_number(origin[1] - y)}" for x, y in points)
        lines.append(f'<path d="M{places}{" Z" if closed else ""}"/>')
    return "\n".join([*lines, "</g>"])


def _number(value: float) -> str:
    """``value`` in mm to a nanometre, without trailing zeros."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
