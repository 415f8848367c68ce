"""A test strip as a picture: where each piece stands and with what it is burnt."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigs.strip import Strip

__all__ = ["strip_svg"]

SCALE = 8.0
"""Pixels per mm."""

COLOURS = ("#ffe3b3", "#cfe8ff", "#d8f0d0", "#f5d0d8", "#e3d6f5", "#f0eccb")
HEAD = 58.0


def strip_svg(strip: Strip, title: str, notes: Sequence[str]) -> str:
    """SVG text, seen from the laser with y away from the reader; pieces of one speed have one colour."""
    wide, deep = strip.size_mm
    speeds = list(dict.fromkeys(piece.speed_mm_s for piece in strip.pieces))

    def at(x: float, y: float) -> tuple[float, float]:
        return SCALE * (x + 0.5 * wide) + 10.0, HEAD + SCALE * (0.5 * deep - y)

    def path(points: Sequence[tuple[float, float]]) -> str:
        return " ".join(f"{x:.1f},{y:.1f}" for x, y in (at(*p) for p in points))

    x, y = at(-0.5 * wide, 0.5 * deep)
    parts = [
        _text(10, 22, title, 15, "start", bold=True),
        _text(10, 42, "; ".join(notes), 11, "start"),
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{SCALE * wide:.1f}" height="{SCALE * deep:.1f}" '
        'fill="#f4f4f0" stroke="#888888"/>',
        f'<polyline points="{path(strip.mark)}" stroke="#c0392b" stroke-width="2.5" fill="none"/>',
    ]
    for piece in strip.pieces:
        colour = COLOURS[speeds.index(piece.speed_mm_s) % len(COLOURS)]
        parts.append(f'<polyline points="{path(strip.slit(piece))}" stroke="#333333" fill="{colour}"/>')
        if strip.kind == "fold":
            parts.append(
                f'<polyline points="{path(strip.crease(piece))}" stroke="#c0392b" stroke-width="2" '
                'stroke-dasharray="5 3" fill="none"/>'
            )
        middle, top = at(piece.x_mm + 0.5 * strip.width_mm, piece.y_mm + strip.length_mm)
        for line, words in enumerate(
            (f"{piece.number}", f"{piece.power_w:g} W", f"{piece.speed_mm_s:g} mm/s", f"{piece.passes} x")
        ):
            parts.append(
                _text(middle, top + 15.0 + 12.5 * line, words, 13 if not line else 10, bold=not line)
            )
    x, y = at(*strip.mark[0])
    parts.append(_text(x, y + 14.0, "mark", 10))
    height = HEAD + SCALE * deep + 10.0
    width = max(SCALE * wide + 20.0, 7.0 * len("; ".join(notes)) + 20.0)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#ffffff"/>', *parts, "</svg>"]) + "\n"


def _text(x: float, y: float, words: str, size: int, anchor: str = "middle", *, bold: bool = False) -> str:
    weight = ' font-weight="600"' if bold else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}"{weight} '
        f'font-family="sans-serif" fill="#222222">{escape(words)}</text>'
    )
