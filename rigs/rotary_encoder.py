"""An encoder on the rotary: says whether it really turned as far as the controller believes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from rigs.errors import MachineError
from rigs.grbl import Status
from rigs.replay_blocks import ReplayBlock
from rigs.rig import Rig

__all__ = ["RotaryEncoder"]


class RotaryEncoder:
    """A ``rigs.watch.Watch`` that reads the encoder after every turn, before any further light.

    Args:
        rig: the machine.
        read: angle of the rotary in degrees; whole turns do not matter.
        limit_deg: what it may differ.
    """

    def __init__(self, rig: Rig, read: Callable[[], float], limit_deg: float = 0.5) -> None:
        self.rig, self.read, self.limit_deg = rig, read, limit_deg
        self.turns = 0
        self.off_deg = 0.0

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        """Nothing to do."""

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        """Nothing to do."""

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        """Compare after a turn.

        Raises:
            MachineError: if encoder and controller differ.
        """
        del t
        word = self.rig.rotary.word
        if block.kind != "rotate" or word not in place:
            return
        wanted = place[word] / (self.rig.rotary.units_per_deg * self.rig.rotary.sign)
        found = self.read()
        off = abs(math.remainder(found - wanted, 360.0))
        self.turns += 1
        self.off_deg = max(self.off_deg, off)
        if off > self.limit_deg:
            raise MachineError(
                f"the encoder has the rotary at {math.remainder(found, 360.0):.2f}°, the controller at "
                f"{math.remainder(wanted, 360.0):.2f}°: steps were lost, or the sheet slipped; no light was "
                "sent after the turn. Home it before anything else"
            )
