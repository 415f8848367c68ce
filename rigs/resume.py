"""What is left of a job after a replay that stopped, and the job that goes on from there.

Nothing is repeated that was confirmed. At most one block is in doubt: its light may have burnt for a part
of its time. A fold pass in doubt is never repeated, since dose adds up; a person says what becomes of it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from rigs.errors import JobError
from rigs.gcode import SYNC_S, GcodeBlock, gcode_program
from rigs.job import Block, Job
from rigs.journal import Journal
from rigs.replay_blocks import ReplayJob

__all__ = ["Decision", "Doubt", "Standing", "blocks_left", "pass_groups", "resume_job", "standing"]

Decision = Literal["done", "redo", "abandon"]
"""What becomes of the block in doubt: it counts as burnt; it is burnt again (cuts only); its crease is left
as it is from here on (passes only)."""

_ON_PATH_MM = 0.05
_SURE = 0.95
"""Share of the light up to a reported place that counts as sure: ramps take longer than their length says."""

_AFTER_S = 0.5
"""Light may go on for this long after the last record before the stop."""


@dataclass(frozen=True)
class Doubt:
    """The block whose light may or may not have burnt.

    Attributes:
        block: index in the job.
        step: plan step.
        kind: ``pass`` or ``cut``.
        crease: net edge of a pass, else -1.
        least_s: seconds of light that it has had at least.
        most_s: and at most.
        whole_s: seconds of light of the whole block.
    """

    block: int
    step: int
    kind: str
    crease: int
    least_s: float
    most_s: float
    whole_s: float

    @property
    def words(self) -> str:
        """The doubt in words."""
        what = f"a pass over crease {self.crease}" if self.kind == "pass" else "a cut"
        return (
            f"block {self.block} (step {self.step}), {what}, was under way: between {self.least_s:.2f} and "
            f"{self.most_s:.2f} s of its {self.whole_s:.2f} s of light have burnt"
        )


@dataclass(frozen=True)
class Standing:
    """How far a job has come on the sheet that is in the machine.

    Attributes:
        done: blocks that count as done, head and tail left out.
        left_out: blocks that a person gave up or that measuring made needless.
        doubt: the block in doubt, or None.
        outcome: of the last replay; ``new`` if there was none.
        journals: names of the replays of this sheet, in order.
        last_hash: hash of the last record of the last journal, empty without one.
        emulated: True when the sheet is in the emulated machine.
    """

    done: frozenset[int]
    left_out: frozenset[int]
    doubt: Doubt | None
    outcome: str
    journals: tuple[str, ...]
    last_hash: str = ""
    emulated: bool = False

    @property
    def begun(self) -> bool:
        """True when light may have touched the sheet or the machine has moved for it."""
        return bool(self.journals) and self.outcome != "complete"


def standing(journals: Sequence[Journal], job: Job) -> Standing:
    """Read the journals of a job, oldest first.

    Only armed replays of this very job count, on a machine of the same kind (emulated or real) as the last of
    them. One that does not say that it went on from the one before began a new sheet.

    Raises:
        JobError: if a journal goes on from one that is missing, or names blocks that the job does not have.
    """
    armed = [
        journal
        for journal in journals
        if journal.header.get("mode") == "arm" and journal.header.get("job_sha256") == job.sha256
    ]
    emulated = bool(armed) and armed[-1].emulated
    now = Standing(frozenset(), frozenset(), None, "new", (), emulated=emulated)
    for journal in armed:
        if journal.emulated != emulated:
            continue
        header = journal.header
        before: Mapping[str, Any] = header.get("resumes") or {}
        if not before:
            now = Standing(frozenset(), frozenset(), None, "new", (), emulated=emulated)
        elif before.get("hash") != now.last_hash:
            raise JobError(
                f"{journal.path}: goes on from {before.get('journal')}, which is not the journal before it: "
                "the journals of this job do not belong together"
            )
        done = now.done | set(journal.done) | set(before.get("done", ()))
        strange = [
            k
            for k in (*done, *before.get("left_out", ()), *_needless(journal))
            if not 0 <= k < len(job.blocks)
        ]
        if strange:
            raise JobError(f"{journal.path}: names block {strange[0]}, the job has {len(job.blocks)}")
        now = Standing(
            done=frozenset(done),
            left_out=now.left_out | frozenset(before.get("left_out", ())) | _needless(journal),
            doubt=_doubt(journal, job),
            outcome=journal.outcome,
            journals=(*now.journals, journal.path.name),
            last_hash=str(journal.records[-1].get("hash", "")),
            emulated=emulated,
        )
    return now


def _needless(journal: Journal) -> frozenset[int]:
    """Passes that measuring found needless."""
    return frozenset(k for r in journal.records if r["kind"] == "reached" for k in r["left_out"])


def _doubt(journal: Journal, job: Job) -> Doubt | None:
    number = journal.in_doubt
    if number is None:
        return None
    if not 0 <= number < len(job.blocks):
        raise JobError(f"{journal.path}: names block {number}, the job has {len(job.blocks)}")
    block = job.blocks[number]
    start = max(n for n, r in enumerate(journal.records) if r["kind"] == "intent" and r["block"] == number)
    begun, last = journal.records[start], journal.records[-1]
    least = max((_burnt_s(r, block) for r in journal.records[start:] if _shows_light(r, number)), default=0.0)
    most = block.beam_s
    if last["kind"] == "end":  # the host saw the stop: light cannot have burnt longer than until then
        went_on = max(last["t"] - begun["t"], 0.0)
        late = max(went_on - block.seconds, 0.0)  # a damaged feed: it ran for longer than planned
        most = min(most + late + (_AFTER_S if late else 0.0), went_on + _AFTER_S)
    return Doubt(number, block.step, block.kind, block.crease, min(least, most), most, block.beam_s)


def _shows_light(record: Mapping[str, Any], number: int) -> bool:
    return record["kind"] == "status" and record["block"] == number and (record.get("s") or 0.0) > 0.0


def _burnt_s(record: Mapping[str, Any], block: Block) -> float:
    """Seconds of light that a block has had when it reported this place with the light on; 0 off its path."""
    place = (float(record["at"][0]), float(record["at"][1]))
    before = 0.0
    for a, b in itertools.pairwise(block.path):
        length = math.dist(a, b)
        flat = math.dist(a[:2], b[:2])
        if flat > 0.0:
            along = ((place[0] - a[0]) * (b[0] - a[0]) + (place[1] - a[1]) * (b[1] - a[1])) / flat**2
            off = math.dist(place, (a[0] + along * (b[0] - a[0]), a[1] + along * (b[1] - a[1])))
            if off < _ON_PATH_MM and 0.0 <= along <= 1.0:
                return (before + along * length) / block.lit_length_mm * block.beam_s * _SURE
        before += length
    return 0.0


def blocks_left(
    job: Job,
    now: Standing,
    decision: Decision | None = None,
    *,
    passes: int | None = None,
) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
    """Which blocks are still to be made.

    Args:
        job: the job.
        now: how far it has come.
        decision: what becomes of the block in doubt.
        passes: of the step in doubt only so many further passes are made, since its angle was measured;
            only with ``done``.

    Returns:
        blocks to make, blocks that count as done by decision, blocks that are left out by decision.

    Raises:
        JobError: if there is a doubt and no decision, or one that does not fit.
    """
    doubt = now.doubt
    counted: set[int] = set()
    dropped: set[int] = set()
    if doubt is None:
        if decision is not None or passes is not None:
            raise JobError("no block is in doubt, so there is nothing to decide")
    elif decision is None:
        raise JobError(f"{doubt.words}: say what becomes of it")
    elif decision == "redo":
        if doubt.kind == "pass":
            raise JobError(
                "a fold pass in doubt is never burnt again: dose adds up. Measure the angle, count "
                "it as done, "
                "or abandon the crease"
            )
    elif decision == "abandon":
        if doubt.kind != "pass":
            raise JobError("only a crease can be abandoned; a cut counts as done or is burnt again")
        dropped = {
            k for k, block in enumerate(job.blocks) if block.crease == doubt.crease and k not in now.done
        }
    else:
        counted = {doubt.block}
    if passes is not None:
        if doubt is None or doubt.kind != "pass" or decision != "done":
            raise JobError("a number of passes can be set for a fold pass in doubt only")
        groups = [g for g in pass_groups(job, doubt.step) if g[0] > doubt.block]
        dropped |= {k for group in groups[max(passes, 0) :] for k in group}
    over = now.done | now.left_out | counted | dropped
    left = tuple(k for k in range(len(job.blocks)) if k not in over)
    return left, tuple(sorted(counted)), tuple(sorted(dropped))


def pass_groups(job: Job, step: int) -> list[list[int]]:
    """Passes of a fold step, each as the numbers of its strokes."""
    groups: list[list[int]] = [[]]
    for k, block in enumerate(job.blocks):
        if block.step != step or block.kind != "pass":
            continue
        groups[-1].append(k)
        if block.wait_s > SYNC_S + 1e-9 or _ends_pass(job, k):
            groups.append([])
    return [group for group in groups if group]


def _ends_pass(job: Job, number: int) -> bool:
    """True if the next stroke of the crease runs back, or there is none."""
    here = job.blocks[number]
    after = next((b for b in job.blocks[number + 1 :] if b.kind == "pass"), None)
    if after is None or after.step != here.step:
        return True
    a, b = _direction(here), _direction(after)
    return a[0] * b[0] + a[1] * b[1] < 0.0


def _direction(block: Block) -> tuple[float, float]:
    (x0, y0, _), (x1, y1, _) = block.path[0], block.path[-1]
    return x1 - x0, y1 - y0


def resume_job(job: Job, left: Collection[int]) -> ReplayJob:
    """The blocks ``left`` with dark moves to where each begins; it carries the hashes of the whole job.

    The sheet is turned before the head goes to the work, over the rotary axis, as at the start of the job.
    """
    blocks: list[Block] = []
    numbers: list[int] = []

    def add(number: int, block: Block) -> None:
        blocks.append(block)
        numbers.append(number)

    first = job.blocks[0]
    place, rotary = first.end, 0.0
    fresh = True
    for number in sorted(left):
        block = job.blocks[number]
        turned = job.blocks[number - 1].rotary_rad if number else 0.0
        if fresh and number:
            add(-1, replace(first, text="goes on after a stop"))
            settle = max((b.wait_s for b in job.blocks if b.kind == "rotate"), default=SYNC_S)
            seconds = max((b.seconds for b in job.blocks if b.kind == "rotate"), default=1.0)
            add(-1, Block("rotate", -1, place, (), place, turned, wait_s=settle, seconds=seconds))
            rotary = turned
        fresh = False
        if number and abs(rotary - turned) > 1e-9:
            settle = max((b.wait_s for b in job.blocks if b.kind == "rotate"), default=SYNC_S)
            seconds = max((b.seconds for b in job.blocks if b.kind == "rotate"), default=1.0)
            add(-1, Block("rotate", block.step, place, (), place, turned, wait_s=settle, seconds=seconds))
        if number and place != block.start:
            reach = max((b.seconds for b in job.blocks if b.kind == "goto"), default=1.0)
            add(-1, Block("goto", block.step, place, (), block.start, turned, seconds=reach))
        add(number, block)
        place, rotary = block.end, block.rotary_rad
    program = gcode_program(replace(job, blocks=tuple(blocks)))
    head, *middle, tail = program.blocks
    renamed: list[GcodeBlock] = [replace(b, index=k) for b, k in zip(middle, numbers, strict=True)]
    return ReplayJob(
        (head, *renamed, tail), job.sha256, job.hashes.get("rig", ""), job.hashes.get("material", "")
    )
