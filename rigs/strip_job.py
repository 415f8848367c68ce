"""The job that burns a test strip: the same blocks, G-code and replay as those of a plan."""

from __future__ import annotations

from collections.abc import Mapping

from rigs.block_writer import BlockWriter
from rigs.job import Job
from rigs.material import Material
from rigs.rig import Rig
from rigs.strip import Cutting, Strip

__all__ = ["strip_job"]


def strip_job(
    strip: Strip,
    rig: Rig,
    material: Material,
    cutting: Cutting,
    rest_s: float,
    hashes: Mapping[str, str] | None = None,
) -> Job:
    """Blocks that cut and fold all pieces of a strip.

    All slits are cut first. Then each finger gets one pass after the other in rounds, so that it rests while
    the others are lit. The step of a block is the number of its piece, and so is the crease of a pass.

    Args:
        strip: the pieces.
        rig: the machine.
        material: of the sheet; its hash binds the job.
        cutting: how slits are cut; windows are cut with the setting that they try.
        rest_s: least time from the end of a pass to the next on the same finger.
        hashes: further hashes of what the job was made from.

    Raises:
        JobError: if the rig cannot do it; names the piece.
    """
    writer = BlockWriter(rig)
    writer.cuts(
        0, strip.mark, cutting.power_w, cutting.speed_mm_s, cutting.passes, "the mark of the strip", "mark"
    )
    for piece in strip.pieces:
        how = cutting
        if strip.kind == "kerf":
            how = Cutting(piece.power_w, piece.speed_mm_s, piece.passes)
        where = f"piece {piece.number}"
        writer.cuts(piece.number, strip.slit(piece), how.power_w, how.speed_mm_s, how.passes, where, where)
    if strip.kind == "fold":
        _fold(writer, strip, rest_s)
    writer.finish("take the strip out and measure its pieces")
    return Job(
        rig_name=rig.name,
        hashes={**dict(hashes or {}), "rig": rig.sha256, "material": material.sha256},
        style=writer.style,
        blocks=tuple(writer.blocks),
        notices=tuple(writer.notices),
    )


def _fold(writer: BlockWriter, strip: Strip, rest_s: float) -> None:
    """One pass on every finger, again and again, until each has its number."""
    now = sum(block.seconds for block in writer.blocks)
    cold_at: dict[int, float] = {}
    for turn in range(max(piece.passes for piece in strip.pieces)):
        for piece in strip.pieces:
            if turn >= piece.passes:
                continue
            wait = cold_at.get(piece.number, 0.0) - now
            if wait > 0.0:
                writer.dark(piece.number, "wait", round(wait, 3))
                now += wait
            before = len(writer.blocks)
            writer.passes(
                piece.number, piece.number, strip.crease(piece), piece.power_w, piece.speed_mm_s, (0.0,),
                f"piece {piece.number}",
            )  # fmt: skip
            now += sum(block.seconds for block in writer.blocks[before:])
            cold_at[piece.number] = now + rest_s
