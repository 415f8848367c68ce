"""When each pass may begin: its crease is cold enough in the field of the whole net, not on its own only."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.errors import HeatingError
from twin.net_heat import NetHeat
from twin.process_table import MAX_PASSES, Chain

__all__ = ["PassClock", "TimedPasses"]

POWER_TOLERANCE = 2e-3
"""The heat of the passes is reckoned with a power that is true within this share."""

_TRIALS = 6
_START_DIGITS = 2


@dataclass(frozen=True)
class TimedPasses:
    """The passes of one turn, with the times at which they begin.

    Attributes:
        power_w: laser power, lowered so that whole passes end at the wanted angle.
        increments_rad: angle of each pass, without sign.
        waits_s: dark time after each pass but the last, which has 0.
        start_c: mean temperature of the crease when each pass begins.
        lead_s: time that had to be waited before the first pass.
        short: the angle was too small for one pass with reserve over first yield.
    """

    power_w: float
    increments_rad: tuple[float, ...]
    waits_s: tuple[float, ...]
    start_c: tuple[float, ...]
    lead_s: float = 0.0
    short: bool = False


class PassClock:
    """Burns passes in a net's field as early as its creases are cold enough.

    Args:
        heat: the field; it is marched on, never copied back.
        absorptivity: absorbed share of the light.

    Attributes:
        heat: the field as it is now.
    """

    def __init__(self, heat: NetHeat, absorptivity: float) -> None:
        self.heat, self.absorptivity = heat, absorptivity

    def idle(self, seconds: float) -> None:
        """Let time pass: a rotation, a cut, the way to the next crease."""
        self.heat.wait_until(self.heat.now_s + seconds)

    def fold(
        self, chain: Chain, crease: int, angle_rad: float, stroke_s: float, done: int = 0
    ) -> TimedPasses:
        """Turn a crease by an angle (without sign), in whole passes of equal power.

        A pass on warm metal bends less, so power and number of passes follow from the start temperatures, and
        these from power and number: both are found by trying.

        Args:
            chain: the setting.
            crease: net edge.
            angle_rad: wanted change of the fold angle.
            stroke_s: duration of one pass with its run-in and run-out.
            done: passes that the crease has seen.

        Raises:
            HeatingError: if more than ``MAX_PASSES`` would be needed, or the crease cannot cool.
        """
        if angle_rad <= 0.0:
            return TimedPasses(chain.power_w, (), (), ())
        guess = chain.schedule(angle_rad, stroke_s, done)
        count, power = len(guess.increments_rad), guess.power_w
        for trial in range(_TRIALS):
            heat = self.heat.copy()
            lead, start, waits = self._burn(heat, chain, crease, power, count, stroke_s)
            law = chain.factors(start, done)
            wanted = angle_rad / float(law.sum())
            if wanted > chain.first_rad * (1.0 + 1e-9):
                count += max(1, math.ceil((wanted / chain.first_rad - 1.0) * count * 0.98))
                if count > MAX_PASSES:
                    raise HeatingError(
                        f"{math.degrees(angle_rad):.1f} degrees on crease {crease} need more than "
                        f"{MAX_PASSES} passes: choose another material, thickness or rig"
                    )
                power = chain.power_w
                continue
            needed = chain.power_for(wanted)
            short = needed < 2.0 * chain.threshold_w
            needed = max(needed, 2.0 * chain.threshold_w)
            known = abs(needed - power) <= POWER_TOLERANCE * power
            power = needed
            if known or trial == _TRIALS - 1:
                break
        else:
            raise HeatingError(
                f"crease {crease}: no number of passes gives {math.degrees(angle_rad):.2f} degrees; fold it "
                "in smaller steps"
            )
        self.heat = heat
        return TimedPasses(
            power,
            tuple((law * chain.first_rad_at(power)).tolist()),
            waits,
            tuple(start.tolist()),
            lead,
            short,
        )

    def line_j_m(self, chain: Chain, power_w: float) -> float:
        """Absorbed energy of a pass per metre of crease."""
        return 1e3 * self.absorptivity * power_w / chain.speed_mm_s

    def _burn(
        self, heat: NetHeat, chain: Chain, crease: int, power: float, count: int, stroke_s: float
    ) -> tuple[float, NDArray[np.float64], tuple[float, ...]]:
        """Time waited before the first pass, start temperatures, and the dark time after each pass."""
        line = self.line_j_m(chain, power)
        where = chain.conditions
        start, waits = np.empty(count), []
        began = heat.now_s
        lead = heat.wait_until_cold(crease, where.allowed_c) - began
        for number in range(count):
            start[number] = round(heat.start_c(crease), _START_DIGITS)
            heat.burn(crease, line)
            heat.wait_until(heat.now_s + stroke_s)
            if number == count - 1:
                waits.append(0.0)
                break
            ended = heat.now_s
            heat.wait_until(ended + where.shortest_wait_s)
            wait = 0.0
            while True:
                heat.wait_until_cold(crease, where.allowed_c)
                if heat.now_s <= ended + wait:
                    break
                wait = round(math.ceil((heat.now_s - ended) * 1e3 - 1e-6) / 1e3, 3)
                heat.wait_until(max(ended + wait, heat.now_s))
                ended = heat.now_s - wait
            waits.append(wait)
        return round(math.ceil(lead * 1e3 - 1e-6) / 1e3, 3), start, tuple(waits)
