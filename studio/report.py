"""The report: one self-contained HTML page that works from disk without a network."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from typing import Any

from planner.fold_plan import FoldPlan
from studio.manifest import Manifest
from studio.progress import duration_text
from studio.report_data import steps_values, viewer_values
from studio.report_net_svg import net_svg
from studio.report_validation import event_text, validation_rows
from studio.summary import Summary

__all__ = ["StepSetting", "report_html"]

_LINE = '<line x1="0" y1="5" x2="34" y2="5" stroke="{}" stroke-width="{}" stroke-dasharray="{}"/>'
_BOX = '<rect x=".5" y=".5" width="33" height="9" fill="{}" stroke="{}"/>'
LEGEND = (
    ("valley fold", _LINE.format("#0072b2", 2, "6 4")),
    ("mountain fold", _LINE.format("#d55e00", 2, "9 3 2 3")),
    ("cut", _LINE.format("#1b2430", 1.3, "none")),
    ("relief hole", _LINE.format("#cc79a7", 3, "none")),
    ("flat joint", _LINE.format("#8b95a3", 1, "none")),
    ("blocked crease", _LINE.format("#b3005e", 4, "none")),
    ("tab", _LINE.format("#009e73", 5, "none")),
    ("base face", _BOX.format("#a9dccb", "none")),
    ("clipped sheet", _BOX.format("#fff", "#b8bec6")),
    ("clamped frame", _BOX.format("#d3d8de", "none")),
)
"""Name and picture of everything drawn in the net; colours after Okabe and Ito, told apart by dashes too."""


@dataclass(frozen=True)
class StepSetting:
    """How one step is burnt, for the table of steps. None where it does not apply.

    Attributes:
        passes: laser passes.
        power_w: laser power.
        speed_mm_s: speed of the beam.
        seconds: of the whole step, waits included.
        energy_j: laser energy of the step.
    """

    passes: int | None = None
    power_w: float | None = None
    speed_mm_s: float | None = None
    seconds: float | None = None
    energy_j: float | None = None


def report_html(
    plan: FoldPlan,
    summary: Summary,
    manifest: Manifest,
    *,
    settings: Mapping[int, StepSetting] | None = None,
    validation: Mapping[str, Any] | None = None,
) -> bytes:
    """The page as UTF-8 bytes; the same arguments give the same bytes.

    Args:
        plan: the plan that is shown.
        summary: the figures at the top.
        manifest: hashes, versions and parameters at the bottom.
        settings: step index → how it is burnt; None before the process is known.
        validation: the certificate as it stands in ``validation.json``; None before it exists.
    """
    data = json.dumps(viewer_values(plan), separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    parts = {
        "version": escape(manifest.versions.get("metal-blossom", "")),
        "title": escape(summary.mesh),
        "style": _asset("report_style.css"),
        "verdict": escape(_verdict_words(summary)),
        "verdict_class": {"pass": "pass", "not validated": "open"}.get(summary.verdict, "no"),
        "headline": escape(summary.headline()),
        "figures": _figures(summary),
        "notices": _notices(summary),
        "net_svg": net_svg(plan),
        "legend": "".join(
            f'<span><svg viewBox="0 0 34 10" aria-hidden="true">{mark}</svg>{name}</span>'
            for name, mark in LEGEND
        ),
        "blocked": _blocked(summary),
        "validation": _validation(validation),
        "steps": _steps(plan, settings or {}),
        "provenance": _provenance(manifest),
        "data": data.replace("<", "\\u003c"),
        "viewer": _asset("report_viewer.js"),
    }
    page = re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match.group(1)], _asset("report_template.html"))
    return page.encode()


def _asset(name: str) -> str:
    return (resources.files("studio") / name).read_text(encoding="utf-8")


def _verdict_words(summary: Summary) -> str:
    words = {"pass": f"✓ validated: {summary.verdict_words()}", "not validated": "not validated yet"}
    return words.get(summary.verdict, f"✗ verdict: {summary.verdict}")


def _figures(summary: Summary) -> str:
    rows: list[tuple[str, str, str]] = [("folded", f"{100 * summary.completion:.1f}", "%")]
    rows.append(("shape error", f"{summary.shape_rms_mm:.2f}", "mm rms"))
    rows.append(("faces", str(summary.faces), f"{summary.creases} creases"))
    bound = f"proven ≥ {summary.lower_bound}" if summary.lower_bound else ""
    rows.append(("net edits", str(summary.edits), "fewest possible" if summary.optimal else bound))
    rows.append(("blocked", str(len(summary.blocked)), "crease" if len(summary.blocked) == 1 else "creases"))
    rows.append(("rotations", str(summary.rotations), ""))
    rows.append(("clipped sheet", f"{summary.clipped_area_mm2:.0f}", "mm²"))
    if summary.pattern:
        shift, saved = (summary.pattern.get(f"{k}_mm", 0.0) for k in ("largest_shift", "shape_rms_without"))
        rows.append(("moved for bends", f"{shift:.2f}", f"mm at most, {saved:.3f} mm rms off without"))
    if summary.passes is not None:
        rows.append(("laser passes", str(summary.passes), ""))
    if summary.seconds is not None:
        rows.append(("machine time", duration_text(summary.seconds), ""))
    if summary.energy_j is not None:
        rows.append(("laser energy", f"{summary.energy_j:.0f}", "J"))
    return "\n".join(
        f"<div><dt>{escape(name)}</dt><dd>{escape(value)} <small>{escape(unit)}</small></dd></div>"
        for name, value, unit in rows
    )


def _notices(summary: Summary) -> str:
    if not summary.notices:
        return ""
    items = "".join(f"<li>{escape(text)}</li>" for text in summary.notices)
    return f'<section><h2>Worth knowing</h2><ul class="notes">{items}</ul></section>'


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


def _steps(plan: FoldPlan, settings: Mapping[int, StepSetting]) -> str:
    head = (
        '<th class="num">#</th><th>step</th><th class="num">passes</th><th class="num">power W</th>'
        '<th class="num">speed mm/s</th><th class="num">energy J</th><th class="num">time s</th>'
    )
    rows = []
    for index, values in enumerate(steps_values(plan)):
        setting = settings.get(index, StepSetting())
        cells = (
            f"{setting.passes}" if setting.passes is not None else "",
            _number(setting.power_w), _number(setting.speed_mm_s),
            _number(setting.energy_j), _number(setting.seconds),
        )  # fmt: skip
        rows.append(
            f'<tr data-step="{index}"><td class="num">{index + 1}</td><td>{escape(values["text"])}</td>'
            + "".join(f'<td class="num">{cell}</td>' for cell in cells)
            + "</tr>"
        )
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _provenance(manifest: Manifest) -> str:
    files = [(name, str(entry["sha256"])) for name, entry in sorted(manifest.files.items())]
    files = [(name, sha) for name, sha in files if manifest.files[name].get("stage") != "report"]
    inputs = [
        (f"input {manifest.input.get('name', '')}", str(manifest.input.get("sha256", ""))),
        (f"rig {manifest.rig.get('name', '')}", str(manifest.rig.get("sha256", ""))),
        (f"material {manifest.material.get('name', '')}", str(manifest.material.get("sha256", ""))),
    ]
    runs = [("seed", str(manifest.seed))]
    runs += [(stage, _plain(values) or "defaults") for stage, values in sorted(manifest.parameters.items())]
    versions = sorted(manifest.versions.items())
    return (
        f"<div><h2>Files (sha256)</h2>{_table([*inputs, *files], code=True)}</div>"
        f"<div><h2>Parameters</h2>{_table(runs)}<h2>Versions</h2>{_table(versions)}</div>"
    )


def _table(rows: Sequence[tuple[str, str]], *, code: bool = False) -> str:
    mark = ' class="hash"' if code else ""
    body = "".join(f"<tr><td>{escape(name)}</td><td{mark}>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><tbody>{body}</tbody></table>"


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"


def _plain(value: object) -> str:
    """A JSON value as short text."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, Mapping):
        return ", ".join(
            f"{str(k).replace('_', ' ')} {_plain(v)}" for k, v in sorted(value.items()) if v not in (None, "")
        )
    if isinstance(value, Iterable) and not isinstance(value, str):
        items = list(value)
        shown = ", ".join(_plain(item) for item in items[:12])
        return f"{shown} … ({len(items)})" if len(items) > 12 else shown or "none"
    return "" if value is None else str(value)
