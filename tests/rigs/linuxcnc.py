"""Reads a G-code file with LinuxCNC's interpreter: what somebody else's parser makes of our bytes."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from rigs.machine_trace import MachineTrace, Stroke
from rigs.rig import Rig

INTERPRETER = shutil.which("rs274")
MISSING = "LinuxCNC's interpreter rs274 is not installed (Debian: linuxcnc-uspace)"

_CALL = re.compile(r"^\s*\d+\s+N\S+\s+([A-Z_0-9]+)\((.*)\)\s*$")


@dataclass(frozen=True)
class Reading:
    """What the interpreter said.

    Attributes:
        trace: every straight feed with the spindle on and S over 0.
        dark_turns: rotary moves with the spindle off.
        pauses: optional and program stops.
        calls: names of all canonical calls, in order.
    """

    trace: MachineTrace
    dark_turns: int
    pauses: int
    calls: tuple[str, ...]


def read_with_linuxcnc(path: Path, rig: Rig) -> Reading:
    """Interpret a file.

    Raises:
        AssertionError: if the interpreter refuses it, or light is on in a rapid or while the rotary turns.
    """
    assert INTERPRETER is not None
    done = subprocess.run([INTERPRETER, "-g", str(path)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout[-500:] + done.stderr[-500:]
    place = [0.0] * 6
    spindle, s, feed, turns, pauses = False, 0.0, 0.0, 0, 0
    strokes: list[Stroke] = []
    calls: list[str] = []
    index = "XYZABC".index(rig.rotary.word)
    units = rig.rotary.units_per_deg * rig.rotary.sign
    for line in done.stdout.splitlines():
        if (match := _CALL.match(line)) is None:
            continue
        name, text = match[1], match[2]
        calls.append(name)
        if name == "START_SPINDLE_COUNTERCLOCKWISE":
            spindle = True
        elif name == "START_SPINDLE_CLOCKWISE":
            raise AssertionError("M3: light that stays on at standstill")
        elif name == "STOP_SPINDLE_TURNING":
            spindle = False
        elif name == "SET_SPINDLE_SPEED":
            s = float(text.split(",")[1])
        elif name == "SET_FEED_RATE":
            feed = float(text) / 60.0
        elif name == "PROGRAM_STOP":
            pauses += 1
            assert not spindle, "a pause with the light on"
        elif name in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE"):
            target = [float(v) for v in text.split(",")]
            turned = abs(target[index] - place[index]) > 1e-9
            assert not (turned and spindle), "the rotary turns with the light on"
            assert not (name == "STRAIGHT_TRAVERSE" and spindle), "a rapid with the light on"
            turns += turned
            if spindle and s > 0.0:
                dose = rig.laser.power_for_s(s) / feed
                ends = [_point(p, rig) for p in (place, target)]
                strokes.append(Stroke(ends[0], ends[1], place[index] / units, 0.0, dose))
            place = target
    assert not spindle, "the file ends with the light on"
    return Reading(MachineTrace("rs274", tuple(strokes)), turns, pauses, tuple(calls))


def _point(place: list[float], rig: Rig) -> tuple[float, float, float]:
    height = place[2] if rig.has_focus_axis else rig.rotary.axis_point_mm[2]
    return place[0], place[1], height
