"""The part in the emulated machine: folded by what its beam really burnt, read from the trace as it grows."""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rigs.errors import MachineError
from rigs.rig import Rig
from twin.workpiece import Workpiece

__all__ = ["TracedPart"]


@dataclass
class TracedPart:
    """A workpiece that follows the trace file of the emulated machine.

    The trace tells where the axes really are and how strong the light really is, so slipped axes, a turned
    power knob and light where none should be all show in the part.

    Attributes:
        path: the trace, which the emulator writes line by line.
        rig: the machine.
        part: what is folded.
        rotary_deg: where the rotary really stands.
        beside_j: energy that met no crease, J; cuts are among it.
    """

    path: Path
    rig: Rig
    part: Workpiece
    rotary_deg: float = 0.0
    beside_j: float = 0.0
    _read: int = field(default=0, init=False)

    def update(self) -> Workpiece:
        """Take in what the trace has got since the last time; returns the part.

        Raises:
            MachineError: if the trace cannot be read.
        """
        try:
            with self.path.open("rb") as file:
                file.seek(self._read, os.SEEK_SET)
                data = file.read()
        except OSError as error:
            raise MachineError(f"{self.path}: cannot read the trace: {error.strerror or error}") from error
        whole = data.rfind(b"\n") + 1
        self._read += whole
        for line in data[:whole].splitlines():
            if line.startswith(b'{"kind":"move"'):
                self._move(json.loads(line))
        return self.part

    def _move(self, record: dict[str, Any]) -> None:
        words = self.rig.axis_words
        offset = self.rig.controller.g54_mm or (0.0,) * len(words)
        start, end = (
            {w: float(v) - o for w, v, o in zip(words, record[key], offset, strict=True)}
            for key in ("from", "to")
        )
        word = self.rig.rotary.word
        units = self.rig.rotary.units_per_deg * self.rig.rotary.sign
        self.rotary_deg = end[word] / units
        seconds = float(record["t1"]) - float(record["t0"])
        if record["beam"] == "off" or not record["s"] or seconds <= 0.0:
            return
        height = self.rig.rotary.axis_point_mm[2]
        a, b = ((p["X"], p["Y"], height if word == "Z" else p["Z"]) for p in (start, end))
        length = math.dist(a, b)
        power = self.rig.laser.power_for_s(float(record["s"]))
        # light that scales with speed gives the dose of the programmed speed, constant light that of the time
        speed = float(record["feed"]) if record["beam"] == "scaled" else length / seconds
        turn = math.radians(0.5 * (start[word] + end[word]) / units)
        if length < 1e-9 or speed <= 0.0 or self.part.heat(a, b, turn, power, speed).crease < 0:
            self.beside_j += power * length / speed if speed > 0.0 else power * seconds
