"""What a chain of passes asks of a heating model, and the answer of the closed form."""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from twin.heating import PassTable, soft_threshold, start_factor

__all__ = ["FastLaw", "HeatingModel", "PassLaw"]

HeatingModel = Literal["fast", "section"]
"""Where angles of passes come from: the closed form, or tables of the layered section."""


class PassLaw(Protocol):
    """What a heating model says of the passes of one setting."""

    @property
    def first_rad(self) -> float:
        """Angle of a first pass on cold metal, rad."""

    def factors(self, start_c: NDArray[np.float64], done: int = 0) -> NDArray[np.float64]:
        """(N,) angles of passes over that of the first one on cold metal, after ``done`` passes.

        Args:
            start_c: (N,) mean temperature of the crease when each begins.
            done: passes that the crease has seen.
        """

    def first_rad_at(self, power_w: float) -> float:
        """Angle of a first pass on cold metal at another power, rad."""

    def flags_after(self, passes: int) -> tuple[str, ...]:
        """What is doubtful when a crease gets so many passes, in words."""


class FastLaw:
    """The closed form; satisfies ``PassLaw``.

    Args:
        table: one row, the setting.
        fall_off: exponent of the pass law.
    """

    def __init__(self, table: PassTable, fall_off: float) -> None:
        self.first_rad = float(table.angle_rad)
        self._power_w, self._threshold_w = float(table.power_w), float(table.threshold_w)
        self._half_passes, self._fall_off = float(table.half_passes), fall_off

    def factors(self, start_c: NDArray[np.float64], done: int = 0) -> NDArray[np.float64]:
        """(N,) angles of passes over that of the first one on cold metal, after ``done`` passes."""
        hardening = (1.0 + np.arange(done, done + len(start_c)) / self._half_passes) ** -self._fall_off
        shares: NDArray[np.float64] = hardening * start_factor(start_c)
        return shares

    def first_rad_at(self, power_w: float) -> float:
        """Angle of a first pass on cold metal at another power, rad."""
        share = power_w / self._power_w
        soft = soft_threshold(power_w / self._threshold_w)
        soft /= soft_threshold(self._power_w / self._threshold_w)
        return self.first_rad * share * float(soft)

    def flags_after(self, passes: int) -> tuple[str, ...]:
        """Nothing: the flags of the setting itself say it all."""
        del passes
        return ()
