"""The report: one self-contained HTML page that works from disk without a network."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from html import escape
from importlib import resources
from typing import Any

from planner.fold_plan import FoldPlan
from studio.manifest import Manifest
from studio.report_data import steps_values, viewer_values
from studio.report_figures import figures_html, notices_html, verdict_words
from studio.report_net_svg import net_svg
from studio.report_provenance import provenance_html
from studio.report_steps import StepRoom, StepSetting, steps_html
from studio.report_validation import event_text, validation_rows
from studio.summary import Summary

__all__ = ["report_html"]

_LINE = '<line x1="0" y1="5" x2="34" y2="5" style="stroke:var(--{});stroke-width:{};{}"/>'
_BOX = '<rect x=".5" y=".5" width="33" height="9" style="fill:var(--{});stroke:var(--{})"/>'
LEGEND = (
    ("valley", "valley fold", _LINE.format("valley", 2, "stroke-dasharray:6 4")),
    ("mountain", "mountain fold", _LINE.format("mountain", 2, "stroke-dasharray:9 3 2 3")),
    ("cut", "cut", _LINE.format("ink", 1.3, "")),
    ("relief", "relief hole", _LINE.format("relief", 3, "")),
    ("joint", "flat joint", _LINE.format("joint", 1, "")),
    ("tab", "tab", _LINE.format("tab", 5, "")),
    ("clip", "clipped sheet", _BOX.format("card", "clip-line")),
    ("frame", "clamped frame", _BOX.format("frame", "frame")),
    ("", "blocked crease", _LINE.format("bad", 4, "")),
    ("", "base face", _BOX.format("base", "base")),
)
"""Layer (if it can be switched), name, picture of what is drawn in the net; told apart by dashes, too."""


def report_html(
    plan: FoldPlan,
    summary: Summary,
    manifest: Manifest,
    *,
    settings: Mapping[int, StepSetting] | None = None,
    rooms: Mapping[int, StepRoom] | None = None,
    validation: Mapping[str, Any] | None = None,
) -> bytes:
    """The page as UTF-8 bytes; the same arguments give the same bytes.

    Args:
        plan: the plan that is shown.
        summary: the figures at the top.
        manifest: hashes, versions and parameters at the bottom.
        settings: step index → how it is burnt; None before the process is known.
        rooms: step index → margin and sight; None where nothing is known.
        validation: the certificate as it stands in ``validation.json``; None before it exists.
    """
    values = viewer_values(plan, settings)
    data = json.dumps(values, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    parts = {
        "version": escape(manifest.versions.get("metal-blossom", "")),
        "title": escape(summary.mesh),
        "style": _asset("report_style.css"),
        "verdict": escape(verdict_words(summary)),
        "verdict_class": {"pass": "pass", "not validated": "open"}.get(summary.verdict, "no"),
        "headline": escape(summary.headline()),
        "figures": figures_html(summary, validation),
        "notices": notices_html(summary),
        "net_svg": net_svg(plan),
        "legend": "".join(_legend(layer, name, mark) for layer, name, mark in LEGEND),
        "blocked": _blocked(summary),
        "validation": _validation(validation),
        "steps": steps_html(steps_values(plan), settings or {}, rooms or {}),
        "provenance": provenance_html(manifest),
        "data": data.replace("<", "\\u003c"),
        "viewer": _asset("report_viewer.js"),
    }
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match.group(1)], _asset("report_template.html"))
    return page.encode()


def _asset(name: str) -> str:
    return (resources.files("studio") / name).read_text(encoding="utf-8")


def _legend(layer: str, name: str, mark: str) -> str:
    picture = f'<svg viewBox="0 0 34 10" aria-hidden="true">{mark}</svg>{name}'
    if not layer:
        return f"<span>{picture}</span>"
    return f'<label><input type="checkbox" checked data-layer="{layer}">{picture}</label>'


def _blocked(summary: Summary) -> str:
    if not summary.blocked:
        return ""
    rows = "".join(
        f'<tr><td class="blocked-mark">crease {b["crease"]}</td><td class="num">{b["reached_deg"]:.1f}°</td>'
        f'<td class="num">{b["wanted_deg"]:.1f}°</td><td>{_why(b)}</td>'
        f'<td><button data-jump="{b["crease"]}">show</button></td></tr>'
        for b in summary.blocked
    )
    head = '<th>crease</th><th class="num">reached</th><th class="num">wanted</th><th>because</th><th></th>'
    return (
        '<section><h2>Blocked creases</h2><div class="scroll"><table>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div></section>"
    )


def _why(blocked: Mapping[str, Any]) -> str:
    """The cause of a blocked crease, what is proven, and the best cure that was found."""
    cause = str(blocked.get("cause") or blocked["text"].partition(": ")[2])
    proven, cure = (str(blocked.get(key) or "") for key in ("proven", "cure"))
    lines = [cause, proven, f"would fold with this change: {cure}" if cure else ""]
    return "<br>".join(escape(line) for line in lines if line)


def _validation(validation: Mapping[str, Any] | None) -> str:
    if validation is None:
        return ""
    body = "".join(f"<tr><td>{name}</td><td>{text}</td></tr>" for name, text in validation_rows(validation))
    events = validation.get("events") or []
    listed = "".join(f"<li>{escape(event_text(event))}</li>" for event in events[:50])
    more = f'<p class="soft">and {len(events) - 50} more</p>' if len(events) > 50 else ""
    shown = f'<h2>Events</h2><ul class="notes">{listed}</ul>{more}' if events else ""
    return f"<section><h2>Validation</h2><table><tbody>{body}</tbody></table>{shown}</section>"
