"""Draws which laser settings fold, melt or cut: ``python docs/make_maps.py``.

Writes docs/pictures/fold_maps.svg. Regimes are those of the fast model, angles those of the section model.
"""

from __future__ import annotations

import math
from html import escape
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rigs.material import Material, load_material
from twin.heating import REGIMES, fold_passes
from twin.section_model import SectionCase, section_passes

PICTURE = Path(__file__).parent / "pictures" / "fold_maps.svg"
PANELS = (
    ("304", 0.075), ("304", 0.1), ("304", 0.15), ("mild-steel", 0.1), ("titanium-2", 0.1), ("1100", 0.1),
)  # fmt: skip
SPOT_MM = 0.1
SPEEDS, POWERS = np.geomspace(10.0, 1000.0, 41), np.geomspace(1.0, 100.0, 41)
"""Edges of the cells, mm/s and W."""

BANDS = ((0.1, "#e8f1fa"), (0.3, "#bdd9f0"), (0.6, "#82b8e0"), (1.0, "#3f8cc4"), (99.0, "#14568c"))
"""Angle of the first pass up to which a colour counts, degrees."""

OTHERS = {
    "below yield": ("#dcdcdc", "below yield: stays flat"),
    "buckling": ("#d9c6e8", "no gradient: sign not known"), "upsetting": ("#d9c6e8", ""),
    "melts": ("#f5b66a", "melts the surface"), "cuts": ("#cf4a3a", "cuts"),
    "unknown": ("#7a7a7a", "the model finds no balance"),
}  # fmt: skip
SIDE, LEFT, TOP, GAP_X, GAP_Y, COLUMNS = 250.0, 58.0, 92.0, 62.0, 74.0, 3
FONT = 'font-family="sans-serif" fill="#222222"'


def colours(metal: Material, thickness_mm: float) -> list[list[str]]:
    """Colour of every cell, one row for each power, weakest first."""
    speed, power = np.meshgrid(_middles(SPEEDS), _middles(POWERS))
    share = metal.absorptivity.at_1064nm
    table = fold_passes(metal, thickness_mm, power, speed, across_mm=0.5 * SPOT_MM, absorptivity=share)
    rows = []
    for p, v, regimes in zip(power, speed, table.regime, strict=True):
        names = [REGIMES[int(regime)] for regime in regimes]
        folds = [n for n, name in enumerate(names) if name in ("tgm", "mixed")]
        cases = [SectionCase(metal, thickness_mm, float(p[n]), float(v[n]), SPOT_MM, share) for n in folds]
        out = [OTHERS.get(name, ("", ""))[0] for name in names]
        for n, result in zip(folds, section_passes(cases), strict=True):
            degrees = math.degrees(float(result.angle_rad[0]))
            out[n] = (
                next(c for most, c in BANDS if degrees <= most) if result.converged else OTHERS["unknown"][0]
            )
        rows.append(out)
    return rows


def panel(name: str, thickness_mm: float, left: float, top: float) -> list[str]:
    """One map with its axes."""
    metal = load_material(name)
    title = f"{metal.name} {metal.temper_name}, {1e3 * thickness_mm:.0f} µm"
    parts = [_text(left + SIDE / 2, top - 8, title, 13, bold=True)]
    wide, high = SIDE / (len(SPEEDS) - 1), SIDE / (len(POWERS) - 1)
    for row, cells in enumerate(colours(metal, thickness_mm)):
        column = 0
        for colour, run in groupby(cells):
            count = len(list(run))
            parts.append(
                f'<rect x="{left + column * wide:.2f}" y="{top + SIDE - (row + 1) * high:.2f}" '
                f'width="{count * wide:.2f}" height="{high:.2f}" fill="{colour}" '
                'shape-rendering="crispEdges"/>'
            )
            column += count
    parts.append(f'<rect x="{left}" y="{top}" width="{SIDE}" height="{SIDE}" fill="none" stroke="#333333"/>')
    for value in (10, 20, 50, 100, 200, 500, 1000):
        x = left + SIDE * math.log(value / SPEEDS[0]) / math.log(SPEEDS[-1] / SPEEDS[0])
        parts.append(
            f'<line x1="{x:.1f}" y1="{top + SIDE}" x2="{x:.1f}" y2="{top + SIDE + 4}" stroke="#333333"/>'
        )
        parts.append(_text(x, top + SIDE + 16, str(value), 11))
    for value in (1, 2, 5, 10, 20, 50, 100):
        y = top + SIDE * (1.0 - math.log(value / POWERS[0]) / math.log(POWERS[-1] / POWERS[0]))
        parts.append(f'<line x1="{left - 4}" y1="{y:.1f}" x2="{left}" y2="{y:.1f}" stroke="#333333"/>')
        parts.append(_text(left - 7, y + 4, str(value), 11, "end"))
    parts.append(_text(left + SIDE / 2, top + SIDE + 32, "speed, mm/s", 11))
    x, y = left - 38, top + SIDE / 2
    turned = _text(x, y, "power, W", 11)
    return [*parts, f'<g transform="rotate(-90 {x:.1f} {y:.1f})">{turned}</g>']


def picture() -> str:
    """SVG text of all maps and what the colours mean."""
    rows = -(-len(PANELS) // COLUMNS)
    width = LEFT + COLUMNS * SIDE + (COLUMNS - 1) * GAP_X + 16
    height = TOP + rows * (SIDE + GAP_Y)
    low = 0.0
    legend = []
    for most, colour in BANDS:
        legend.append((colour, f"{low:g} to {most:g}°" if most < 90.0 else f"over {low:g}°"))
        low = most
    legend += [(colour, words) for colour, words in OTHERS.values() if words]
    parts = [
        _text(
            LEFT - 40,
            20,
            f"What one pass does; spot {SPOT_MM:g} mm, first pass on cold metal",
            15,
            "start",
            bold=True,
        )
    ]
    x, y = LEFT - 40, 40
    for number, (colour, words) in enumerate(legend):
        if number == len(BANDS):
            x, y = LEFT - 40, 58
        parts.append(
            f'<rect x="{x:.0f}" y="{y - 10}" width="12" height="12" fill="{colour}" stroke="#777777"/>'
        )
        parts.append(_text(x + 16, y, words, 11, "start"))
        x += 32 + 5.9 * len(words)
    for number, (name, thickness) in enumerate(PANELS):
        row, column = divmod(number, COLUMNS)
        parts += panel(name, thickness, LEFT + column * (SIDE + GAP_X), TOP + row * (SIDE + GAP_Y))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#ffffff"/>', *parts, "</svg>"]) + "\n"


def _middles(edges: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.sqrt(edges[1:] * edges[:-1])


def _text(x: float, y: float, words: str, size: int, anchor: str = "middle", *, bold: bool = False) -> str:
    weight = ' font-weight="600"' if bold else ""
    place = f'x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}"'
    return f"<text {place}{weight} {FONT}>{escape(words)}</text>"


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
