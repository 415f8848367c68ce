"""What a gauge prints: a line with an angle, read whatever words, units and commas it likes."""

from __future__ import annotations

import math
import re

__all__ = ["read_angle"]

_NUMBER = r"[-+−]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?"
_VALUE = re.compile(rf"(?<![\w.,])({_NUMBER})")
_SEXAGESIMAL = re.compile(
    r"([-+−]?)(\d+)\s*[°ºd]\s*(\d+(?:[.,]\d+)?)\s*['’′m](?:\s*(\d+(?:[.,]\d+)?)\s*[\"”″s]?)?"
)
_FAULT = re.compile(r"\b(?:err\w*|overload|OL|low\s*bat\w*|no\s*contact)\b|-{3,}|\?{2,}", re.IGNORECASE)
_OTHER_UNIT = re.compile(r"\d\s*(mm|cm|inch|in|mil|µm|um|%|kg|N)\b")
_RADIAN = re.compile(r"\b(?:m?rad)\b", re.IGNORECASE)


def read_angle(line: bytes) -> tuple[float, float | None] | None:
    """Angle and, if it is there, its standard deviation, degrees; None where a line holds no angle.

    Words around the numbers do not matter (``ANGLE 44.8 0.2``, ``A=+44,85 deg``). ``rad`` and ``mrad`` are
    turned into degrees, ``44° 51'`` is read as such; a length, an error or an angle beyond ±180° is none.
    A comma is a decimal comma unless the line has a point too, or numbers on both sides of a blank behind it.
    """
    text = line.decode("utf-8", "replace").strip()
    if len(text) > 80 or _FAULT.search(text) or _OTHER_UNIT.search(text):
        return None
    if parts := _SEXAGESIMAL.search(text):
        minutes, seconds = (float((p or "0").replace(",", ".")) for p in (parts[3], parts[4]))
        if minutes >= 60.0 or seconds >= 60.0:
            return None
        angle = float(parts[2]) + minutes / 60.0 + seconds / 3600.0
        return (-angle if parts[1] in ("-", "−") else angle, None) if angle <= 180.0 else None
    if "." in text or re.search(r"\d\s*,\s+\d", text) or text.count(",") > 2:
        text = text.replace(",", " ")
    values = [float(m.replace(",", ".").replace("−", "-")) for m in _VALUE.findall(text)]
    unit = 1.0
    if word := _RADIAN.search(text):
        unit = math.degrees(1e-3 if word[0].lower() == "mrad" else 1.0)
    values = [v * unit for v in values]
    if not values or not abs(values[0]) <= 180.0:
        return None
    sigma = values[1] if len(values) > 1 and 0.0 < values[1] <= 90.0 else None
    return values[0], sigma
