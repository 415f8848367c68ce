"""The job: machine-neutral blocks in the coordinates of one rig, each confirmed before the next is sent."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from planner.values import content_sha256

__all__ = ["BEAM_KINDS", "Block", "BlockKind", "GcodeStyle", "Job", "MachinePoint"]

MachinePoint = tuple[float, float, float]
"""G54 coordinates of a rig in mm: x, y and the height z of the focus."""

BlockKind = Literal["goto", "rotate", "pass", "cut", "wait", "ask"]
"""``goto`` moves the head, ``rotate`` the rotary, both dark. ``pass`` is one laser stroke along a crease or a
part of it, ``cut`` a piece of a cut. ``wait`` lets the part cool, ``ask`` needs a person."""

BEAM_KINDS: tuple[BlockKind, ...] = ("pass", "cut")
"""Kinds of blocks that light the beam."""


@dataclass(frozen=True)
class GcodeStyle:
    """What of the rig the G-code writer needs.

    Attributes:
        rotary_word: word of the rotary.
        rotary_units_per_rad: G-code units of a radian, with the sign of the rotary.
        has_focus_axis: a Z word moves the focus.
        line_chars: longest line in bytes, without its line end.
        block_bytes: longest block that is written at once: the receive buffer less a reserve.
    """

    rotary_word: str = "A"
    rotary_units_per_rad: float = 57.29577951308232
    has_focus_axis: bool = True
    line_chars: int = 78
    block_bytes: int = 247


@dataclass(frozen=True, slots=True)
class Block:
    """One block. Every block begins where the one before ended.

    Attributes:
        kind: what it does.
        step: index of the plan step that it belongs to, -1 for what belongs to none.
        start: where the head stands before.
        path: ``pass`` and ``cut``: points between which the beam is on; empty otherwise.
        end: where the head stands after it; for beam blocks the end of the dark run-out.
        rotary_rad: absolute angle of the rotary after it.
        crease: net edge of a ``pass``, else -1.
        power_w: laser power while the beam is on, W.
        s_word: the rig's S word for that power.
        speed_mm_s: speed of the beam over the part, mm/s.
        wait_s: dark time at the end: cooling, or settling of the rotary.
        beam_s: seconds with the beam on.
        seconds: planned duration, acceleration and ``wait_s`` included.
        text: what a person is asked, or why a cut is made.
    """

    kind: BlockKind
    step: int
    start: MachinePoint
    path: tuple[MachinePoint, ...]
    end: MachinePoint
    rotary_rad: float
    crease: int = -1
    power_w: float = 0.0
    s_word: float = 0.0
    speed_mm_s: float = 0.0
    wait_s: float = 0.0
    beam_s: float = 0.0
    seconds: float = 0.0
    text: str = ""

    @property
    def lit(self) -> bool:
        """True when the beam is on somewhere in the block."""
        return self.kind in BEAM_KINDS

    @property
    def energy_j(self) -> float:
        """Laser energy: M4 scales power with speed, so it is power over nominal speed times length."""
        return self.power_w / self.speed_mm_s * self.lit_length_mm if self.lit else 0.0

    @property
    def lit_length_mm(self) -> float:
        """Length over which the beam is on, mm."""
        total = 0.0
        for a, b in zip(self.path, self.path[1:], strict=False):
            total += ((b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2) ** 0.5
        return total


@dataclass(frozen=True, eq=False)
class Job:
    """What one rig does to make the part, from the zero of its work coordinates.

    Attributes:
        rig_name: name of the rig, for messages.
        hashes: sha256 of what the job was made from: ``plan``, ``rig``, ``material`` and so on.
        style: how this rig's G-code is written.
        blocks: in order.
        notices: what a person should know, in words.
        pattern: what the bend allowance and the kerf change, in mm (``planner.pattern_check``).
    """

    rig_name: str
    hashes: dict[str, str]
    style: GcodeStyle
    blocks: tuple[Block, ...]
    notices: tuple[str, ...] = field(default=())
    pattern: dict[str, float] = field(default_factory=dict)

    @cached_property
    def seconds(self) -> float:
        """Planned duration, s."""
        return sum(b.seconds for b in self.blocks)

    @cached_property
    def beam_s(self) -> float:
        """Seconds with the beam on."""
        return sum(b.beam_s for b in self.blocks)

    @cached_property
    def energy_j(self) -> float:
        """Laser energy of all cuts and passes, J."""
        return sum(b.energy_j for b in self.blocks)

    @cached_property
    def strokes(self) -> int:
        """Number of laser strokes along creases: a pass is one, or several where the focus must be reset."""
        return sum(b.kind == "pass" for b in self.blocks)

    @cached_property
    def sha256(self) -> str:
        """Content hash of blocks, style and hashes."""
        return content_sha256(
            "job/1", self.rig_name, repr(sorted(self.hashes.items())), repr(self.style), repr(self.blocks)
        )
