"""The figures at the top of the report: what came out, how sure it is, and what is worth knowing."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from studio.progress import duration_text
from studio.summary import Summary

__all__ = ["figures_html", "notices_html", "verdict_words"]


def verdict_words(summary: Summary) -> str:
    """The verdict in words, with a mark that needs no colour."""
    words = {"pass": f"✓ validated: {summary.verdict_words()}", "not validated": "not validated yet"}
    return words.get(summary.verdict, f"✗ verdict: {summary.verdict}")


def figures_html(summary: Summary, validation: Mapping[str, Any] | None) -> str:
    """Name, value and unit of every figure that is known, as a list of definitions."""
    rows: list[tuple[str, str, str]] = [("folded", f"{100 * summary.completion:.1f}", "%")]
    rows.append(("shape error", f"{summary.shape_rms_mm:.2f}", "mm rms"))
    rows += _sureness(validation or {})
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


def _sureness(validation: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Scatter and calibration, as the certificate has them."""
    rows: list[tuple[str, str, str]] = []
    scatter = validation.get("scatter")
    if isinstance(scatter, Mapping):
        for key, name in (("open_loop", "scatter"), ("touched_up", "scatter, measured")):
            spread = scatter.get(key)
            if isinstance(spread, Mapping) and isinstance(spread.get("probability"), int | float):
                share = f"{100 * spread['probability']:.0f}"
                rows.append((name, share, f"% of {scatter.get('draws', 0)} draws pass"))
    heating = validation.get("heating")
    if isinstance(heating, Mapping) and heating.get("grade"):
        fitted = heating.get("calibration") not in (None, "", "none")
        words = "measured on this sheet" if fitted else "not calibrated"
        rows.append(("angles of passes", f"grade {heating['grade']}", words))
    return rows


def notices_html(summary: Summary) -> str:
    """The notices as a section; empty without any."""
    if not summary.notices:
        return ""
    items = "".join(f"<li>{escape(text)}</li>" for text in summary.notices)
    return f'<section><h2>Worth knowing</h2><ul class="notes">{items}</ul></section>'
