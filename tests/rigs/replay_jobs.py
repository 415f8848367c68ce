"""Small jobs in the coordinates of the 4-axis rig, written by hand."""

from __future__ import annotations

from rigs.replay_blocks import PlainBlock, ReplayJob
from rigs.rig import Rig, load_rig

RIG: Rig = load_rig("grbl-4axis")
START = (("X", 190.0), ("Y", 150.0), ("Z", 120.0))


def small_job(passes: int = 4, rig: Rig = RIG) -> ReplayJob:
    """Head, goto, strokes to and fro of 20 mm, a rotation in the middle, tail."""
    blocks = [PlainBlock(-1, "head", ("G21", "G90", "G94", "G17", "G54", "M5 S0"))]

    def add(kind: str, lines: tuple[str, ...], **values: object) -> None:
        blocks.append(PlainBlock(len(blocks) - 1, kind, lines, **values))  # type: ignore[arg-type]

    add("goto", ("G0X190Y150Z120", "G4P0.01"), seconds=3.0, step=0, expect=START)
    for number in range(passes):
        if number == passes // 2:
            add("rotate", ("G0A180", "G4P0.5"), seconds=4.0, step=1, expect=(("A", 180.0),))
        x = 210.0 if number % 2 == 0 else 190.0
        lines = ("M4S0", f"G1X{x:g}Y150F6000S500", "M5", "G4P0.01")
        place = (("X", x), ("Y", 150.0), ("Z", 120.0))
        add("pass", lines, beam_s=0.2, seconds=0.3, step=2 + number, expect=place)
    add("wait", ("G4P3",), seconds=3.0, step=9)
    blocks.append(PlainBlock(-1, "tail", ("M5 S0", "M2")))
    return ReplayJob(tuple(blocks), "a" * 64, rig.sha256, "c" * 64)
