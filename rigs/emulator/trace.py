"""What the emulated machine really did: moves, light and received lines, as JSON lines."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, TextIO

from rigs.emulator.motion import Segment

__all__ = ["Trace"]


class Trace:
    """Writes one JSON object a line: ``move``, ``rest`` (light at standstill) and ``line`` records.

    ``move``: start and end time, from, to, speeds at start, top and end, S, and how the light behaves.
    ``rest``: S changes at standstill; only a dangerous state shows S > 0 there.

    Attributes:
        s_now: S of the light at standstill.
        beam_s: seconds with light so far; ``rest_beam_s`` those at standstill.
    """

    def __init__(self, file: TextIO | None = None) -> None:
        self.file = file
        self.s_now = 0.0
        self.since = 0.0
        self.beam_s = 0.0
        self.rest_beam_s = 0.0

    def write(self, record: dict[str, Any]) -> None:
        """Append a record."""
        if self.file is not None:
            self.file.write(json.dumps(record, separators=(",", ":")) + "\n")

    def move(
        self, start: float, end: float, segment: Segment, beam: str, s: float, shift: Sequence[float]
    ) -> None:
        """Record a finished move.

        Args:
            start: time, s.
            end: time, s.
            segment: what the controller made.
            beam: ``off``, ``scaled`` with speed or ``full``.
            s: power word that counts, override and clipping included.
            shift: where the axes really are, less where the controller has them.
        """
        if beam != "off":
            self.beam_s += end - start
        if self.file is None:
            return
        self.write({
            "kind": "move", "t0": round(start, 6), "t1": round(end, 6),
            "from": [round(v + d, 5) for v, d in zip(segment.start, shift, strict=True)],
            "to": [round(v + d, 5) for v, d in zip(segment.point(segment.length), shift, strict=True)],
            "v": [round(segment.v_in, 5), round(segment.v_top, 5), round(segment.v_out, 5)],
            "feed": round(segment.programmed, 5), "rapid": segment.rapid,
            "s": s if beam != "off" else 0.0, "beam": beam,
        })  # fmt: skip

    def rest(self, now: float, s: float) -> None:
        """Note the light at standstill."""
        if s == self.s_now:
            return
        if self.s_now > 0.0:
            self.beam_s += now - self.since
            self.rest_beam_s += now - self.since
        self.write({"kind": "rest", "t": round(now, 6), "s": s})
        self.s_now, self.since = s, now

    def line(self, now: float, text: str) -> None:
        """Record a received line."""
        if self.file is not None:
            self.write({"kind": "line", "t": round(now, 6), "text": text})

    def close(self) -> None:
        """Flush and close the file."""
        if self.file is not None:
            self.file.close()
