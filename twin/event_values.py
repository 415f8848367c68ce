"""Events as plain values for files: angles in degrees."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from twin.events import Event

__all__ = ["degrees", "event_values", "read_event"]


def degrees(angle_rad: float) -> float:
    """Degrees to 1e-9, so that reading and writing again gives the same bytes."""
    return round(math.degrees(angle_rad), 9)


def event_values(event: Event) -> dict[str, Any]:
    """Values for JSON; ``rule`` only where there is one."""
    values = {
        "kind": event.kind, "step": event.step, "crease": event.crease, "faces": list(event.faces),
        "substrate": list(event.substrate), "depth": event.depth_mm, "force": event.force_n,
        "angle": degrees(event.angle_rad), "time": event.time_s if event.time_s >= 0.0 else None,
        "detail": event.detail,
    }  # fmt: skip
    return values | ({"rule": event.rule} if event.rule else {})


def read_event(data: Mapping[str, Any]) -> Event:
    """An event from its values.

    Raises:
        KeyError, TypeError, ValueError: if values are missing or of another type.
    """
    time = data["time"]
    return Event(
        data["kind"], int(data["step"]), int(data["crease"]), tuple(data["faces"]), tuple(data["substrate"]),
        float(data["depth"]), float(data["force"]), math.radians(data["angle"]),
        -1.0 if time is None else float(time), str(data["detail"]), str(data.get("rule", "")),
    )  # fmt: skip
