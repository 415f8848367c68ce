"""What happens to the emulated machine other than on its wire: the lid, slipping axes, the power knob."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["set_power_override", "slip", "turn_door"]

_POWER_RANGE = 10.0, 200.0


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


def set_power_override(machine: GrblMachine, percent: float) -> None:
    """Somebody turns the laser power up or down, 10 to 200 % of the S word."""
    machine.motion.split(machine.now)
    machine.drain()
    machine.power_percent = min(max(percent, _POWER_RANGE[0]), _POWER_RANGE[1])
    machine.reports = 1  # the next report says it
    machine.light()
