"""Status reports of one lit block: where its stroke really was, how strong, how far the sheet was turned."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rigs.grbl import Status
from rigs.job import Block, MachinePoint

__all__ = ["StrokeSamples"]

_FULL_SPEED = 0.97
_AHEAD_S = 0.06
"""The reported power may lead the reported place by so long: Grbl prepares six pieces of 10 ms ahead."""


@dataclass
class StrokeSamples:
    """What the reports of a block say about its stroke.

    Attributes:
        block: the block.
        feed: programmed speed of its lit move, units/min; 0 if not known.
    """

    block: Block
    feed: float
    _offsets: list[NDArray[np.float64]] = field(default_factory=list, init=False)
    _turns: list[float] = field(default_factory=list, init=False)
    _powers: list[float] = field(default_factory=list, init=False)

    def at(self, status: Status, place: Mapping[str, float]) -> tuple[bool, bool]:
        """Whether there must be light at a report, a pass being well under way, and whether at full speed."""
        full = self.feed > 0.0 and status.speed >= _FULL_SPEED * self.feed
        here = _point(place)
        if here is None:
            return False, full
        ahead = 0.05 + _AHEAD_S * status.speed / 60.0
        for a, b in zip(self.block.path, self.block.path[1:], strict=False):
            start, end = np.array(a[:2]), np.array(b[:2])
            length = float(np.linalg.norm(end - start))
            along = float((here - start) @ (end - start)) / length if length > 0.0 else -1.0
            if 0.05 <= along <= length - ahead and self.block.kind == "pass":
                return True, full
        return False, full

    def take(self, status: Status, place: Mapping[str, float], turn_deg: float) -> None:
        """A report while the block is under way."""
        inside, full = self.at(status, place)
        if status.state != "Run" or not inside:
            return
        self._side(place)
        if not math.isnan(turn_deg):
            self._turns.append(turn_deg)
        if full and status.tells_power:
            self._powers.append(status.s)

    def end(self, place: Mapping[str, float], turn_deg: float) -> None:
        """The report after the block: counts where none came before."""
        here = _point(place)
        if not self._offsets and here is not None:
            self._offsets.append(here - np.array(self.block.end[:2]))
        if not self._turns and not math.isnan(turn_deg):
            self._turns.append(turn_deg)

    def path(self) -> tuple[MachinePoint, MachinePoint]:
        """Ends of the stroke as it really was, by the median of the reports."""
        dx, dy = np.median(self._offsets, axis=0).tolist() if self._offsets else (0.0, 0.0)
        (x0, y0, z0), (x1, y1, z1) = self.block.path[0], self.block.path[-1]
        return (x0 + dx, y0 + dy, z0), (x1 + dx, y1 + dy, z1)

    def turn_deg(self) -> float:
        """Angle of the rotary meanwhile."""
        return float(np.median(self._turns)) if self._turns else math.degrees(self.block.rotary_rad)

    def s_word(self) -> float:
        """Power word at full speed; that of the job where no report caught it."""
        return float(np.median(self._powers)) if self._powers else self.block.s_word

    def _side(self, place: Mapping[str, float]) -> None:
        """How far beside the stroke the head is; along it only its end tells."""
        here = _point(place)
        start, end = (np.array(p[:2]) for p in (self.block.path[0], self.block.path[-1]))
        length = float(np.linalg.norm(end - start))
        if here is not None and length > 0.0:
            unit = (end - start) / length
            rel = here - start
            self._offsets.append(rel - (rel @ unit) * unit)


def _point(place: Mapping[str, float]) -> NDArray[np.float64] | None:
    here = np.array([place.get("X", math.nan), place.get("Y", math.nan)])
    return None if np.isnan(here).any() else here
