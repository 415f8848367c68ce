"""A strip of test pieces: fingers that are cut free and folded, or windows that are cut out.

Sheet coordinates in mm, origin in the middle of the strip. Pieces stand in rows, numbered from 1 at the lower
left to the right, then the next row; a slit beside piece 1 tells which corner that is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from planner.fold_plan import Point
from rigs.errors import JobError
from rigs.rig import Rig

__all__ = ["Cutting", "Piece", "Strip", "StripKind", "lay_out"]

StripKind = Literal["fold", "kerf"]
"""``fold``: fingers with a crease each; ``kerf``: square windows."""

ROOT_MM = 1.0
"""The slits of a finger begin so far before its crease."""

GAP_MM, EDGE_MM, MARK_MM = 3.0, 5.0, 3.0
"""Metal between pieces and around them; length of the slit that marks piece 1."""


@dataclass(frozen=True)
class Cutting:
    """How slits are cut: W, mm/s, and how often over."""

    power_w: float
    speed_mm_s: float
    passes: int


@dataclass(frozen=True)
class Piece:
    """One finger or window.

    Attributes:
        number: from 1, the ``id`` of its row in the table.
        power_w: laser power that is tried.
        speed_mm_s: speed that is tried.
        passes: how often.
        x_mm: left end of its crease or lower left corner of the window.
        y_mm: the same.
    """

    number: int
    power_w: float
    speed_mm_s: float
    passes: int
    x_mm: float
    y_mm: float


@dataclass(frozen=True)
class Strip:
    """All pieces and the metal that they need.

    Attributes:
        kind: fingers or windows.
        pieces: in the order of their numbers.
        width_mm: of a piece along x, which is the length of a crease.
        length_mm: of a piece along y.
        size_mm: metal needed, clamped strip not counted.
    """

    kind: StripKind
    pieces: tuple[Piece, ...]
    width_mm: float
    length_mm: float
    size_mm: tuple[float, float]

    def slit(self, piece: Piece) -> tuple[Point, ...]:
        """The path that is cut: three sides of a finger, four of a window."""
        left, right = piece.x_mm, piece.x_mm + self.width_mm
        top = piece.y_mm + self.length_mm
        if self.kind == "kerf":
            low = piece.y_mm
            return ((left, low), (right, low), (right, top), (left, top), (left, low))
        low = piece.y_mm - ROOT_MM
        return ((left, low), (left, top), (right, top), (right, low))

    def crease(self, piece: Piece) -> tuple[Point, Point]:
        """Ends of the crease of a finger."""
        return (piece.x_mm, piece.y_mm), (piece.x_mm + self.width_mm, piece.y_mm)

    @property
    def mark(self) -> tuple[Point, Point]:
        """The slit beside piece 1."""
        first = self.pieces[0]
        x = first.x_mm - 0.5 * (GAP_MM + EDGE_MM)
        return (x, first.y_mm), (x, first.y_mm + MARK_MM)


def lay_out(
    kind: StripKind,
    settings: Sequence[tuple[float, float, int]],
    rig: Rig,
    *,
    width_mm: float,
    length_mm: float,
) -> Strip:
    """Place a piece for every setting.

    Args:
        kind: fingers or windows.
        settings: power in W, speed in mm/s and passes of each piece.
        rig: the machine.
        width_mm: of a piece along x.
        length_mm: of a piece along y.

    Raises:
        JobError: if there are no pieces, or they do not fit the sheet of the rig.
    """
    if not settings:
        raise JobError("a test strip needs at least one setting")
    for name, value in (("width", width_mm), ("length", length_mm)):
        if not (math.isfinite(value) and value >= 1.0):
            raise JobError(f"{name} of a test piece must be at least 1 mm, got {value:g}")
    margin = rig.sheet.frame_margin_mm + EDGE_MM + GAP_MM
    room = [side - 2.0 * margin for side in rig.sheet.max_mm]
    pitch = width_mm + GAP_MM, length_mm + ROOT_MM + GAP_MM
    columns, rows = (int((space + GAP_MM) / step) for space, step in zip(room, pitch, strict=True))
    if columns * rows < len(settings):
        raise JobError(
            f"{len(settings)} test pieces of {width_mm:g} x {length_mm:g} mm do not fit the sheet of rig "
            f"{rig.name}, which takes {max(columns, 0) * max(rows, 0)}: ask for fewer settings, passes or "
            "repeats, or smaller pieces"
        )
    # as square as the sheet allows, so that a small piece of metal does
    square = math.ceil(math.sqrt(len(settings) * pitch[1] / pitch[0]))
    wide = min(columns, max(math.ceil(len(settings) / rows), square))
    deep = math.ceil(len(settings) / wide)
    span = wide * pitch[0] - GAP_MM, deep * pitch[1] - GAP_MM
    left, low = -0.5 * span[0], -0.5 * span[1] + ROOT_MM
    pieces = tuple(
        Piece(n + 1, *setting, left + (n % wide) * pitch[0], low + (n // wide) * pitch[1])
        for n, setting in enumerate(settings)
    )
    around = 2.0 * (EDGE_MM + GAP_MM)
    size = span[0] + around, span[1] + around
    return Strip(kind, pieces, width_mm, length_mm, size)
