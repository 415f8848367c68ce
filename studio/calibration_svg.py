"""A calibration as a picture: measured against fitted angles, and angles over the passes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from twin.calibration import Fit

__all__ = ["calibration_svg"]

COLOURS = (
    "#1b6ca8", "#c8553d", "#3a7d44", "#8d5a97", "#b8860b", "#4f6d7a", "#d1495b", "#2a9d8f",
)  # fmt: skip
SIDE, GAP, LEFT, TOP = 380.0, 90.0, 62.0, 62.0


def calibration_svg(fit: Fit, curves: Sequence[tuple[str, Sequence[tuple[float, float]]]]) -> str:
    """SVG text with two panels.

    Args:
        fit: the calibration.
        curves: by setting, its name and points (passes, degrees) of the fitted model; the settings in the
            order in which they appear in the table.
    """
    rows, fitted = fit.table.rows, fit.predicted_deg.tolist()
    blind = fit.left_out.predicted_deg.tolist()
    order = list(dict.fromkeys(row.setting for row in rows))
    most = 1.05 * max(
        [row.angle_deg for row in rows] + fitted + [b for b in blind if math.isfinite(b)] + [1.0]
    )
    width = LEFT + 2.0 * SIDE + GAP + 190.0
    parts = [
        _text(LEFT, 24, f"{fit.table.name}: angles measured and fitted, grade {fit.grade}", 15, "start"),
        _text(
            LEFT, 44, f"full: fitted; ring: predicted with its {fit.left_out.by} left out; grey: 20 % off",
            11, "start",
        ),
    ]  # fmt: skip
    parts += _frame(LEFT, most, most, "measured, °", "model, °")

    def at(x: float, y: float, left: float, widest: float) -> tuple[float, float]:
        return left + SIDE * x / widest, TOP + SIDE * (1.0 - y / most)

    band = [at(0, 0, LEFT, most), at(most / 1.2, most, LEFT, most), at(most, most, LEFT, most),
            at(most, 0.8 * most, LEFT, most)]  # fmt: skip
    parts.append(f'<polygon points="{_points(band)}" fill="#000000" fill-opacity="0.06"/>')
    parts.append(_line(at(0, 0, LEFT, most), at(most, most, LEFT, most), "#888888"))
    for row, value, other in zip(rows, fitted, blind, strict=True):
        colour = COLOURS[order.index(row.setting) % len(COLOURS)]
        tip = f"<title>line {row.line}: {row.angle_deg:.2f}° measured, {value:.2f}° fitted</title>"
        x, y = at(row.angle_deg, value, LEFT, most)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}">{tip}</circle>')
        if math.isfinite(other):
            x, y = at(row.angle_deg, other, LEFT, most)
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" fill="none" stroke="{colour}"/>')
    left = LEFT + SIDE + GAP
    widest = 1.05 * max(row.passes for row in rows)
    parts += _frame(left, widest, most, "passes", "angle, °")
    for number, (name, curve) in enumerate(curves):
        colour = COLOURS[number % len(COLOURS)]
        line = [at(x, min(y, most), left, widest) for x, y in curve]
        parts.append(f'<polyline points="{_points(line)}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        for row in rows:
            if row.setting == order[number]:
                x, y = at(row.passes, row.angle_deg, left, widest)
                parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour}"/>')
        if number < 22:
            y = TOP + 8.0 + 16.0 * number
            parts.append(_line((left + SIDE + 14, y - 4), (left + SIDE + 30, y - 4), colour))
            parts.append(_text(left + SIDE + 36, y, name, 11, "start"))
    height = TOP + SIDE + 48.0
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#ffffff"/>', *parts, "</svg>"]) + "\n"


def _frame(left: float, widest: float, most: float, below: str, beside: str) -> list[str]:
    """Axes of a panel with round ticks."""
    out = [
        f'<rect x="{left}" y="{TOP}" width="{SIDE}" height="{SIDE}" fill="none" stroke="#444444"/>',
        _text(left + SIDE / 2, TOP + SIDE + 36, below, 12),
        f'<g transform="rotate(-90 {left - 40:.1f} {TOP + SIDE / 2:.1f})">'
        + _text(left - 40, TOP + SIDE / 2, beside, 12) + "</g>",
    ]  # fmt: skip
    for tick in ticks(widest):
        x = left + SIDE * tick / widest
        out.append(_line((x, TOP), (x, TOP + SIDE), "#e4e4e4"))
        out.append(_text(x, TOP + SIDE + 16, f"{tick:g}", 11))
    for tick in ticks(most):
        y = TOP + SIDE * (1.0 - tick / most)
        out.append(_line((left, y), (left + SIDE, y), "#e4e4e4"))
        out.append(_text(left - 6, y + 4, f"{tick:g}", 11, "end"))
    return out


def ticks(most: float) -> list[float]:
    """Round figures from 0 to ``most``, some five of them."""
    raw = most / 5.0
    size = 10.0 ** math.floor(math.log10(raw))
    step = next((k * size for k in (1.0, 2.0, 5.0, 10.0) if k * size >= raw), raw)
    return [round(k * step, 9) for k in range(int(most / step) + 1)]


def _points(points: Sequence[tuple[float, float]]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)


def _line(a: tuple[float, float], b: tuple[float, float], colour: str) -> str:
    return (
        f'<line x1="{a[0]:.1f}" y1="{a[1]:.1f}" x2="{b[0]:.1f}" y2="{b[1]:.1f}" stroke="{colour}" '
        'stroke-width="1"/>'
    )


def _text(x: float, y: float, words: str, size: int, anchor: str = "middle") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}" '
        f'font-family="sans-serif" fill="#222222">{escape(words)}</text>'
    )
