"""What a rig can do, asked before a block is made: travel, speed, step rate, power, rotary range."""

from __future__ import annotations

import math

from rigs.errors import JobError
from rigs.job import MachinePoint
from rigs.no_go import NoGo
from rigs.rig import Rig

__all__ = ["RigChecks"]

_AXES = "xyz"


class RigChecks:
    """Checks of single figures against one rig; each raises ``JobError`` naming step or crease.

    Args:
        rig: the machine.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._no_go = NoGo(rig)

    def clear_of_clamps(self, a: MachinePoint, b: MachinePoint, rotary_rad: float, where: str) -> None:
        """Refuse light over a clamp of the sheet."""
        if (clamp := self._no_go.hit(a, b, rotary_rad)) is not None:
            raise JobError(
                f"{where}: light from ({a[0]:.1f}, {a[1]:.1f}) to ({b[0]:.1f}, {b[1]:.1f}) mm would fall on "
                f"clamp {clamp} of the sheet (sheet.clamp_polygons_mm): move the part or the clamp"
            )

    def finite(self, where: str, *values: float) -> None:
        """Refuse NaN and infinities."""
        for value in values:
            if not math.isfinite(value):
                raise JobError(f"{where}: {value} is not a finite figure: make plan and process anew")

    def inside(self, point: MachinePoint, where: str | int) -> None:
        """Refuse a point outside the travel of the axes."""
        spans = (self.rig.axes.x_mm, self.rig.axes.y_mm, self.rig.axes.z_mm)
        for name, value, (low, high) in zip(_AXES, point, spans, strict=True):
            if not low - 1e-9 <= value <= high + 1e-9:
                place = where if isinstance(where, str) else f"step {where}"
                raise JobError(
                    f"{place}: {name} = {value:.3f} mm is outside the travel {low:g} to {high:g} mm of rig "
                    f"{self.rig.name}: make the part smaller or tilt it less"
                )

    def move(self, a: MachinePoint, b: MachinePoint, speed_mm_s: float, where: str) -> None:
        """Refuse a move that is too fast for an axis or for the controller's step rate."""
        axes = self.rig.axes
        length = math.dist(a, b)
        if length <= 0.0:
            return
        if not (math.isfinite(speed_mm_s) and speed_mm_s > 0.0):
            raise JobError(f"{where}: a speed of {speed_mm_s} mm/s: expected a finite speed above 0")
        for i, name in enumerate(_AXES):
            share = abs(b[i] - a[i]) / length
            if share * speed_mm_s > axes.max_mm_s[i] * 1.002 + 1e-6:
                raise JobError(
                    f"{where}: {name} would move at {share * speed_mm_s:.4g} mm/s, rig {self.rig.name} "
                    f"allows {axes.max_mm_s[i]:g}: choose a slower setting"
                )
            if share * speed_mm_s * axes.steps_per_mm[i] > axes.max_step_hz * 1.002:
                raise JobError(
                    f"{where}: {name} would need {share * speed_mm_s * axes.steps_per_mm[i]:.0f} steps/s, "
                    f"the controller makes {axes.max_step_hz:g}: choose a slower setting"
                )

    def power(self, power_w: float, where: str) -> tuple[float, float]:
        """Power and S word of a beam block, rounded to tenths of S.

        Raises:
            JobError: if the power is not above 0 or over the cap of the rig.
        """
        laser = self.rig.laser
        cap = laser.cap_fraction * laser.max_w
        if not (math.isfinite(power_w) and 0.0 < power_w <= cap * (1.0 + 1e-9)):
            raise JobError(
                f"{where}: {power_w:.4g} W is not within 0 and the cap of {cap:.4g} W of rig "
                f"{self.rig.name}: choose another setting"
            )
        s_word = math.floor(10.0 * laser.s_for_power(min(power_w, cap)) + 0.5) / 10.0
        if laser.power_for_s(s_word) > cap:
            s_word = math.floor(10.0 * laser.s_for_power(cap)) / 10.0
        if s_word <= 0.0:
            raise JobError(
                f"{where}: {power_w:.3g} W is less than the smallest S word of rig {self.rig.name}"
            )
        return round(laser.power_for_s(s_word), 6), s_word

    def rotary(self, angle_rad: float, where: str | int) -> None:
        """Refuse a rotary angle outside its range."""
        rotary = self.rig.rotary
        degrees = math.degrees(angle_rad)
        low, high = rotary.range_deg
        if not math.isfinite(degrees) or not (rotary.endless or low - 1e-6 <= degrees <= high + 1e-6):
            raise JobError(
                f"step {where}: the rotary would turn to {degrees:.3f} degrees, rig {self.rig.name} reaches "
                f"{low:g} to {high:g}: plan with a smaller tilt"
            )

    def rapid(self, a: MachinePoint, b: MachinePoint) -> tuple[float, float]:
        """Speed and acceleration of a dark move from ``a`` to ``b``, which differ."""
        axes = self.rig.axes
        length = math.dist(a, b)
        shares = [abs(q - p) / length for p, q in zip(a, b, strict=True)]
        speed = min(m / s for m, s in zip(axes.max_mm_s, shares, strict=True) if s > 1e-12)
        accel = min(m / s for m, s in zip(axes.accel_mm_s2, shares, strict=True) if s > 1e-12)
        return speed, accel
