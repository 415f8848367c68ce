"""The lines of a job walked through once more before the first byte is sent, whoever wrote them.

A job file may say anything about itself. What counts is what its lines do: how long they light, where, how
fast, and that they end dark. This reads the lines, not the blocks' own figures.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from rigs.errors import JobError
from rigs.gate import split_words
from rigs.job import MachinePoint
from rigs.no_go import NoGo
from rigs.rig import Rig

__all__ = ["JobWalk"]

_RAMPS = 1.5
"""Light of a block may last this much longer than its length over its feed, for corners and ramps."""


class JobWalk:
    """Follows the lines of block after block.

    Args:
        rig: the machine that the job is for.
    """

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._no_go = NoGo(rig)
        self._at: dict[str, float] = {}
        self._motion, self._s = 0.0, 0.0

    def block(self, lines: Sequence[str], beam_s: float) -> None:
        """Walk through a block.

        Args:
            lines: of the block.
            beam_s: seconds of light that the block says it has.

        Raises:
            JobError: if a lit line has no feed in its block, lights for longer than the block says or the rig
                allows, moves an axis too fast, or crosses a clamp.
        """
        light, feed, lit_s = False, 0.0, 0.0
        for line in lines:
            words = split_words(line) or []
            before = dict(self._at)
            for letter, value in words:
                if letter == "G" and value in (0.0, 1.0):
                    self._motion = value
                elif letter == "G" and value not in _HARMLESS:
                    raise JobError(f"'{line}' is no line of a job: G{value:g}")
                elif letter == "M":
                    light = light or value in (3.0, 4.0)
                    light = light and value not in (2.0, 5.0, 30.0)
                elif letter == "F":
                    feed = value / 60.0
                elif letter == "S":
                    self._s = value
                elif letter in "XYZABC":
                    self._at[letter] = value
            if light and self._s > 0.0 and self._motion == 1.0 and self._at != before:
                lit_s += self._lit(line, before, feed)
        limit = min(self._rig.laser.max_beam_s, _RAMPS * beam_s + 0.1)
        if lit_s > limit + 1e-6:
            raise JobError(
                f"its lines light for {lit_s:.2f} s, it says {beam_s:.2f} s and {self._rig.name} allows "
                f"{self._rig.laser.max_beam_s:g} s: make the job anew"
            )

    def _lit(self, line: str, before: dict[str, float], feed: float) -> float:
        """Seconds of light of a line at its feed."""
        if not feed > 0.0:
            raise JobError(f"'{line}' is lit and its block has no feed")
        if any(word not in before for word in "XY"):
            raise JobError(f"'{line}' is lit before the job has said where the head is")
        a, b = self._point(before), self._point(self._at)
        length = math.dist(a, b)
        for name, p, q, most in zip("XYZ", a, b, self._rig.axes.max_mm_s, strict=True):
            if length > 0.0 and abs(q - p) / length * feed > most * 1.01 + 1e-6:
                raise JobError(f"'{line}' moves {name} faster than {most:g} mm/s with the light on")
        units = self._rig.rotary.units_per_deg * self._rig.rotary.sign
        turned = math.radians(self._at.get(self._rig.rotary.word, 0.0) / units)
        if (clamp := self._no_go.hit(a, b, turned)) is not None:
            raise JobError(f"'{line}' lights clamp {clamp} of the sheet (sheet.clamp_polygons_mm)")
        return length / feed

    def _point(self, at: dict[str, float]) -> MachinePoint:
        height = at.get("Z", 0.0) if self._rig.has_focus_axis else self._rig.rotary.axis_point_mm[2]
        return at["X"], at["Y"], height


_HARMLESS = frozenset((4.0, 17.0, 21.0, 40.0, 49.0, 54.0, 80.0, 90.0, 94.0))
