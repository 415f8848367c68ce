"""A journal replayed into the twin: the shadow that followed the machine, from what was written down."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rigs.grbl import Status
from rigs.job import Job
from rigs.journal import Journal
from rigs.replay_blocks import ReplayBlock, replay_job
from rigs.rig import Rig
from twin.shadow import Shadow
from twin.workpiece import Workpiece

__all__ = ["journal_shadow", "sheet_shadow"]


def journal_shadow(
    journal: Journal, job: Job, rig: Rig, part: Workpiece, wanted: Workpiece | None = None
) -> Shadow:
    """Follow the records of a journal as the shadow follows a machine; what differed is in ``unlike``.

    Confirmed passes fold the part by the status reports that were written down for them, measured angles
    take the place of calculated ones. A journal of a replay without light folds nothing.

    Args:
        journal: of a replay of this job.
        job: the job.
        rig: the machine.
        part: the part as it was before, flat on a new sheet; it is folded.
        wanted: the part of the plan as it was before; None for a new sheet.
    """
    lit = journal.header.get("mode") == "arm"
    blocks: dict[int, ReplayBlock] = {b.index: b for b in replay_job(job).blocks if b.index >= 0}
    resumed = bool(journal.header.get("resumes"))
    measured = any(r["kind"] == "measured" for r in journal.records)
    shadow = Shadow(
        job, rig, part, lit, steered=measured or resumed, strict=False, due=frozenset() if resumed else None
    )
    shadow.wanted = shadow.wanted if wanted is None else wanted
    under_way: ReplayBlock | None = None
    for record in journal.records:
        block = blocks.get(int(record.get("block", -1)))
        t = float(record.get("t", 0.0))
        if record["kind"] in ("intent", "done") and block is not None and under_way is not block:
            shadow.begins(block, block.seconds, t)
            under_way = block
        if record["kind"] == "status" and block is not None:
            shadow.reports(_status(record), _place(record, rig), t)
        elif record["kind"] == "done" and block is not None:
            shadow.confirmed(block, _place(record, rig), t)
            under_way = None
        elif record["kind"] == "measured":
            part.angles_rad[int(record["crease"])] = math.radians(float(record["deg"]))
    return shadow


def sheet_shadow(
    journals: Sequence[Journal],
    job: Job,
    rig: Rig,
    part: Workpiece,
    counted: Sequence[int] = (),
    angles_rad: Mapping[int, float] | None = None,
) -> Shadow:
    """The part in the machine after all replays of its sheet, beside that of the plan.

    Args:
        journals: of this job and sheet, oldest first.
        job: the job.
        rig: the machine.
        part: a flat part; it is folded.
        counted: passes in doubt that count as made.
        angles_rad: crease → angle that a person measured.
    """
    shadow = Shadow(job, rig, part, strict=False)
    for journal in journals:
        shadow = journal_shadow(journal, job, rig, part, shadow.wanted)
    for number in counted:
        made = job.blocks[number]
        for one in (part, shadow.wanted):
            if made.kind == "pass":
                one.heat(made.path[0], made.path[-1], made.rotary_rad, made.power_w, made.speed_mm_s)
    for one in (part, shadow.wanted):
        one.angles_rad.update(angles_rad or {})
    return shadow


def _place(record: Mapping[str, Any], rig: Rig) -> dict[str, float]:
    return dict(zip(rig.axis_words, (float(v) for v in record.get("at", ())), strict=False))


def _status(record: Mapping[str, Any]) -> Status:
    power = record.get("s")
    return Status(
        str(record["state"]), speed=float(record["f"]), s=float(power or 0.0), tells_power=power is not None
    )
