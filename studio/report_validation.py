"""The certificate in words, for the report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

__all__ = ["event_text", "validation_rows"]

EVENT_WORDS = {
    "contact": "contact", "occluded": "the beam is hidden", "stall": "a crease does not get there",
    "tunnel": "faces passed through each other", "sag": "the part sags", "numerical": "the simulation failed",
    "rule": "a rule is broken",
}  # fmt: skip


def validation_rows(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Name and text of what the certificate says; keys that it does not have are left out.

    Args:
        values: ``validation.json`` as plain values.
    """
    rows: list[tuple[str, str]] = [("verdict", str(values.get("verdict", "")))]
    heating = _section(values, "heating")
    if heating:
        grade = f", grade {heating['grade']}" if heating.get("grade") else ""
        fitted = "not calibrated" if heating.get("calibration") in (None, "", "none") else "calibrated"
        rows.append(("heating model", f"{heating.get('model', '')}, {fitted}{grade}"))
    for key, name, text in (
        ("shape_rms", "shape error in the simulation", "{:.3f} mm rms"),
        ("max_vertex_error", "largest error of a corner", "{:.3f} mm"),
        ("closest_mm", "closest approach", "{:.3f} mm"),
        ("turns", "turns swept", "{:.0f}"),
        ("simulated_s", "simulated time", "{:.1f} s"),
        ("largest_sag", "largest sag of a crease", "{:.4f}°"),
        ("yield_share", "largest load as a share of yield", "{:.0%}"),
    ):
        value = values.get(key)
        if isinstance(value, int | float) and not (key == "closest_mm" and value < 0):
            rows.append((name, text.format(value)))
    scatter = _section(values, "scatter")
    for key, name in (("open_loop", "as planned"), ("touched_up", "touched up after measuring")):
        spread = _section(scatter, key)
        if spread:
            rows.append((f"scatter, {name}", _spread_text(spread, scatter)))
    for key, name in (("missed_by_dynamics", "contacts that the dynamics missed"), ("warnings", "warnings")):
        found = values.get(key) or ()
        rows.append((name, str(len(found)) if found else "none"))
    if values.get("mujoco"):
        rows.append(("MuJoCo", str(values["mujoco"])))
    return [(escape(name), escape(text)) for name, text in rows]


def event_text(event: Mapping[str, Any]) -> str:
    """One event in words."""
    text = (
        f"step {int(event.get('step', 0)) + 1}: {EVENT_WORDS.get(str(event.get('kind')), event.get('kind'))}"
    )
    if event.get("rule"):
        text += f" ({event['rule']})"
    if event.get("detail"):
        return f"{text}: {event['detail']}"
    faces = event.get("faces") or ()
    if faces:
        text += f", faces {', '.join(map(str, faces))}"
    if event.get("depth"):
        text += f", {event['depth']:.3f} mm deep"
    return text


def _section(values: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = values.get(key)
    return found if isinstance(found, Mapping) else {}


def _spread_text(spread: Mapping[str, Any], scatter: Mapping[str, Any]) -> str:
    text = f"{100 * float(spread.get('probability', 0.0)):.0f} % of {scatter.get('draws', 0)} draws pass"
    sure = spread.get("interval")
    if isinstance(sure, Sequence) and len(sure) == 2:
        text += f" (95 % sure: {100 * sure[0]:.0f} to {100 * sure[1]:.0f})"
    for key, words in (("contact_free", "no collision"), ("in_tolerance", "shape within tolerance")):
        if isinstance(spread.get(key), float):
            text += f"; {words} {100 * spread[key]:.0f} %"
    shape = spread.get("shape_rms_mm")
    if isinstance(shape, Sequence) and len(shape) == 3:
        text += f"; shape error {shape[1]:.2f} mm ({shape[0]:.2f} to {shape[2]:.2f})"
    return text
