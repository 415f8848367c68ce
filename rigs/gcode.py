"""G-code of a job: GRBL dialect, one write per beam block, each with its own M5 and a confirming line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from rigs.errors import JobError
from rigs.job import Block, BlockKind, GcodeStyle, Job, MachinePoint

__all__ = ["SYNC_S", "GcodeBlock", "GcodeProgram", "gcode_program", "write_gcode"]

SYNC_S = 0.01
"""Shortest dwell: its ``ok`` comes when all motion before it has been executed."""

_ROTARY_WORDS = ("A", "B", "C", "Z")

HEADER = ("G21", "G90", "G94", "G17", "G54", "M5 S0")
"""Units mm, absolute, feed per minute, plane XY, work offset 1; beam off."""


@dataclass(frozen=True, slots=True)
class GcodeBlock:
    """The lines of one block; the ``ok`` of the last one says that the block was executed.

    Attributes:
        index: index of the block in the job; -1 for head and tail of the program.
        kind: kind of the block, ``head`` or ``tail``.
        step: plan step, -1 if none.
        crease: net edge, -1 if none.
        lines: lines to send in one write, without line ends.
        first_line: number of the first of these lines in the file, from 1.
        expect: (axis word, work coordinate) where the machine stands afterwards.
        beam_s: seconds with the beam on.
        seconds: planned duration.
        comments: lines before them in the file that need not be sent.
    """

    index: int
    kind: BlockKind | Literal["head", "tail"]
    step: int
    crease: int
    lines: tuple[str, ...]
    first_line: int
    expect: tuple[tuple[str, float], ...]
    beam_s: float
    seconds: float
    comments: tuple[str, ...] = ()

    @property
    def last_line(self) -> int:
        """Number of the last line in the file, from 1; less than ``first_line`` when there is none."""
        return self.first_line + len(self.lines) - 1

    @property
    def data(self) -> bytes:
        """The bytes of the one write."""
        return "".join(f"{line}\n" for line in self.lines).encode("ascii")


@dataclass(frozen=True)
class GcodeProgram:
    """All blocks of a program, with head (modes) first and tail (beam off, end) last."""

    blocks: tuple[GcodeBlock, ...]

    @property
    def text(self) -> str:
        """The whole file."""
        lines = [line for block in self.blocks for line in (*block.comments, *block.lines)]
        return "\n".join(lines) + "\n"


def write_gcode(job: Job, *, pauses: bool = False) -> str:
    """Text of ``job.gcode``.

    Args:
        job: the job.
        pauses: for foreign senders: ``M0`` before every rotation and where a person is asked.

    Raises:
        JobError: if a number is not finite, or a line or block is too long for the controller.
    """
    return gcode_program(job, pauses=pauses).text


def gcode_program(job: Job, *, pauses: bool = False) -> GcodeProgram:
    """The blocks of a job as G-code lines, numbered as in the file.

    A pass reads ``M4 S0``, ``G1`` dark run-in, lit stroke, dark run-out, ``M5``, ``G4`` (cooling, and the
    line whose ``ok`` confirms the block).

    Raises:
        JobError: if a number is not finite, or a line or block is too long for the controller.
    """
    if job.style.rotary_word not in _ROTARY_WORDS:
        raise JobError(
            f"the rotary has the word {job.style.rotary_word[:9]!a}: expected {', '.join(_ROTARY_WORDS)}"
        )
    comments = _title(job)
    line = len(comments) + 1
    blocks = [GcodeBlock(-1, "head", -1, -1, HEADER, line, (), 0.0, 0.0, comments)]
    line += len(HEADER)
    step: int | None = None
    for index, block in enumerate(job.blocks):
        said: tuple[str, ...] = (
            () if block.step == step else (_comment(f"step {block.step}" if block.step >= 0 else "move"),)
        )
        step = block.step
        if block.text:
            said += (_comment(block.text, job.style.line_chars),)
        lines = tuple(_lines(block, job.style, pauses))
        _check(block, index, lines, job.style)
        line += len(said)
        blocks.append(
            GcodeBlock(
                index, block.kind, block.step, block.crease, lines, line, _expect(block, job.style),
                block.beam_s, block.seconds, said,
            )
        )  # fmt: skip
        line += len(lines)
    blocks.append(GcodeBlock(-1, "tail", -1, -1, ("M5 S0", "M2"), line, (), 0.0, 0.0))
    return GcodeProgram(tuple(blocks))


def _title(job: Job) -> tuple[str, ...]:
    return (
        _comment(f"Metal Blossom job for rig {job.rig_name}", job.style.line_chars),
        *(
            _comment(f"{name} {value[:32]}", job.style.line_chars)
            for name, value in sorted(job.hashes.items())
        ),
        _comment(f"{len(job.blocks)} blocks, {job.strokes} strokes, about {job.seconds:.0f} s"),
        _comment("laser mode $32=1 is needed: without it the beam stays on at rest"),
    )


def _lines(block: Block, style: GcodeStyle, pauses: bool) -> Iterator[str]:
    sync = f"G4P{_number(max(block.wait_s, SYNC_S))}"
    if block.kind == "goto":
        height = f"Z{_number(block.end[2])}" if style.has_focus_axis else ""
        yield f"G0X{_number(block.end[0])}Y{_number(block.end[1])}{height}"
        yield sync
    elif block.kind == "rotate":
        if pauses:
            yield "M0"
        yield f"G0{style.rotary_word}{_number(_rotary_units(block, style))}"
        yield sync
    elif block.kind == "wait":
        yield sync
    elif block.kind == "ask":
        yield "M5"
        if pauses:
            yield "M0"
        yield sync
    else:
        yield "M4S0"
        motion = "G1"
        feed = f"F{_number(60.0 * block.speed_mm_s)}"
        here = block.start
        power = 0.0
        for there, s_word in _strokes(block):
            if there == here:
                continue
            power_word = "" if s_word == power else f"S{_number(s_word)}"
            yield f"{motion}{_words(here, there, style)}{feed}{power_word}"
            motion, feed, here, power = "", "", there, s_word
        yield "M5"
        yield sync


def _strokes(block: Block) -> Iterator[tuple[MachinePoint, float]]:
    """Targets with the S word on the way to them: dark run-in, lit path, dark run-out."""
    yield block.path[0], 0.0
    for point in block.path[1:]:
        yield point, block.s_word
    yield block.end, 0.0


def _words(start: MachinePoint, end: MachinePoint, style: GcodeStyle) -> str:
    """Axis words of a move: only those that change, X and Y together so that each line can be read alone."""
    words = ""
    if start[0] != end[0] or start[1] != end[1]:
        words = f"X{_number(end[0])}Y{_number(end[1])}"
    if style.has_focus_axis and start[2] != end[2]:
        words += f"Z{_number(end[2])}"
    return words


def _expect(block: Block, style: GcodeStyle) -> tuple[tuple[str, float], ...]:
    place = [("X", block.end[0]), ("Y", block.end[1])]
    if style.has_focus_axis:
        place.append(("Z", block.end[2]))
    return (*place, (style.rotary_word, round(_rotary_units(block, style), 3)))


def _rotary_units(block: Block, style: GcodeStyle) -> float:
    return block.rotary_rad * style.rotary_units_per_rad


def _number(value: float) -> str:
    """Three decimals at most, without trailing zeros, never an exponent, a minus zero or a comma."""
    text = f"{value:.3f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text


def _comment(text: str, line_chars: int = 78) -> str:
    """A comment that any controller takes: ASCII without brackets, percent, exclamation or question marks."""
    plain = "".join(c if c.isascii() and c.isprintable() and c not in "()!?~;%" else " " for c in text)
    return f"({plain[: line_chars - 2]})"


def _check(block: Block, index: int, lines: tuple[str, ...], style: GcodeStyle) -> None:
    where = f"block {index} ({block.kind}, step {block.step}" + (
        f", crease {block.crease})" if block.crease >= 0 else ")"
    )
    numbers = (
        *block.start, *block.end, *(c for p in block.path for c in p), block.rotary_rad, block.power_w,
        block.s_word, block.speed_mm_s, block.wait_s,
    )  # fmt: skip
    if not all(map(math.isfinite, numbers)):
        raise JobError(
            f"{where}: a coordinate, power, speed or time is not a finite number: make the job anew"
        )
    if block.lit and (len(block.path) < 2 or not block.speed_mm_s > 0.0 or not block.s_word > 0.0):
        raise JobError(f"{where}: a beam block needs a path of two points, a speed and a power above 0")
    longest = max(map(len, lines))
    if longest > style.line_chars:
        raise JobError(f"{where}: a line of {longest} characters, the controller takes {style.line_chars}")
    size = sum(len(line) + 1 for line in lines)
    if size > style.block_bytes:
        raise JobError(
            f"{where}: {size} bytes do not fit the receive buffer ({style.block_bytes} bytes may be written "
            "at once): use shorter pieces"
        )
