"""Light of the emulated laser: how it follows a move, its level at an instant, and the PWM register."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rigs.emulator.motion import Segment

if TYPE_CHECKING:
    from rigs.emulator.machine import GrblMachine

__all__ = ["beam_share", "level_now", "pwm_value", "rest_level"]


def beam_share(segment: Segment, *, laser_mode: bool) -> str:
    """How the light behaves in a move: ``off``, ``scaled`` with speed, or ``full``."""
    if segment.mode == 5 or segment.s <= 0.0:
        return "off"
    if not laser_mode:
        return "full"
    if segment.rapid:
        return "off"
    return "scaled" if segment.mode == 4 else "full"


def rest_level(machine: GrblMachine) -> float:
    """S of the light at standstill, by the rules that make M3 and ``$32=0`` dangerous."""
    laser = bool(machine.settings.get(32))
    on = machine.modal.spindle == 3 or (machine.modal.spindle == 4 and not laser)
    if not on or machine.state != "Idle" or machine.motion.moving:
        return 0.0
    return machine.power(machine.modal.s)


def level_now(machine: GrblMachine) -> float:
    """S of the light at this instant, in a move or at standstill."""
    if not machine.motion.moving:
        return machine.trace.s_now
    segment = machine.motion.queue[0]
    share = beam_share(segment, laser_mode=bool(machine.settings.get(32)))
    if share == "off":
        return 0.0
    level = machine.power(segment.s)
    if share == "full":
        return level
    scaled = level * machine.motion.state(machine.now)[1] / segment.programmed
    return min(scaled, machine.settings.get(30, 1000.0))  # clipped at full scale, as a feed override shows


def pwm_value(s: float, s_max: float = 1000.0, s_min: float = 0.0) -> int:
    """Register of the laser PWM, 0 to 255, at power word ``s``.

    Source: Grbl 1.1h, ``spindle_compute_pwm_value``; S500 of 1000 gives 128, as measured.
    """
    if s <= 0.0:
        return 0
    if s_max <= s_min or s >= s_max:
        return 255
    return 1 if s <= s_min else math.floor((s - s_min) * 254.0 / (s_max - s_min) + 1e-6) + 1
