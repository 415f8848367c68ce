"""The ``$`` lines of Grbl 1.1: settings, reports, homing, unlock and check mode."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rigs.emulator.gcode_words import GrblError
from rigs.emulator.parser import Wait

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["EMULATED_MARK", "dollar_line"]

EMULATED_MARK = "EMULATED"
"""Stands in ``$I`` of the emulator, never in that of a machine."""

_SETTING = re.compile(r"\$(\d+)=([+-]?(?:\d+\.?\d*|\.\d+))")


def dollar_line(machine: GrblMachine, line: str) -> Iterator[Wait]:
    """Execute a ``$`` line; yields where it has to wait.

    Raises:
        GrblError: with Grbl's error number.
    """
    if line == "$":
        machine.say("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]")
    elif line == "$G":
        machine.say(f"[{machine.modal.report()}]")
    elif line == "$C":
        _check_mode(machine)
    elif line == "$X":
        if machine.state == "Alarm":
            machine.say("[MSG:Caution: Unlocked]")
            machine.state = "Idle"
    elif machine.state not in ("Idle", "Alarm") or machine.check or machine.motion.queue:
        raise GrblError(8)
    elif line == "$$":
        for number, value in sorted(machine.settings.items()):
            decimals = 3 if number in (11, 12, 24, 25, 27) or number >= 100 else 0
            machine.say(f"${number}={value:.{decimals}f}")
    elif line == "$I":
        count, names = len(machine.config.axes), "".join(machine.config.axes)
        machine.say(f"[VER:{machine.config.version}:{EMULATED_MARK}]")
        machine.say(f"[OPT:VM,{machine.config.planner_blocks},{machine.config.rx_bytes}]")
        if machine.config.names_power:
            machine.say("[FIRMWARE:grblHAL]")
        if count > 3:
            machine.say(f"[AXS:{count}:{names}]")
    elif line == "$#":
        _parameters(machine)
    elif line == "$H":
        if not machine.settings.get(22):
            raise GrblError(5)
        machine.state = "Home"
        yield Wait(sync=True, seconds=_homing_seconds(machine))
        _home(machine)
    elif match := _SETTING.fullmatch(line):
        number, value = int(match[1]), float(match[2])
        if number not in machine.settings:
            raise GrblError(3)
        if value < 0.0 or not math.isfinite(value):
            raise GrblError(4)
        machine.settings[number] = value
        machine.motion.deviation = machine.settings.get(11, 0.01)
    else:
        raise GrblError(3)


def _check_mode(machine: GrblMachine) -> None:
    if machine.check:
        machine.say("[MSG:Disabled]")
        machine.reset_after_line = True
    elif machine.state != "Idle" or machine.motion.queue:
        raise GrblError(8)
    else:
        machine.check = True
        machine.say("[MSG:Enabled]")


def _parameters(machine: GrblMachine) -> None:
    zero = ",".join("0.000" for _ in machine.config.axes)
    here = ",".join(f"{v:.3f}" for v in machine.wco)
    machine.say(f"[G54:{here}]")
    for number in range(55, 60):
        machine.say(f"[G{number}:{zero}]")
    for name in ("G28", "G30", "G92"):
        machine.say(f"[{name}:{zero}]")
    machine.say("[TLO:0.000]")
    machine.say(f"[PRB:{zero}:0]")


def _homing_seconds(machine: GrblMachine) -> float:
    travels = [machine.settings.get(130 + i, 0.0) for i in range(min(3, len(machine.config.axes)))]
    seek = machine.settings.get(25, 1500.0) / 60.0
    return max(travels, default=0.0) / seek + 2.0


def _home(machine: GrblMachine) -> None:
    pull_off = machine.settings.get(27, 1.0)
    place = list(machine.motion.position)
    for i in range(min(3, len(place))):
        if machine.settings.get(130 + i, 0.0) > 0.0:
            place[i] = -pull_off if machine.config.g54[i] < 0.0 else pull_off
            machine.shift[i] = 0.0  # the switch knows where the axis is
    machine.motion.position = tuple(place)
    machine.state = "Idle"
