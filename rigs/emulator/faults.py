"""The fault script: what goes wrong at which line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rigs.errors import ProfileError

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["Fault", "read_faults"]

KINDS = ("error", "alarm", "drop", "mute", "power", "no-ok", "extra-ok", "garble")
_FAULT = re.compile(r"([a-z-]+)(?::(\d+))?@(\d+)")


@dataclass(frozen=True)
class Fault:
    """One fault.

    Attributes:
        kind: ``error`` (answer ``error:code``, the line is not executed), ``alarm``, ``drop`` (cut the
            link), ``mute`` (answer nothing any more, not even ``?``), ``power`` (power cycle), ``no-ok``,
            ``extra-ok``, ``garble`` (``o`` instead of ``ok``).
        code: of an error or alarm.
        line: number of the received line, from 1.
    """

    kind: str
    code: int
    line: int

    def strike(self, machine: GrblMachine) -> bool:
        """Act before the line; True when the line is not executed."""
        if self.kind == "alarm":
            machine.alarm(self.code)
        elif self.kind == "drop":
            machine.dropped = True
        elif self.kind == "mute":
            machine.mute = True
        elif self.kind == "power":
            machine.motion.abort(machine.now)
            machine.power_up()
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


def read_faults(texts: list[str]) -> dict[int, Fault]:
    """Read faults written as ``KIND[:CODE]@LINE``, such as ``error:9@120`` or ``drop@40``.

    Raises:
        ProfileError: if a text is not of that form.
    """
    faults: dict[int, Fault] = {}
    for text in texts:
        match = _FAULT.fullmatch(text)
        if match is None or match[1] not in KINDS:
            raise ProfileError(
                f"fault '{text}': expected KIND[:CODE]@LINE, such as error:9@120, "
                f"with KIND one of {', '.join(KINDS)}"
            )
        faults[int(match[3])] = Fault(match[1], int(match[2] or 1), int(match[3]))
    return faults
