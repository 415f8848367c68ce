"""What happens to the emulated machine other than on its wire: the lid, slipping axes, the power knob."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["OVERRIDES", "set_overrides", "slip", "turn_door", "turn_override"]

_RANGE = 10.0, 200.0

OVERRIDES: dict[int, tuple[str, float, bool]] = {
    0x90: ("feed", 100.0, True), 0x91: ("feed", 10.0, False), 0x92: ("feed", -10.0, False),
    0x93: ("feed", 1.0, False), 0x94: ("feed", -1.0, False),
    0x95: ("rapid", 100.0, True), 0x96: ("rapid", 50.0, True), 0x97: ("rapid", 25.0, True),
    0x99: ("power", 100.0, True), 0x9A: ("power", 10.0, False), 0x9B: ("power", -10.0, False),
    0x9C: ("power", 1.0, False), 0x9D: ("power", -1.0, False),
}  # fmt: skip
"""Realtime bytes: what they turn, percent, and whether they set it or add to it.

Source: Grbl 1.1, "Realtime commands" (doc/markdown/realtime_cmds.md), ``config.h`` for the ranges.
"""


def turn_door(machine: GrblMachine, *, is_open: bool) -> None:
    """The lid opens or closes: an open one holds the machine, a closed one does not start it."""
    machine.door_open = is_open
    if is_open:
        machine.restored = None
        machine.hold("Door")


def slip(machine: GrblMachine, axis: str, by: float) -> None:
    """An axis moves, or loses steps, and the controller does not know.

    Args:
        machine: the machine.
        axis: its word; one that the machine has not is left alone.
        by: mm or degrees, in units of its word.
    """
    if axis in machine.config.axes:
        machine.motion.split(machine.now)
        machine.drain()
        machine.shift[machine.config.axes.index(axis)] += by


def turn_override(machine: GrblMachine, byte: int) -> None:
    """A realtime byte of ``OVERRIDES``."""
    what, percent, sets = OVERRIDES[byte]
    before = {
        "feed": machine.feed_percent, "rapid": machine.rapid_percent, "power": machine.power_percent
    }[what]  # fmt: skip
    set_overrides(machine, **{what: percent if sets else before + percent})


def set_overrides(
    machine: GrblMachine, *, feed: float | None = None, rapid: float | None = None, power: float | None = None
) -> None:
    """Somebody turns feed, rapids or laser power up or down, percent; the next report says it if it changed.

    Feed and power go from 10 to 200 % of their words. Moves under way change their speed at once.
    """
    before = machine.feed_percent, machine.rapid_percent, machine.power_percent
    low, high = _RANGE
    after = (
        before[0] if feed is None else min(max(feed, low), high),
        before[1] if rapid is None else rapid,
        before[2] if power is None else min(max(power, low), high),
    )
    if after == before:
        return
    machine.motion.split(machine.now)
    machine.drain()
    machine.feed_percent, machine.rapid_percent, machine.power_percent = after
    if after[:2] != before[:2]:
        machine.motion.override(machine.now, after[0] / 100.0, after[1] / 100.0)
    machine.reports = 1  # the next report says it
    machine.light()
