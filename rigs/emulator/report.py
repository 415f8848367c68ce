"""The status report of the emulated machine, the answer to ``?``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rigs.emulator.beam import level_now

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["status_report"]

_SPINDLE = {3: "S", 4: "C"}
_COOLANT = {7: "M", 8: "F"}


def status_report(machine: GrblMachine) -> str:
    """State, position, feed and power, now and then work offset and overrides, the open lid."""
    position, speed = machine.motion.state(machine.now)
    names_power = machine.config.names_power and machine.modal.spindle != 5
    power = machine.power(machine.modal.s) if names_power else level_now(machine)
    fields = [_state(machine), "MPos:" + ",".join(f"{v:.3f}" for v in position)]
    fields.append(f"FS:{speed * 60.0:.0f},{power:.0f}")
    if machine.door_open:
        fields.append("Pn:D")
    accessory = _SPINDLE.get(machine.modal.spindle, "") + _COOLANT.get(machine.modal.coolant, "")
    if machine.reports % 10 == 0:
        fields.append("WCO:" + ",".join(f"{v:.3f}" for v in machine.wco))
    elif machine.reports % 10 == 1:
        fields.append(
            f"Ov:{machine.feed_percent:.0f},{machine.rapid_percent:.0f},{machine.power_percent:.0f}"
        )
    if accessory and (machine.reports % 10 == 1 or names_power):
        fields.append("A:" + accessory)
    machine.reports += 1
    return "<" + "|".join(fields) + ">"


def _state(machine: GrblMachine) -> str:
    state = machine.state
    if state == "Idle":
        if machine.check:
            return "Check"
        waits = machine.wait is not None and machine.wake is not None
        return "Run" if machine.motion.moving or waits else "Idle"
    if state == "Hold":
        return "Hold:1" if machine.motion.moving else "Hold:0"
    if state == "Door":
        if machine.restored is not None:
            return "Door:4" if machine.config.names_power else "Door:3"
        return "Door:2" if machine.motion.moving else "Door:1" if machine.door_open else "Door:0"
    return state
