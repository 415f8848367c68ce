"""The assembly guide: one printable page that takes a person from the sheet to the part."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from typing import TYPE_CHECKING

from studio.guide_setup_svg import end_svg, top_svg
from studio.progress import duration_text

if TYPE_CHECKING:
    from planner.fold_plan import FoldPlan
    from rigs.job import Block, Job
    from rigs.material import Material
    from rigs.rig import Rig
    from studio.guide_pictures import Stretch
    from studio.summary import Summary

__all__ = ["GuideData", "guide_html"]

_SHOWN_CREASES = 6


@dataclass(frozen=True, eq=False)
class GuideData:
    """What a guide is made from.

    Attributes:
        plan: the plan.
        rig: the machine.
        material: the sheet metal.
        job: what is sent.
        summary: figures of the bundle.
        bundle: folder of the bundle as a person types it.
        stretches: what the machine does, in order.
        pictures: PNG files, one at the end of each stretch.
    """

    plan: FoldPlan
    rig: Rig
    material: Material
    job: Job
    summary: Summary
    bundle: str
    stretches: Sequence[Stretch]
    pictures: Sequence[bytes]


def guide_html(data: GuideData) -> bytes:
    """The guide as one self-contained HTML page, UTF-8; the same data give the same bytes."""
    name = escape(data.summary.mesh)
    style = (resources.files("studio") / "guide_style.css").read_text(encoding="utf-8")
    sections = (
        _head(data),
        _need(data),
        _setup(data),
        _before(data),
        _steps(data),
        _stop(data),
        _after(data),
    )
    page = (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{name}: assembly guide</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style}</style></head>'
        f"<body><main>{''.join(sections)}</main></body></html>\n"
    )
    return page.encode()


def _head(data: GuideData) -> str:
    summary = data.summary
    verdict = {
        "pass": "The simulation of this very job passed.",
        "not validated": "This job was NOT simulated yet: run blossom validate first.",
    }.get(summary.verdict, f"The simulation says NO ({summary.verdict}). Do not burn this job.")
    low = "" if summary.verdict == "pass" else ' class="no"'
    fitted = data.material.calibration.status == "fitted"
    trust = (
        f"Angles are fitted to burnt creases ({escape(data.material.calibration.source)})."
        if fitted
        else "The material is not calibrated: angles may be 30 % off. Burn a test strip first, or measure "
        "while folding."
    )
    return (
        f"<header><h1>{escape(summary.mesh)}</h1><p>{escape(summary.headline())}</p></header>"
        f"<p{low}><b>{escape(verdict)}</b> {trust}</p>"
    )


def _need(data: GuideData) -> str:
    plan, rig, job, summary = data.plan, data.rig, data.job, data.summary
    width, height = (plan.sheet.outline.max(axis=0) - plan.sheet.outline.min(axis=0)).tolist()
    folds = [b for b in job.blocks if b.kind == "pass"]
    cuts = [b for b in job.blocks if b.kind == "cut"]
    rows = [
        ("sheet", f"{data.material.material.title}, {data.material.temper_name}"),
        ("thickness", f"{plan.limits.thickness:g} mm"),
        (
            "size",
            f"{width:.1f} × {height:.1f} mm, of which {plan.limits.frame_margin:g} mm all around are clamped",
        ),
        ("machine", f"{rig.name}: {rig.rig.notes}" if rig.rig.notes else rig.name),
        ("folding", _settings(folds)),
        ("cutting", _settings(cuts)),
        ("rotary", f"{summary.rotations} rotations"),
        ("time", duration_text(job.seconds)),
        ("laser energy", f"{job.energy_j:.0f} J in {len(folds)} passes and {len(cuts)} cuts"),
    ]
    return f"<section><h2>What you need</h2>{_table(rows)}</section>"


def _settings(blocks: Sequence[Block]) -> str:
    """Range of powers and speeds of beam blocks."""
    if not blocks:
        return "none"
    return f"{_span([b.power_w for b in blocks])} W at {_span([b.speed_mm_s for b in blocks])} mm/s"


def _span(values: Sequence[float]) -> str:
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"


def _setup(data: GuideData) -> str:
    rig, summary = data.rig, data.summary
    holder = rig.sheet
    clamps = "Clamps are shown dark." if holder.clamp_polygons_mm else ""
    marks = (
        "Crosses are the marks that the pilot light is run over."
        if holder.fiducials_mm
        else "The rig declares no marks, so check the place of the sheet with the framing run below."
    )
    items = (
        f"Clamp the sheet flat in its frame, {escape(_side_up(data))}.",
        "Its corner lies at the figures in the drawing, in work coordinates of the machine (mm). "
        f"{clamps} {marks}",
        f"The sheet's plane holds the rotary axis: {rig.rotary.axis_point_mm[2]:g} mm in z"
        f"{', where the focus is set' if rig.has_focus_axis else ': set the focus there by hand'}.",
        "Turn the rotary by hand through a full turn: nothing may touch bed, lens or clamps.",
    )
    listed = "".join(f"<li>{item}</li>" for item in items)
    return (
        f'<section class="wide"><h2>Set up</h2><div class="drawings"><figure>{top_svg(data.plan, rig)}'
        "<figcaption>From above: sheet (grey frame is clamped), net, base panel (green), tabs, rotary axis."
        f"</figcaption></figure><figure>{end_svg(data.plan, rig)}<figcaption>Along the rotary axis: the "
        f"sheet needs its whole swing.</figcaption></figure></div><ol>{listed}</ol>"
        f"<p>The plan clips {_count(summary.clipped_pieces, 'piece')} of the sheet; what is clipped "
        "falls while the job runs. Keep the way below free.</p></section>"
    )


def _side_up(data: GuideData) -> str:
    """Which side of the sheet is up, in words."""
    return (
        "top side up" if data.rig.rotary.zero == "sheet-up" else f"zero of the rotary: {data.rig.rotary.zero}"
    )


def _before(data: GuideData) -> str:
    bundle = escape(data.bundle)
    wave = data.rig.laser.wavelength_nm
    return (
        '<section><h2>Before the beam</h2><ul class="boxes">'
        f"<li>Enclosure closed, interlock working, extraction on. Eyewear for {wave:g} nm.</li>"
        "<li>Emergency stop within reach of your hand. Nobody leaves while the job runs.</li>"
        "<li>Bright metal reflects, and it turns: no open side anywhere.</li>"
        f"<li>Does the machine agree with its profile? <code>blossom rigs probe {bundle}/rig.toml</code></li>"
        f"<li>Without light: <code>blossom replay {bundle} --port PORT --dry-run</code></li>"
        f"<li>With the pilot light round the sheet: <code>blossom replay {bundle} --port PORT --frame</code>"
        "</li>"
        f"<li>Then: <code>blossom replay {bundle} --port PORT --arm</code>; with a gauge add "
        "<code>--measure typed</code></li></ul></section>"
    )


def _steps(data: GuideData) -> str:
    figures = []
    for number, (stretch, picture) in enumerate(zip(data.stretches, data.pictures, strict=True), 1):
        shown = base64.b64encode(picture).decode()
        figures.append(
            f'<figure><img alt="the part after stretch {number}" src="data:image/png;base64,{shown}">'
            f"<figcaption><b>{number}. {escape(_title(stretch))}</b><br>{escape(_what(stretch))}"
            "</figcaption></figure>"
        )
    return (
        '<section class="wide"><h2>What you will see</h2><p>The machine does all of this by itself. The '
        "pictures show where it should stand; if it looks different, stop.</p>"
        f'<div class="pictures">{"".join(figures)}</div></section>'
    )


def _title(stretch: Stretch) -> str:
    if stretch.released:
        return "The part is free"
    if not stretch.creases:
        return "Cut"
    number = len(stretch.creases)
    return f"{number} crease{'' if number == 1 else 's'}, rotary at {stretch.rotary_deg:g}°"


def _what(stretch: Stretch) -> str:
    parts = []
    if stretch.cuts and not stretch.released:
        parts.append(_count(stretch.cuts, "cut"))
    if stretch.clips:
        parts.append(
            f"{_count(stretch.clips, 'piece')} of the sheet {'falls' if stretch.clips == 1 else 'fall'}"
        )
    if stretch.creases:
        left = len(stretch.creases) - _SHOWN_CREASES
        names = ", ".join(map(str, stretch.creases[:_SHOWN_CREASES])) + (
            f" and {left} more" if left > 0 else ""
        )
        parts.append(f"creases {names}, {_count(stretch.passes, 'pass', 'passes')}")
    if stretch.released:
        parts.append("tabs are cut; hold nothing under it that may not be hit")
    first, last = stretch.first + 1, stretch.last + 1
    steps = f"step {last}" if first == last else f"steps {first} to {last}"
    parts.append(f"{steps}, {duration_text(stretch.seconds)}")
    return "; ".join(parts)


def _count(number: int, one: str, many: str = "") -> str:
    return f"{number} {one if number == 1 else many or one + 's'}"


def _stop(data: GuideData) -> str:
    bundle = escape(data.bundle)
    rows = [
        ("something looks wrong", "Emergency stop, or Ctrl-C: the feed is held and the beam goes off."),
        ("the machine alarms, a cable comes off, the computer stops", "The beam goes off at the end of the "
         "block in work at the latest. Take nothing out of the clamps."),
        ("how far is it?", f"<code>blossom resume {bundle} --port PORT --look</code> sends nothing."),
        ("go on", f"Home the machine, then <code>blossom resume {bundle} --port PORT</code>. It asks about "
         "the one block in doubt. A fold pass in doubt is never repeated: measure the crease and add "
         "<code>--angle DEG</code>."),
        ("the sheet has moved", "Do not go on: the part is lost. Start with a new sheet."),
        ("a crease came out wrong", "Measure it. With <code>--measure typed</code> the remaining passes are "
         "made by your figures."),
    ]  # fmt: skip
    body = "".join(f"<tr><th>{escape(name)}</th><td>{text}</td></tr>" for name, text in rows)
    return f"<section><h2>When it stops</h2><table>{body}</table></section>"


def _after(data: GuideData) -> str:
    short = [b["text"] for b in data.summary.blocked]
    listed = "".join(f"<li>{escape(text)}</li>" for text in short[:10])
    more = f"<li>and {len(short) - 10} more, see report.html</li>" if len(short) > 10 else ""
    left = (
        f"<p>Creases that the plan leaves short; bend them by hand:</p><ul>{listed}{more}</ul>"
        if short
        else ""
    )
    return (
        "<section><h2>The part</h2><p>Let it cool, take it out, break off the stubs of the tabs. Edges are "
        f"sharp. Closed shapes keep open slits along the cuts.</p>{left}"
        f'<p class="soft">job {data.job.sha256[:16]} · rig {data.rig.sha256[:16]} · material '
        f"{data.material.sha256[:16]}</p></section>"
    )


def _table(rows: Sequence[tuple[str, str]]) -> str:
    body = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table>{body}</table>"
