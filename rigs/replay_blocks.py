"""What a replay needs of a job, and the dark and framing versions of its blocks."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from rigs.errors import JobError
from rigs.gate import split_words
from rigs.gcode import gcode_program
from rigs.job import Job
from rigs.rig import Rig

__all__ = [
    "SYNC",
    "PlainBlock",
    "ReplayBlock",
    "ReplayJob",
    "dark_block",
    "dark_lines",
    "frame_blocks",
    "light_of",
    "lit_block",
    "mark_blocks",
    "replay_job",
]  # fmt: skip

_MARK_MM = 3.0
"""Half the stroke over a mark."""

SYNC = "G4 P0.01"
"""Answered only when all motion has ended, with or without light (measured on Grbl)."""

_POWER = re.compile(r"S\s*[+-]?[\d.]+")
_LIGHT = re.compile(r"M0*[34](?!\d)")
_DWELL = re.compile(r"G0*4(?!\d)")
_COOLANT = re.compile(r"M0*[78](?!\d)")


class ReplayBlock(Protocol):
    """One unit of a replay: confirmed as a whole before the next one is sent."""

    @property
    def index(self) -> int:
        """Index of the block in the job, -1 for head and tail of the program."""

    @property
    def kind(self) -> str:
        """``goto``, ``rotate``, ``pass``, ``cut``, ``wait``, ``ask``, ``head``, ``tail``, ``pilot``."""

    @property
    def lines(self) -> Sequence[str]:
        """G-code lines, without line ends."""

    @property
    def beam_s(self) -> float:
        """Seconds of light."""

    @property
    def seconds(self) -> float:
        """How long it takes."""

    @property
    def step(self) -> int:
        """Index of the plan step that it belongs to, -1 if none."""

    @property
    def expect(self) -> Sequence[tuple[str, float]]:
        """(axis word, work coordinate) where it ends; axes not named are not checked."""

    @property
    def comments(self) -> Sequence[str]:
        """What is said about it, such as the question of an ``ask`` block."""


@dataclass(frozen=True)
class PlainBlock:
    """A ``ReplayBlock`` as plain data."""

    index: int
    kind: str
    lines: tuple[str, ...]
    beam_s: float = 0.0
    seconds: float = 0.0
    step: int = -1
    expect: tuple[tuple[str, float], ...] = ()
    comments: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReplayJob:
    """What is replayed: the blocks of a G-code program and the hashes that bind it.

    Attributes:
        blocks: in the order of execution.
        sha256: content hash of the job.
        rig_sha256: hash of the rig that it was made for.
        material_sha256: hash of the material that it was made for.
    """

    blocks: Sequence[ReplayBlock]
    sha256: str
    rig_sha256: str
    material_sha256: str


def replay_job(job: Job) -> ReplayJob:
    """The blocks of a job as they are sent.

    Raises:
        JobError: if a block cannot be written for the controller.
    """
    program = gcode_program(job)
    return ReplayJob(program.blocks, job.sha256, job.hashes.get("rig", ""), job.hashes.get("material", ""))


def lit_block(block: ReplayBlock) -> tuple[str, ...]:
    """Lines of a block as they are armed; a sync line is added where the last ``ok`` would not confirm."""
    lines = tuple(block.lines)
    return lines if _confirms(lines) else (*lines, SYNC)


def dark_block(block: ReplayBlock) -> tuple[str, ...]:
    """The same moves with ``S0`` and ``M5`` in place of every power and light word; waits are left out."""
    lines = dark_lines(block)
    return (*lines, SYNC) if lines else ()


def dark_lines(block: ReplayBlock) -> tuple[str, ...]:
    """The same without the line whose answer confirms that all has been executed."""
    if block.kind == "wait":
        return ()
    lines = [_LIGHT.sub("M5", _COOLANT.sub("M9", _POWER.sub("S0", line))) for line in block.lines]
    return tuple(line for line in lines if not _DWELL.match(line))


def _confirms(lines: Sequence[str]) -> bool:
    """True when the last line is a dwell, or the M5 of a block that was lit."""
    last = split_words(lines[-1]) if lines else None
    if last is None:
        return False
    if ("G", 4.0) in last:
        return True
    return ("M", 5.0) in last and any(_LIGHT.search(line) for line in lines[:-1])


def light_of(lines: Sequence[str], seconds: float) -> tuple[int, float, float]:
    """When the light of a block must be off.

    Args:
        lines: of the block.
        seconds: planned for all of them.

    Returns:
        how many answers there are up to the ``M5`` that ends the light (0 for a dark block), after how many
        seconds, and the largest S word.
    """
    dark_at, lit, pause, most = 0, False, 0.0, 0.0
    for number, line in enumerate(lines, 1):
        words = split_words(line) or []
        values = dict(words)
        if values.get("M") in (3.0, 4.0):
            lit = True
        elif values.get("M") == 5.0 and lit:
            dark_at, pause = number, 0.0
        elif values.get("G") == 4.0:
            pause += values.get("P", 0.0)
        most = max(most, values.get("S", 0.0))
    return dark_at, max(seconds - pause, 0.0), most


def frame_blocks(job: ReplayJob, rig: Rig, speed_mm_s: float = 50.0) -> tuple[PlainBlock, ...]:
    """Blocks that trace the rectangle around all moves of a job with the pilot light, sheet flat.

    Raises:
        JobError: if the job moves nowhere.
    """
    xs, ys = _extent(job)
    if not xs or not ys:
        raise JobError("the job has no moves to frame")
    corners = [(min(xs), min(ys)), (max(xs), min(ys)), (max(xs), max(ys)), (min(xs), max(ys))]
    pilot = rig.laser.pilot
    on, off = {
        "low-power": (f"M3 S{pilot.s:g}", "M5"),
        "aux-output": ("M8", "M9"),
        "none": ("M5", "M5"),
    }[pilot.kind]
    power = f" S{pilot.s:g}" if pilot.kind == "low-power" else ""
    feed = 60.0 * min(speed_mm_s, *rig.axes.max_mm_s[:2])
    blocks = [PlainBlock(0, "goto", (f"G0 X{corners[0][0]:.3f} Y{corners[0][1]:.3f}", SYNC), seconds=10.0)]
    before = corners[0]
    for x, y in (*corners[1:], corners[0]):
        seconds = (abs(x - before[0]) + abs(y - before[1])) * 60.0 / feed + 0.5
        move = f"G1 X{x:.3f} Y{y:.3f} F{feed:.0f}{power}"
        lines, expect = (on, move, off, SYNC), (("X", x), ("Y", y))
        blocks.append(PlainBlock(len(blocks), "pilot", lines, seconds=seconds, expect=expect))
        before = (x, y)
    return tuple(blocks)


def mark_blocks(rig: Rig, speed_mm_s: float = 5.0) -> tuple[PlainBlock, ...]:
    """For the first two marks of the sheet (``sheet.fiducials_mm``) a stroke of pilot light across each.

    Empty if the rig declares no marks or has no pilot light. The sheet must be flat (rotary at 0).
    """
    pilot = rig.laser.pilot
    if pilot.kind == "none":
        return ()
    on, off = (f"M3 S{pilot.s:g}", "M5") if pilot.kind == "low-power" else ("M8", "M9")
    power = f" S{pilot.s:g}" if pilot.kind == "low-power" else ""
    x0, y0, z0 = rig.rotary.axis_point_mm
    height = f" Z{z0:.3f}" if rig.has_focus_axis else ""
    blocks = []
    for number, (x, y) in enumerate(rig.sheet.fiducials_mm[:2]):
        left, right = x0 + x - _MARK_MM, x0 + x + _MARK_MM
        lines = (
            f"G0 X{left:.3f} Y{y0 + y:.3f}{height}", on,
            f"G1 X{right:.3f} F{60.0 * speed_mm_s:.0f}{power}", off, SYNC,
        )  # fmt: skip
        seconds = 2.0 * _MARK_MM / speed_mm_s + 15.0
        question = f"did the pilot light run across mark {number + 1} of the sheet, at ({x:g}, {y:g}) mm?"
        expect = (("X", right), ("Y", y0 + y))
        blocks.append(PlainBlock(-1, "pilot", lines, 0.0, seconds, -1, expect, (question,)))
    return tuple(blocks)


def _extent(job: ReplayJob) -> tuple[list[float], list[float]]:
    places: dict[str, list[float]] = {"X": [], "Y": []}
    for block in job.blocks:
        for line in block.lines:
            for letter, value in split_words(line) or ():
                if letter in places:
                    places[letter].append(value)
    return places["X"], places["Y"]
