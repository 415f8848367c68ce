"""The table of steps in the report: what is done, how it is burnt, and how much room is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

__all__ = ["StepRoom", "StepSetting", "steps_html"]


@dataclass(frozen=True)
class StepSetting:
    """How one step is burnt. None where it does not apply or is not known.

    Attributes:
        passes: laser passes.
        power_w: laser power.
        speed_mm_s: speed of the beam.
        seconds: of the whole step, waits included.
        energy_j: laser energy of the step.
        start_c: temperature of the crease when the first and when the last pass begins.
        after_c: its temperature at ``report_heat.AGES_S`` after the step, as if no other crease were burnt.
    """

    passes: int | None = None
    power_w: float | None = None
    speed_mm_s: float | None = None
    seconds: float | None = None
    energy_j: float | None = None
    start_c: tuple[float, float] | None = None
    after_c: tuple[float, ...] = ()


@dataclass(frozen=True)
class StepRoom:
    """How far the nearest metal stays away while a crease turns, and how much of it the beam sees.

    Attributes:
        margin_mm: every pair of solids keeps at least this distance; None if it is not known.
        margin_known_to_mm: distances are not told beyond this.
        seen: least share of the crease that the beam sees; None if it is not known.
        seen_proven: proven for the whole turn; otherwise looked at where the turn begins and ends.
    """

    margin_mm: float | None = None
    margin_known_to_mm: float = 1.0
    seen: float | None = None
    seen_proven: bool = False


_HEAD = (
    ("#", "number of the step"), ("step", ""), ("angle", "fold angle or rotary angle after the step"),
    ("passes", "passes of the laser"), ("power W", ""), ("speed mm/s", ""), ("energy J", ""),
    ("margin mm", "least distance between what moves and what stands still"),
    ("sight %", "least share of the crease that the beam sees"), ("time s", "waits included"),
)  # fmt: skip


def steps_html(
    steps: Sequence[Mapping[str, Any]],
    settings: Mapping[int, StepSetting],
    rooms: Mapping[int, StepRoom],
) -> str:
    """A ``<table>``; rows carry ``data-step``.

    Args:
        steps: plain values of the steps, see ``report_data.steps_values``.
        settings: step index → how it is burnt.
        rooms: step index → margin and sight.
    """
    head = "".join(_heading(name, title) for name, title in _HEAD)
    rows = []
    for index, values in enumerate(steps):
        setting, room = settings.get(index, StepSetting()), rooms.get(index, StepRoom())
        angle = values["to"] if values["op"] in ("fold", "rotate", "bend") else None
        cells = (
            "" if angle is None else f"{round(angle, 1) + 0.0:.1f}°",
            "" if setting.passes is None else str(setting.passes),
            number_text(setting.power_w), number_text(setting.speed_mm_s), number_text(setting.energy_j),
            _margin(room), _seen(room), number_text(setting.seconds),
        )  # fmt: skip
        row = "".join(f"<td class=num>{cell}</td>" for cell in cells)
        name = f"<td class=num>{index + 1}</td><td>{escape(values['text'])}</td>"
        rows.append(f'<tr data-step="{index}">{name}{row}</tr>')
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def _heading(name: str, title: str) -> str:
    tip = f' title="{title}"' if title else ""
    return f"<th{'' if name == 'step' else ' class=num'}{tip}>{name}</th>"


def number_text(value: float | None) -> str:
    """Three digits; whole from 100 on."""
    if value is None:
        return ""
    return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"


def _margin(room: StepRoom) -> str:
    if room.margin_mm is None:
        return ""
    if room.margin_mm >= room.margin_known_to_mm:
        return f"&gt; {room.margin_known_to_mm:g}"
    return f"{room.margin_mm:.3f}"


def _seen(room: StepRoom) -> str:
    if room.seen is None:
        return ""
    # rounded down: never more than is seen
    return f"{int(1000.0 * room.seen + 1e-6) / 10:.4g}{'' if room.seen_proven else '*'}"
