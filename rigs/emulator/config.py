"""What machine the emulator pretends to be: settings, axes, buffers and start state."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from rigs.errors import ProfileError
from rigs.rig import Rig

__all__ = ["MachineConfig", "config_for"]


_GRBLHAL_RESTORE_S = 4.0
"""grblHAL's default for the time that a spindle gets after the door (setting 392)."""

_VERSIONS = {
    "grbl1.1": "1.1h.20190830",
    "grbl-mega-5x": "1.1q.20230611",
    "grblhal": "1.1f.20240222",
    "fluidnc": "3.7 FluidNC v3.7.8",
}
"""What ``$I`` says of the firmware."""


@dataclass(frozen=True)
class MachineConfig:
    """A GRBL machine.

    Attributes:
        axes: axis words in the order of status reports.
        settings: the ``$`` settings by number.
        rx_bytes: receive buffer; bytes beyond it are lost, as on the real board.
        planner_blocks: moves that the planner holds.
        line_chars: longest line.
        g54: work offset G54 per axis.
        resets_on_open: a new connection resets the board.
        version: what ``$I`` says before the mark.
        banner: what it says after a reset.
        names_power: reports the S word in ``Idle`` too, and the spindle in ``A:`` (grblHAL).
        door_restore_s: from ``~`` behind a closed lid until it moves and lights again.
        max_step_hz: fastest step rate that the processor survives.
    """

    axes: tuple[str, ...] = ("X", "Y", "Z")
    settings: tuple[tuple[int, float], ...] = ()
    rx_bytes: int = 128
    planner_blocks: int = 15
    line_chars: int = 79
    g54: tuple[float, ...] = (0.0, 0.0, 0.0)
    resets_on_open: bool = True
    version: str = "1.1h.20190830"
    banner: str = "Grbl 1.1h ['$' for help]"
    names_power: bool = False
    door_restore_s: float = 0.0
    max_step_hz: float = 30000.0

    def with_settings(self, changes: dict[int, float]) -> MachineConfig:
        """A copy with some settings replaced."""
        return dataclasses.replace(self, settings=tuple(sorted((dict(self.settings) | changes).items())))


def config_for(rig: Rig) -> MachineConfig:
    """The machine that ``rig`` describes, with the settings that it expects.

    Settings that the profile does not name follow from its axes and rotary, else are Grbl's defaults.
    """
    axes = rig.axes
    speed = [60.0 * v for v in axes.max_mm_s]
    accel = list(axes.accel_mm_s2)
    steps = list(axes.steps_per_mm)
    travel = [high - low for low, high in (axes.x_mm, axes.y_mm, axes.z_mm)]
    rotary = rig.rotary
    turn = (
        rotary.steps_per_deg / rotary.units_per_deg,
        60.0 * rotary.max_deg_s * rotary.units_per_deg,
        rotary.accel_deg_s2 * rotary.units_per_deg,
    )
    if rotary.kind == "swap":
        steps[2], speed[2], accel[2], travel[2] = *turn, 0.0
    else:
        steps, speed, accel, travel = [*steps, turn[0]], [*speed, turn[1]], [*accel, turn[2]], [*travel, 0.0]
    settings = {
        0: 10.0, 1: 25.0, 2: 0.0, 3: 0.0, 4: 0.0, 5: 0.0, 6: 0.0, 10: 1.0, 11: 0.01, 12: 0.002, 13: 0.0,
        20: 0.0, 21: 0.0, 22: float(rig.controller.homing == "required"), 23: 0.0, 24: 25.0, 25: 1500.0,
        26: 250.0, 27: 1.0, 30: 1000.0, 31: 0.0, 32: 1.0,
    }  # fmt: skip
    for i in range(len(rig.axis_words)):
        settings |= {100 + i: steps[i], 110 + i: speed[i], 120 + i: accel[i], 130 + i: travel[i]}
    settings |= {int(key[1:]): value for key, value in rig.controller.expect.items()}
    dialect = rig.controller.dialect
    if dialect == "marlin":
        raise ProfileError(f"{rig.name}: the emulated machine speaks GRBL, not Marlin")
    hal = dialect == "grblhal"
    version = _VERSIONS[dialect]
    name = version.partition(".")[0] + "." + version.partition(".")[2][:2]
    banner = {
        "grblhal": f"GrblHAL {name} ['$' or '$HELP' for help]",
        "fluidnc": "Grbl 3.7 [FluidNC v3.7.8 (wifi) '$' for help]",
    }.get(dialect, f"Grbl {name} ['$' for help]")
    return MachineConfig(
        axes=rig.axis_words,
        settings=tuple(sorted(settings.items())),
        rx_bytes=rig.controller.rx_bytes,
        planner_blocks={"grbl1.1": 15, "fluidnc": 16}.get(dialect, 100 if hal else 35),
        line_chars=rig.controller.line_chars,
        g54=rig.controller.g54_mm or (0.0,) * len(rig.axis_words),
        resets_on_open=rig.controller.resets_on_open,
        version=version,
        banner=banner,
        names_power=hal,
        door_restore_s=_GRBLHAL_RESTORE_S if hal else 0.0,
        max_step_hz=axes.max_step_hz,
    )
