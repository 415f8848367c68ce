"""The pictures of ``blossom bench paper`` as plain SVG: means beside the paper's, and every mesh."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from studio.bench_cases import ALL_RULES, Row
from studio.bench_tables import PAPER_PERCENT, case_mean, combinations, label, mesh_mean

__all__ = ["pictures"]

COLOURS = ("#1b6ca8", "#e07a1f", "#6aa84f", "#b4443c", "#7d5ba6", "#7a7a7a", "#2a9d8f", "#c9a227", "#555555")
PAPER_COLOUR = "#c8c8c8"
FONT = 'font-family="system-ui, sans-serif"'


def pictures(rows: Sequence[Row]) -> dict[str, str]:
    """File name → SVG."""
    pairs = combinations(rows)
    if not pairs:
        return {}
    compared = [pair for pair in pairs if pair in PAPER_PERCENT] or pairs[: len(COLOURS)]
    out = {"paper-means.svg": _means(rows, pairs), "paper-meshes.svg": _meshes(rows, compared)}
    variants = list(dict.fromkeys(row.variant for row in rows))
    if len(variants) > 1:
        out["paper-rules.svg"] = _rules(rows, pairs, [ALL_RULES, *sorted(set(variants) - {ALL_RULES})])
    return out


def _means(rows: Sequence[Row], pairs: Sequence[tuple[str, str]]) -> str:
    """A bar for each net and planner, the paper's beside it."""
    groups = []
    for pair in pairs:
        mean, _, _ = case_mean(rows, *pair, ALL_RULES)
        paper = PAPER_PERCENT.get(pair)
        ours = None if mean is None else 100.0 * mean
        groups.append((label(*pair), [(paper, PAPER_COLOUR), (ours, COLOURS[0])]))
    return _bars(groups, [("paper", PAPER_COLOUR), ("here", COLOURS[0])], "Mean fold completion, all rules")


def _rules(rows: Sequence[Row], pairs: Sequence[tuple[str, str]], variants: Sequence[str]) -> str:
    """For each variant one bar for each net and planner."""
    shown = [p for p in pairs if len({r.variant for r in rows if (r.net, r.planner) == p}) > 1]
    groups = []
    for variant in variants:
        bars = []
        for number, pair in enumerate(shown):
            mean, _, _ = case_mean(rows, *pair, variant)
            bars.append((None if mean is None else 100.0 * mean, COLOURS[number % len(COLOURS)]))
        groups.append((variant, bars))
    legend = [(label(*pair), COLOURS[number % len(COLOURS)]) for number, pair in enumerate(shown)]
    return _bars(groups, legend, "Mean fold completion, one rule left out at a time")


def _bars(
    groups: Sequence[tuple[str, Sequence[tuple[float | None, str]]]],
    legend: Sequence[tuple[str, str]],
    title: str,
) -> str:
    """Grouped bars in percent."""
    bar, gap, left, top, height = 24, 26, 52, 64, 240
    widths = [max(len(bars) * bar, 7 * len(name)) for name, bars in groups]
    width = max(left + sum(widths) + gap * (len(groups) + 1), left + sum(_legend_width(n) for n, _ in legend))
    parts = [_text(left, 22, title, size=15, anchor="start", bold=True), *_legend(legend, left, 40)]
    parts += _percent_axis(left, top, width - 12, height)
    x = left + gap
    for (name, bars), space in zip(groups, widths, strict=True):
        at = x + (space - len(bars) * bar) / 2
        for value, colour in bars:
            if value is not None:
                tall = height * value / 100.0
                parts.append(
                    f'<rect x="{at:.1f}" y="{top + height - tall:.1f}" width="{bar - 3}" height="{tall:.1f}" '
                    f'fill="{colour}"/>'
                )
                parts.append(_text(at + (bar - 3) / 2, top + height - tall - 4, f"{value:.0f}", size=10))
            at += bar
        parts.append(_text(x + space / 2, top + height + 16, name, size=11))
        x += space + gap
    return _page(width, top + height + 30, parts)


def _meshes(rows: Sequence[Row], pairs: Sequence[tuple[str, str]]) -> str:
    """A line for each mesh with a dot for each of ``pairs``, sorted by the first of them."""
    means: dict[str, list[float | None]] = {}
    for mesh in {row.mesh for row in rows}:
        group = [row for row in rows if row.mesh == mesh and row.variant == ALL_RULES]
        means[mesh] = [
            mesh_mean([r for r in group if (r.net, r.planner) == pair], lambda r: r.completion)
            for pair in pairs
        ]
    order = sorted(means, key=lambda mesh: (-(means[mesh][0] or 0.0), mesh))
    step, left, top, wide = 18, 170, 64, 560
    height = step * len(order)
    legend = [(label(*pair), COLOURS[number % len(COLOURS)]) for number, pair in enumerate(pairs)]
    width = max(left + wide + 24, 24 + sum(_legend_width(name) for name, _ in legend))
    parts = [_text(12, 22, "Fold completion of each mesh, all rules", size=15, anchor="start", bold=True)]
    parts += _legend(legend, 12, 40)
    for percent in range(0, 101, 20):
        x = left + wide * percent / 100.0
        parts.append(
            f'<line x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{top + height}" stroke="#dddddd"/>'
            + _text(x, top + height + 16, f"{percent} %", size=11)
        )
    for number, mesh in enumerate(order):
        y = top + step * (number + 0.5)
        parts.append(_text(left - 8, y + 4, mesh, size=11, anchor="end"))
        for k in range(len(pairs) - 1, -1, -1):  # the first on top
            value = means[mesh][k]
            if value is not None:
                parts.append(
                    f'<circle cx="{left + wide * value:.1f}" cy="{y:.1f}" r="4.5" fill="{legend[k][1]}" '
                    f'fill-opacity="0.85"><title>{escape(mesh)} {escape(legend[k][0])}: {100 * value:.2f} %'
                    "</title></circle>"
                )
    return _page(width, top + height + 28, parts)


def _percent_axis(left: float, top: float, right: float, height: float) -> list[str]:
    parts = []
    for percent in range(0, 101, 20):
        y = top + height * (1.0 - percent / 100.0)
        parts.append(f'<line x1="{left}" y1="{y:.1f}" x2="{right:.1f}" y2="{y:.1f}" stroke="#dddddd"/>')
        parts.append(_text(left - 6, y + 4, f"{percent} %", size=11, anchor="end"))
    return parts


def _legend_width(name: str) -> float:
    return 30.0 + 7.2 * len(name)


def _legend(entries: Sequence[tuple[str, str]], x: float, y: float) -> list[str]:
    parts = []
    for name, colour in entries:
        parts.append(f'<rect x="{x:.1f}" y="{y - 10:.1f}" width="12" height="12" fill="{colour}"/>')
        parts.append(_text(x + 17, y, name, size=12, anchor="start"))
        x += _legend_width(name)
    return parts


def _text(x: float, y: float, words: str, *, size: int, anchor: str = "middle", bold: bool = False) -> str:
    weight = ' font-weight="600"' if bold else ""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size}" text-anchor="{anchor}"{weight} {FONT} '
        f'fill="#222222">{escape(words)}</text>'
    )


def _page(width: float, height: float, parts: Sequence[str]) -> str:
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}" height="{height:.0f}" '
        f'viewBox="0 0 {width:.0f} {height:.0f}">'
    )
    return "\n".join([head, '<rect width="100%" height="100%" fill="#ffffff"/>', *parts, "</svg>"]) + "\n"
