"""The words of the GRBL protocol: answers, status reports, error and alarm texts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

__all__ = ["Answer", "Status", "alarm_text", "error_text", "read_answer", "read_status"]

Kind = Literal["ok", "error", "alarm", "status", "setting", "message", "banner", "empty", "other"]

_ERRORS = {
    1: "a word does not start with a letter",
    2: "a number is missing or not readable",
    3: "unknown $ command",
    4: "a value that must not be negative is",
    5: "homing is switched off in the controller ($22)",
    6: "step pulse too short",
    7: "settings memory could not be read",
    8: "only possible when the machine is idle",
    9: "locked by an alarm",
    10: "soft limits need homing ($22)",
    11: "line too long",
    12: "step rate too high",
    13: "safety door open",
    14: "start-up line too long",
    15: "jog target outside the travel",
    16: "jog command not valid",
    17: "laser mode needs PWM output",
    20: "command not supported by this controller",
    21: "two commands of one modal group in a line",
    22: "feed rate missing",
    23: "command needs a whole number",
    24: "two commands use the axis words",
    25: "word repeated in a line",
    26: "axis words missing",
    27: "line number out of range",
    28: "a value is missing",
    29: "work coordinate system not available",
    30: "G53 needs G0 or G1",
    31: "axis words without a motion command",
    32: "arc has no axis words in its plane",
    33: "motion target not valid",
    34: "arc radius not valid",
    35: "arc offsets missing",
    36: "unused words in the line",
    37: "tool length offset on a wrong axis",
    38: "tool number too high",
}
_ALARMS = {
    1: "hard limit switch hit; position lost",
    2: "move would leave the travel (soft limit)",
    3: "reset while moving; position lost",
    4: "probe in a wrong state at start",
    5: "probe did not touch",
    6: "reset during homing",
    7: "door opened during homing",
    8: "homing could not leave the switch",
    9: "homing did not find the switch",
    10: "homing on a second motor did not find its switch",
}


def error_text(code: int) -> str:
    """What ``error:<code>`` means, in words."""
    return _ERRORS.get(code, "not listed for GRBL 1.1")


def alarm_text(code: int) -> str:
    """What ``ALARM:<code>`` means, in words; numbers outside the list happen and are fatal too."""
    return _ALARMS.get(code, "not listed for GRBL 1.1: treat the position as lost")


@dataclass(frozen=True)
class Answer:
    """One line from the controller.

    Attributes:
        kind: what it is.
        text: the line, odd bytes replaced.
        code: number of an error or alarm, else 0.
    """

    kind: Kind
    text: str
    code: int = 0


@dataclass(frozen=True)
class Status:
    """A status report.

    Attributes:
        state: such as ``Idle``, without its sub-state.
        substate: number after the colon, or None.
        machine: machine position, when reported.
        work: work position, when reported.
        offset: work offset, when reported.
        speed: current feed in units/min, power word ``s``.
        s: current power word.
        overrides: feed, rapid and power override in percent, when reported.
        tells_power: the report has a power word.
    """

    state: str
    substate: int | None = None
    machine: tuple[float, ...] | None = None
    work: tuple[float, ...] | None = None
    offset: tuple[float, ...] | None = None
    speed: float = 0.0
    s: float = 0.0
    overrides: tuple[float, ...] | None = None
    tells_power: bool = True


def read_answer(line: bytes) -> Answer:
    """Sort a line; never fails, whatever the bytes are."""
    text = line.decode("utf-8", "replace").strip()
    if not text:
        return Answer("empty", "")
    if text == "ok":
        return Answer("ok", text)
    for prefix, kind in (("error:", "error"), ("ALARM:", "alarm")):
        if text.startswith(prefix):
            number = text[len(prefix) :].strip()
            return Answer(kind, text, int(number) if number.isascii() and number.isdigit() else 0)  # type: ignore[arg-type]  # kind is one of the two literals above
    if text.startswith("<") and text.endswith(">"):
        return Answer("status", text)
    if text.startswith("$") and "=" in text:
        return Answer("setting", text)
    if text.startswith("[") and text.endswith("]"):
        return Answer("message", text)
    if text.startswith(("Grbl", "Marlin")):
        return Answer("banner", text)
    return Answer("other", text)


def read_status(text: str) -> Status | None:
    """Read a status report; None when it is mangled."""
    fields = text.strip("<>").split("|")
    state, _, sub = fields[0].partition(":")
    values: dict[str, tuple[float, ...]] = {}
    for item in fields[1:]:
        key, colon, rest = item.partition(":")
        if not colon or key in ("Pn", "A"):
            continue
        try:
            values[key] = tuple(float(v) for v in rest.split(","))
        except ValueError:
            return None
    feed = values.get("FS", values.get("F", (0.0,)))
    if not state.isalpha() or ("MPos" not in values and "WPos" not in values):
        return None
    return Status(
        state,
        int(sub) if sub.isdigit() else None,
        values.get("MPos"),
        values.get("WPos"),
        values.get("WCO"),
        feed[0] if feed else 0.0,
        feed[1] if len(feed) > 1 else 0.0,
        values.get("Ov"),
        len(feed) > 1,
    )
