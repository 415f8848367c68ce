"""Executing a line of G-code: modal state, checks and error numbers of Grbl 1.1."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rigs.emulator.gcode_words import GrblError, Words, read_words
from rigs.emulator.motion import Segment
from rigs.emulator.outside import set_overrides

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["Modal", "Wait", "apply_line"]

_G_GROUPS = {
    0.0: "motion", 1.0: "motion", 80.0: "motion",
    4.0: "other", 10.0: "other", 53.0: "other", 92.0: "other", 92.1: "other",
    17.0: "plane", 20.0: "units", 21.0: "units", 40.0: "cutter", 49.0: "length", 61.0: "control",
    54.0: "system", 90.0: "distance", 91.0: "distance", 93.0: "feed", 94.0: "feed",
}  # fmt: skip
_M_GROUPS = {
    0.0: "stop", 2.0: "stop", 30.0: "stop", 3.0: "spindle", 4.0: "spindle", 5.0: "spindle",
    7.0: "coolant", 8.0: "coolant", 9.0: "coolant",
}  # fmt: skip


@dataclass(frozen=True)
class Wait:
    """Why a line does not go on: for room in the planner, or for standstill and then some seconds."""

    sync: bool
    seconds: float = 0.0


@dataclass
class Modal:
    """Modal state after switching on."""

    axes: int
    motion: float = 0.0
    absolute: bool = True
    inches: bool = False
    inverse_time: bool = False
    spindle: int = 5
    coolant: int = 9
    f: float = 0.0
    s: float = 0.0

    def report(self) -> str:
        """The answer to ``$G``, without brackets."""
        motion = f"G{self.motion:g}"
        return (
            f"GC:{motion} G54 G17 G{20 if self.inches else 21} G{90 if self.absolute else 91} "
            f"G{93 if self.inverse_time else 94} M{self.spindle} M{self.coolant} T0 F{self.f:g} S{self.s:g}"
        )


def apply_line(machine: GrblMachine, line: str) -> Iterator[Wait]:
    """Execute a cleaned line on the machine; yields where it has to wait.

    Raises:
        GrblError: with Grbl's error number; nothing of the line has been executed then.
    """
    groups, values = _sort_words(machine, read_words(line))
    modal = machine.modal
    other = groups.get("other")
    target = {w: v for w, v in values.items() if w in machine.config.axes}
    used_axes = other in (10.0, 92.0) or (other in (None, 53.0) and bool(target))
    if groups.get("motion") == 80.0 and target and other != 10.0:
        raise GrblError(31)
    if target and not used_axes:
        raise GrblError(36)
    inverse = groups["feed"] == 93.0 if "feed" in groups else modal.inverse_time
    motion = groups.get("motion", modal.motion)
    moves = bool(target) and other in (None, 53.0)
    scale = 25.4 if (groups.get("units", 20.0 if modal.inches else 21.0) == 20.0) else 1.0
    feed = values["F"] * (1.0 if inverse else scale) if "F" in values else (0.0 if inverse else modal.f)
    if "feed" in groups and inverse != modal.inverse_time and "F" not in values:
        feed = 0.0
    if moves and motion == 1.0 and feed <= 0.0:
        raise GrblError(22)
    if moves and motion == 80.0:
        raise GrblError(31)
    if other == 4.0 and "P" not in values:
        raise GrblError(28)
    if other in (10.0, 92.0) and not target:
        raise GrblError(26)
    if other == 10.0 and (values.get("L") not in (2.0, 20.0) or values.get("P", 0.0) not in (0.0, 1.0)):
        raise GrblError(20)
    if machine.check:
        _set_modes(modal, groups, feed, values, inverse)
        return
    s = values.get("S", modal.s)
    spindle = int(groups.get("spindle", modal.spindle))
    standing = not (moves and motion == 1.0)
    if spindle != modal.spindle or (s != modal.s and standing and modal.spindle != 5):
        yield Wait(sync=True)
    _set_modes(modal, groups, feed, values, inverse)
    machine.light()
    if other == 4.0:
        yield Wait(sync=True, seconds=values["P"])
    elif other in (10.0, 92.0, 92.1):
        yield Wait(sync=True)
        _offset(machine, other, target, values, scale)
    elif moves:
        yield Wait(sync=False)
        _move(machine, target, motion, feed, scale, absolute_machine=other == 53.0)
    if groups.get("stop") is not None:
        yield Wait(sync=True)
        if groups["stop"] in (2.0, 30.0):
            machine.modal = Modal(modal.axes, s=0.0)
            set_overrides(machine, feed=100.0, rapid=100.0, power=100.0)
            machine.say("[MSG:Pgm End]")
        else:
            machine.hold("Hold")
        machine.light()


def _sort_words(machine: GrblMachine, words: Words) -> tuple[dict[str, float], dict[str, float]]:
    groups: dict[str, float] = {}
    values: dict[str, float] = {}
    for letter, value in words:
        if letter in "GM":
            group = (_G_GROUPS if letter == "G" else _M_GROUPS).get(round(value, 1))
            if group is None or abs(value - round(value, 1)) > 1e-6:
                raise GrblError(20)
            if group in groups:
                raise GrblError(21)
            groups[group] = round(value, 1)
        elif letter in machine.config.axes or letter in "FSNPLT":
            if letter in values:
                raise GrblError(25)
            if letter in "FSNPT" and value < 0.0:
                raise GrblError(4)
            values[letter] = value
        else:
            raise GrblError(20)
    return groups, values


def _set_modes(
    modal: Modal, groups: dict[str, float], feed: float, values: dict[str, float], inverse: bool
) -> None:
    modal.inverse_time = inverse
    modal.f = 0.0 if inverse else feed
    modal.s = values.get("S", modal.s)
    modal.motion = groups.get("motion", modal.motion)
    modal.spindle = int(groups.get("spindle", modal.spindle))
    modal.coolant = int(groups.get("coolant", modal.coolant))
    if "units" in groups:
        modal.inches = groups["units"] == 20.0
    if "distance" in groups:
        modal.absolute = groups["distance"] == 90.0


def _offset(
    machine: GrblMachine, code: float, target: dict[str, float], values: dict[str, float], scale: float
) -> None:
    here = machine.motion.end
    for i, axis in enumerate(machine.config.axes):
        if code == 92.1:
            machine.wco[i] = machine.config.g54[i]
        elif axis in target:
            value = target[axis] * (scale if axis in "XYZ" else 1.0)
            machine.wco[i] = value if values.get("L") == 2.0 else here[i] - value
    machine.reports = 0


def _move(
    machine: GrblMachine,
    target: dict[str, float],
    motion: float,
    feed: float,
    scale: float,
    *,
    absolute_machine: bool,
) -> None:
    start = machine.motion.end
    goal = list(start)
    for i, axis in enumerate(machine.config.axes):
        if axis in target:
            value = target[axis] * (scale if axis in "XYZ" else 1.0)
            if absolute_machine:
                goal[i] = value
            elif machine.modal.absolute:
                goal[i] = value + machine.wco[i]
            else:
                goal[i] += value
    if machine.settings.get(20) and _outside(machine, goal):
        machine.alarm(2)
        return
    delta = [g - p for g, p in zip(goal, start, strict=True)]
    length = math.sqrt(sum(d * d for d in delta))
    if length < 1e-9:
        return
    unit = tuple(d / length for d in delta)
    limit = _axis_limit(machine, unit, 110) / 60.0
    accel = _axis_limit(machine, unit, 120)
    rapid = motion == 0.0
    asked = limit if rapid else (feed * length if machine.modal.inverse_time else feed) / 60.0
    share = machine.rapid_percent if rapid else machine.feed_percent
    speed = min(limit, asked * share / 100.0)
    steps = max(abs(u) * speed * machine.settings[100 + i] for i, u in enumerate(unit))
    if steps > 1.01 * machine.config.max_step_hz:
        machine.alarm(171)
        return
    trip = _switch(machine, start, unit, length) if machine.settings.get(21) else None
    machine.motion.add(
        Segment(
            start, unit, length, speed, accel, 0.0 if rapid else asked, machine.modal.s,
            machine.modal.spindle, rapid, trip, limit,
        ),
        machine.now,
    )  # fmt: skip
    machine.light()


def _axis_limit(machine: GrblMachine, unit: tuple[float, ...], base: int) -> float:
    return min(machine.settings[base + i] / abs(u) for i, u in enumerate(unit) if abs(u) > 1e-12)


def _outside(machine: GrblMachine, goal: list[float]) -> bool:
    return any(
        not low - 1e-6 <= value <= high + 1e-6
        for value, (low, high) in zip(goal, _travels(machine), strict=True)
    )


def _switch(
    machine: GrblMachine, start: tuple[float, ...], unit: tuple[float, ...], length: float
) -> float | None:
    """Distance at which a move closes a limit switch at the end of an axis, or None."""
    hits = []
    for place, shift, step, (low, high) in zip(start, machine.shift, unit, _travels(machine), strict=True):
        really = place + shift
        if step > 0.0 and really + step * length > high + 1e-6:
            hits.append((high - really) / step)
        elif step < 0.0 and really + step * length < low - 1e-6:
            hits.append((low - really) / step)
    return max(min(hits), 0.0) if hits else None


def _travels(machine: GrblMachine) -> list[tuple[float, float]]:
    """Travel of every axis in machine coordinates; an axis without one has no ends."""
    spans = []
    for i in range(len(machine.config.axes)):
        travel = machine.settings.get(130 + i, 0.0)
        if travel <= 0.0:
            spans.append((-math.inf, math.inf))
        else:
            spans.append((-travel, 0.0) if machine.config.g54[i] < 0.0 else (0.0, travel))
    return spans
