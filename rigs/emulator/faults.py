"""The fault script: what goes wrong at which received line, or at which simulated second."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rigs.emulator.outside import set_overrides, slip, turn_door
from rigs.errors import ProfileError

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["Fault", "read_faults", "timed_faults"]

KINDS = (
    "error", "alarm", "drop", "mute", "power", "no-ok", "extra-ok", "garble", "door", "shut", "slip", "boost",
)  # fmt: skip
_FAULT = re.compile(r"([a-z-]+)(?::(?:([XYZABC])?([+-]?\d+(?:\.\d+)?)))?@(\d+(?:\.\d+)?)(s?)")
_OF_LINES = ("error", "no-ok", "extra-ok", "garble")


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        kind: ``error`` (answer ``error:code``, the line is not executed), ``alarm``, ``drop`` (cut the
            link), ``mute`` (answer nothing any more, not even ``?``), ``power`` (power cycle), ``no-ok``,
            ``extra-ok``, ``garble`` (``o`` instead of ``ok``), ``door`` (the lid opens), ``shut`` (and
            closes), ``slip`` (an axis moves without its controller knowing), ``boost`` (somebody sets the
            power override).
        code: of an error or alarm.
        line: number of the received line, from 1; 0 for one that strikes by time.
        axis: word of the axis that slips.
        value: mm or degrees that it slips, or percent of the power override.
        at_s: simulated second at which it strikes, if it does not wait for a line.
    """

    kind: str
    code: int
    line: int
    axis: str = ""
    value: float = 0.0
    at_s: float = 0.0

    def strike(self, machine: GrblMachine) -> bool:
        """Act, before the line if there is one; True when the line is not executed."""
        if self.kind == "alarm":
            machine.alarm(self.code)
        elif self.kind == "drop":
            machine.dropped = True
        elif self.kind == "mute":
            machine.mute = True
        elif self.kind == "power":
            machine.power_cycle()
        elif self.kind in ("door", "shut"):
            turn_door(machine, is_open=self.kind == "door")
            return False
        elif self.kind == "slip":
            slip(machine, self.axis, self.value)
            return False
        elif self.kind == "boost":
            set_overrides(machine, power=self.value)
            return False
        else:
            return False
        return True

    def after(self, machine: GrblMachine) -> bool:
        """Act after the line; True when the usual ``ok`` is not sent."""
        if self.kind == "extra-ok":
            machine.say("ok")
        elif self.kind == "garble":
            machine.say("o")
        return self.kind in ("no-ok", "garble")


def read_faults(texts: Sequence[str]) -> dict[int, Fault]:
    """Read the faults that strike at a line: ``error:9@120``, ``drop@40``, ``slip:A-5@200``.

    Raises:
        ProfileError: if a text is not a fault.
    """
    return {fault.line: fault for fault in map(_read, texts) if fault.line}


def timed_faults(texts: Sequence[str]) -> tuple[Fault, ...]:
    """Read the faults that strike at a simulated second, in order: ``door@2.5s``, ``power@10s``.

    Raises:
        ProfileError: if a text is not a fault.
    """
    return tuple(sorted((f for f in map(_read, texts) if not f.line), key=lambda f: f.at_s))


def _read(text: str) -> Fault:
    match = _FAULT.fullmatch(text)
    kind = match[1] if match else ""
    by_line = bool(match) and not match[5]  # type: ignore[index]
    if match is None or kind not in KINDS or (by_line and (not match[4].isdigit() or int(match[4]) < 1)):
        raise ProfileError(
            f"fault '{text}': expected KIND[:CODE]@LINE, such as error:9@120 or slip:A-5@200, or "
            f"KIND@SECONDSs, such as door@2.5s, with KIND one of {', '.join(KINDS)}"
        )
    if not by_line and kind in _OF_LINES:
        raise ProfileError(f"fault '{text}': {kind} needs the line that it strikes, such as {kind}@120")
    if (kind == "slip") != bool(match[2]):
        raise ProfileError(f"fault '{text}': expected an axis for slip and for nothing else: slip:A-5@200")
    value = float(match[3] or 1.0)
    if kind in ("error", "alarm") and not value.is_integer():
        raise ProfileError(f"fault '{text}': expected a whole number as the code of {kind}")
    return Fault(
        kind, int(value), int(match[4]) if by_line else 0, match[2] or "", value,
        0.0 if by_line else float(match[4]),
    )  # fmt: skip
