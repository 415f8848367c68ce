"""Blocks of a job one after another, in the coordinates of a rig, each checked before it is made."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planner.fold_plan import Point
from rigs.beam_path import Stroke, machine_path, plan_strokes
from rigs.errors import JobError
from rigs.gcode import SYNC_S
from rigs.job import Block, BlockKind, GcodeStyle, MachinePoint
from rigs.job_checks import RigChecks
from rigs.motion_time import line_seconds, polyline_seconds
from rigs.rig import Rig

__all__ = ["BlockWriter", "gcode_style"]

BLOCK_RESERVE_BYTES = 8
"""Room left in the receive buffer for realtime bytes and a line in work."""

LINE_CHARS = 78

DIGITS = 3
"""Decimals of coordinates, mm."""


def gcode_style(rig: Rig) -> GcodeStyle:
    """How G-code for ``rig`` is written."""
    units = rig.rotary.sign * rig.rotary.units_per_deg * math.degrees(1.0)
    room = rig.controller.rx_bytes - BLOCK_RESERVE_BYTES
    if rig.controller.dialect == "marlin":
        room //= 2  # line numbers, checksums and repeated motion words
    return GcodeStyle(
        rotary_word=rig.rotary.word,
        rotary_units_per_rad=units,
        has_focus_axis=rig.has_focus_axis,
        line_chars=min(LINE_CHARS, rig.controller.line_chars - 1),
        block_bytes=room,
    )


class BlockWriter:
    """Appends blocks; knows where the head stands and how the sheet is turned.

    Args:
        rig: the machine.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.style = gcode_style(rig)
        self.checks = RigChecks(rig)
        self.blocks: list[Block] = []
        self.notices: list[str] = []
        self.place: MachinePoint = rig.rotary.axis_point_mm
        self.rotary = 0.0
        self.goto(-1, self.place, first=True)
        self.rotate(-1, 0.0)

    def goto(self, step: int, place: MachinePoint, *, first: bool = False) -> None:
        """Move the head with the beam off; nothing if it is there."""
        if place == self.place and not first:
            return
        self.checks.inside(place, step)
        length = math.dist(self.place, place)
        seconds = SYNC_S
        if length > 0.0:
            speed, accel = self.checks.rapid(self.place, place)
            seconds += line_seconds(length, speed, accel)
        self.blocks.append(Block("goto", step, self.place, (), place, self.rotary, seconds=seconds))
        self.place = place

    def rotate(self, step: int, to_rad: float) -> None:
        """Turn the sheet about the rotary axis with the beam off, then let it settle."""
        self.checks.rotary(to_rad, step)
        to_rad = round(math.degrees(to_rad), DIGITS) * math.pi / 180.0
        rotary = self.rig.rotary
        turn = math.degrees(abs(to_rad - self.rotary))
        wait = max(rotary.settle_s, SYNC_S)
        seconds = line_seconds(turn, rotary.max_deg_s, rotary.accel_deg_s2) + wait
        self.rotary = to_rad
        self.blocks.append(
            Block("rotate", step, self.place, (), self.place, to_rad, wait_s=wait, seconds=seconds)
        )

    def dark(self, step: int, kind: BlockKind, seconds: float, text: str = "") -> None:
        """Let the part cool, or ask a person."""
        if not (math.isfinite(seconds) and seconds >= 0.0):
            raise JobError(f"step {step}: a wait of {seconds} s: expected a finite time of 0 or more")
        wait = max(seconds, SYNC_S)
        self.blocks.append(
            Block(
                kind,
                step,
                self.place,
                (),
                self.place,
                self.rotary,
                wait_s=wait,
                seconds=wait,
                text=text,
            )
        )

    def passes(
        self,
        number: int,
        crease: int,
        ends: tuple[Point, Point],
        power_w: float,
        speed_mm_s: float,
        waits_s: Sequence[float],
        where: str,
    ) -> None:
        """Passes along a line of the sheet, to and fro, one for each of ``waits_s``.

        Args:
            number: plan step.
            crease: net edge.
            ends: of the line, sheet coordinates, mm.
            power_w: laser power.
            speed_mm_s: along the line.
            waits_s: dark time after each pass.
            where: for messages.

        Raises:
            JobError: if the rig cannot do it.
        """
        a, b = ends
        self.checks.finite(where, *a, *b, power_w, speed_mm_s, *waits_s)
        strokes = plan_strokes(self.rig, a, b, self.rotary, speed_mm_s, digits=DIGITS)
        power, s_word = self.checks.power(power_w, where)
        for stroke in strokes:
            self._check_stroke(stroke, where)
            self.checks.clear_of_clamps(stroke.start, stroke.end, self.rotary, where)
        if math.dist(self.place, strokes[0].run_in) > math.dist(self.place, strokes[-1].run_out):
            strokes = _reversed(strokes)
        back = _reversed(strokes)
        for index, wait in enumerate(waits_s):
            way = strokes if index % 2 == 0 else back
            for stroke in way:
                self.goto(number, stroke.run_in)
                pause = round(max(wait, SYNC_S), DIGITS) if stroke is way[-1] else SYNC_S
                self.blocks.append(
                    Block(
                        "pass", number, stroke.run_in, (stroke.start, stroke.end), stroke.run_out,
                        self.rotary, crease=crease, power_w=power, s_word=s_word,
                        speed_mm_s=_feed(stroke.head_mm_s), wait_s=pause, beam_s=round(stroke.beam_s, 6),
                        seconds=round(stroke.seconds + pause, 6),
                    )
                )  # fmt: skip
                self.place = stroke.run_out

    def cuts(
        self,
        number: int,
        path: Sequence[Point],
        power_w: float,
        speed_mm_s: float,
        passes: int,
        where: str,
        why: str,
    ) -> None:
        """Cut along a polyline of the sheet, in pieces of bounded beam time that fit the receive buffer.

        Raises:
            JobError: if the rig cannot do it.
        """
        self.checks.finite(where, *(c for point in path for c in point), power_w, speed_mm_s)
        points = [_rounded(p) for p in machine_path(self.rig, tuple(path), self.rotary)]
        points = [p for i, p in enumerate(points) if i == 0 or p != points[i - 1]]
        if len(points) < 2:
            return
        for turn in range(passes):
            way = points if turn % 2 == 0 else points[::-1]
            self._cut_path(number, way, power_w, speed_mm_s, where, why)

    def finish(self, text: str = "take the part and the pieces out") -> None:
        """Turn the sheet flat, move over the axis and hand the part to a person."""
        if self.rotary != 0.0:
            self.rotate(-1, 0.0)
        self.goto(-1, self.rig.rotary.axis_point_mm)
        self.dark(-1, "ask", SYNC_S, text)

    def _cut_path(
        self,
        number: int,
        points: list[MachinePoint],
        power_w: float,
        speed_mm_s: float,
        where: str,
        why: str,
    ) -> None:
        power, s_word = self.checks.power(power_w, where)
        # A cut may be slower than asked, where the focus axis cannot keep up with a tilted sheet.
        rapid = min(self.checks.rapid(a, b)[0] for a, b in itertools.pairwise(points))
        speed = _feed(min(speed_mm_s, rapid))
        accel = np.array(self.rig.axes.accel_mm_s2)
        self.goto(number, points[0])
        for piece in self._pieces(points, speed):
            for a, b in itertools.pairwise(piece):
                self.checks.inside(b, number)
                self.checks.move(a, b, speed, where)
                self.checks.clear_of_clamps(a, b, self.rotary, where)
            seconds = round(polyline_seconds(np.array(piece), speed, accel), 6)
            self.blocks.append(
                Block(
                    "cut", number, piece[0], tuple(piece), piece[-1], self.rotary, power_w=power,
                    s_word=s_word,
                    speed_mm_s=speed, wait_s=SYNC_S, beam_s=seconds, seconds=seconds + SYNC_S, text=why,
                )
            )  # fmt: skip
            self.place = piece[-1]
            why = ""

    def _pieces(self, points: list[MachinePoint], speed: float) -> list[list[MachinePoint]]:
        """Split a polyline so that each piece stays within beam time and receive buffer."""
        accel = np.array(self.rig.axes.accel_mm_s2)
        longest = 0.8 * (self.rig.laser.max_beam_s - 2.0 * speed / float(accel[:2].min())) * speed
        if longest <= 0.0:
            raise JobError(
                f"rig {self.rig.name}: {self.rig.laser.max_beam_s:g} s of beam in flight are too short to "
                f"reach {speed:g} mm/s: raise laser.max_beam_s"
            )
        most = max((self.style.block_bytes - 45) // 27, 1)  # bytes of M4, F, S, M5, sync; of a longest point
        dense: list[MachinePoint] = [points[0]]
        for a, b in itertools.pairwise(points):
            parts = max(1, math.ceil(math.dist(a, b) / longest))
            dense += [
                _rounded(tuple(p + (q - p) * k / parts for p, q in zip(a, b, strict=True)))
                for k in range(1, parts + 1)
            ]
        pieces, piece, length = [], [dense[0]], 0.0
        for point in dense[1:]:
            step = math.dist(piece[-1], point)
            trial = np.array([*piece, point])
            full = len(piece) > most or length + step > longest
            if len(piece) > 1 and (full or polyline_seconds(trial, speed, accel) > self.rig.laser.max_beam_s):
                pieces.append(piece)
                piece, length = [piece[-1]], 0.0
            piece.append(point)
            length += step
        pieces.append(piece)
        return pieces

    def _check_stroke(self, stroke: Stroke, where: str) -> None:
        for point in (stroke.run_in, stroke.start, stroke.end, stroke.run_out):
            self.checks.inside(point, where)
        self.checks.move(stroke.start, stroke.end, stroke.head_mm_s, where)
        if stroke.beam_s > self.rig.laser.max_beam_s:
            raise JobError(
                f"{where}: one pass lights the beam for {stroke.beam_s:.2f} s, rig {self.rig.name} allows "
                f"{self.rig.laser.max_beam_s:g} s in flight: fold faster or shorten the crease"
            )


def _rounded(point: tuple[float, ...]) -> MachinePoint:
    x, y, z = (round(c, DIGITS) + 0.0 for c in point)
    return x, y, z


def _reversed(strokes: tuple[Stroke, ...]) -> tuple[Stroke, ...]:
    """The same strokes from the other end."""
    return tuple(
        replace(s, run_in=s.run_out, start=s.end, end=s.start, run_out=s.run_in) for s in reversed(strokes)
    )


def _feed(speed_mm_s: float) -> float:
    """Speed as the F word will carry it: tenths of mm/min."""
    return round(60.0 * speed_mm_s, 1) / 60.0
