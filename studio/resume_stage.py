"""Going on with the job of a bundle after a replay that stopped."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from studio.errors import UsageError
from studio.gauges import workpiece_of
from studio.hardware_stage import Before, folds, hardware
from studio.live_stage import replay_view, watched
from studio.replay_stage import (
    JOURNAL_PREFIX,
    certificate_of,
    holding_of,
    machine_of,
    next_journal,
    told,
    trace_for,
)
from studio.workspace import Workspace

if TYPE_CHECKING:
    from rigs.job import Job
    from rigs.journal import Journal
    from rigs.resume import Decision, Standing

__all__ = ["Beside", "Choice", "resume_stage", "standing_of"]


@dataclass(frozen=True)
class Beside:
    """What looks at the replay, as in ``studio.replay_stage.replay_stage``.

    Attributes:
        shadow: the twin follows and stops the machine where it differs.
        measure: how creases are measured after their passes.
        encoder: port of an encoder on the rotary.
        view_port: where the live view listens; None: no view.
    """

    shadow: bool = False
    measure: str | None = None
    encoder: str | None = None
    view_port: int | None = None


@dataclass(frozen=True)
class Choice:
    """What a person decided about the block in doubt.

    Attributes:
        decision: ``done``, ``redo`` or ``abandon``; None if nothing was said.
        angle_deg: measured fold angle of the crease in doubt, with its sign; None if not measured.
    """

    decision: Decision | None = None
    angle_deg: float | None = None


def standing_of(ws: Workspace, job: Job) -> Standing:
    """How far the job of a bundle has come, by the journals in it.

    Raises:
        JobError: if a journal was edited, or the journals do not belong together.
    """
    from rigs.resume import standing

    return standing(list(_journals(ws)), job)


def resume_stage(
    ws: Workspace,
    port: str,
    choice: Choice,
    *,
    confirm: Callable[[str], bool] | None = None,
    look_only: bool = False,
    beside: Beside | None = None,
) -> str:
    """Go on with a job where its last replay stopped; returns the outcome in words.

    Args:
        ws: the bundle.
        port: ``emulator`` or the URL of a machine.
        choice: what becomes of the block in doubt.
        confirm: asked before a real machine fires, and where the job needs a person.
        look_only: only say how the job stands.
        beside: what looks at the replay; nothing if not given.

    Raises:
        BundleError: if the bundle has no job.
        UsageError: if there is nothing to go on with, or a decision is missing.
        JobError: if the journals are damaged, or the decision does not fit.
        MachineError: if the machine refuses, fails or vanishes.
    """
    from rigs.job_file import read_job
    from rigs.replay import replay
    from rigs.replay_blocks import mark_blocks
    from rigs.resume import blocks_left, resume_job

    ws.manifest.sha256_of("job.gcode")
    job = read_job(ws.path("job.json"), ws.path("job.gcode"))
    now = standing_of(ws, job)
    if not now.begun:
        raise UsageError(_nothing(now))
    if look_only:
        return _standing_words(now, job)
    decision, passes, notes = choice.decision, None, []
    if now.doubt is not None and decision is None and choice.angle_deg is None:
        raise UsageError(
            f"{now.doubt.words}. Say what becomes of it: "
            + (
                "--doubt done counts it as burnt, --doubt abandon leaves its crease as it is, "
                "--angle DEG sets "
                "the passes that are left by the measured angle"
                if now.doubt.kind == "pass"
                else "--doubt done counts it as burnt, --doubt redo burns it again"
            )
        )
    beside = beside or Beside()
    sheet = [j for j in _journals(ws) if j.path.name in now.journals]
    _check_measuring(sheet, beside, choice)
    if choice.angle_deg is not None:
        decision, passes, note = _passes_by_angle(ws, job, now, choice)
        notes.append(note)
    left, counted, dropped = blocks_left(job, now, decision, passes=passes)
    resumes: dict[str, Any] = {
        "journal": now.journals[-1], "hash": now.last_hash, "done": list(counted), "left_out": list(dropped),
        "decision": decision, "angle_deg": choice.angle_deg, "emulated": now.emulated,
    }  # fmt: skip
    journal = next_journal(ws)
    for note in notes:
        ws.progress.note(note)
    ws.progress.note(
        f"going on after {now.journals[-1]}: {len(now.done) + len(counted)} of {len(job.blocks)} blocks are "
        f"done, {len(left)} are left"
    )
    plan = resume_job(job, left)
    with contextlib.ExitStack() as stack:
        # of a test strip no part is followed
        before = _before(ws, job, sheet, left, counted, now, choice) if folds(ws) else None
        part = None if before is None else before.shadow.part
        seen = stack.enter_context(replay_view(ws, job, "arm", beside.view_port, part))
        trace = trace_for(stack, port, beside.measure, beside.encoder)
        url = stack.enter_context(machine_of(ws, port, trace))
        looks = stack.enter_context(
            hardware(
                ws, job, shadow=beside.shadow, measure=beside.measure, lit=True, trace=trace,
                encoder=beside.encoder, before=before,
            )
        )  # fmt: skip
        holding = stack.enter_context(holding_of(ws))
        stack.enter_context(ws.progress.stage("resume", f"on {port}"))
        done = replay(
            plan, url, rig=ws.rig, journal_path=journal, mode="arm", certificate=certificate_of(ws),
            confirm=confirm, ask=confirm, on_progress=told(ws, seen), resumes=resumes,
            marks=mark_blocks(ws.rig), holding=holding, watch=watched(looks.watch, seen),
            steering=looks.steering,
        )  # fmt: skip
    what = "EMULATED" if done.emulated else "REAL machine"
    words = f"resumed on {what}: {done.outcome}, {len(done.done)} blocks confirmed, {journal.name}"
    return "; ".join([words, *looks.words()])


def _check_measuring(sheet: Sequence[Journal], beside: Beside, choice: Choice) -> None:
    measured = any(r["kind"] == "measured" for journal in sheet for r in journal.records)
    if measured and beside.measure is None:
        raise UsageError(
            "this sheet was measured as it was folded, and how many passes a crease still needs is known by "
            "measuring only: go on with --measure"
        )
    if beside.measure is not None and choice.angle_deg is not None:
        raise UsageError("--angle and --measure exclude each other: with --measure, --doubt done is enough")


def _before(
    ws: Workspace,
    job: Job,
    sheet: Sequence[Journal],
    left: Sequence[int],
    counted: Sequence[int],
    now: Standing,
    choice: Choice,
) -> Before:
    from rigs.steering_so_far import so_far
    from twin.journal_shadow import sheet_shadow

    angles: dict[int, float] = {}
    if now.doubt is not None and choice.angle_deg is not None:
        angles[now.doubt.crease] = math.radians(choice.angle_deg)
    shadow = sheet_shadow(sheet, job, ws.rig, workpiece_of(ws), counted, angles)
    return Before(shadow, so_far(sheet, job, counted), frozenset(left))


def _journals(ws: Workspace) -> Iterator[Journal]:
    from rigs.journal import read_journal

    names = sorted(
        (
            p
            for p in ws.folder.glob(f"{JOURNAL_PREFIX}*.jsonl")
            if p.stem.removeprefix(JOURNAL_PREFIX).isdigit()
        ),
        key=lambda p: int(p.stem.removeprefix(JOURNAL_PREFIX)),
    )
    for path in names:
        if path.stat().st_size:
            yield read_journal(path)


def _nothing(now: Standing) -> str:
    if now.outcome == "complete":
        return f"nothing to go on with: the last armed replay ({now.journals[-1]}) ended complete"
    return "nothing to go on with: no armed replay of this job has a journal here"


def _standing_words(now: Standing, job: Job) -> str:
    words = f"{now.journals[-1]} {now.outcome}: {len(now.done)} of {len(job.blocks)} blocks are done"
    return f"{words}; {now.doubt.words}" if now.doubt else f"{words}; no block is in doubt"


def _passes_by_angle(ws: Workspace, job: Job, now: Standing, choice: Choice) -> tuple[Decision, int, str]:
    """How many further passes bring the measured angle nearest to what the plan asks for."""
    if now.doubt is None or now.doubt.kind != "pass":
        raise UsageError("--angle is for a fold pass in doubt; there is none")
    if choice.decision not in (None, "done"):
        raise UsageError("--angle goes with --doubt done or alone")
    angle = choice.angle_deg
    if angle is None or not math.isfinite(angle) or abs(angle) > 180.0:
        raise UsageError("--angle expects the measured fold angle in degrees, -180 to 180")
    fold = ws.process.fold_at[now.doubt.step]
    wanted, steps = math.degrees(fold.to_rad), [math.degrees(x) for x in fold.increments_rad]
    before = [b for b in job.blocks[: now.doubt.block + 1] if b.step == now.doubt.step and b.kind == "pass"]
    strokes = sum(b.step == now.doubt.step and b.kind == "pass" for b in job.blocks)
    made = min(len(steps), math.ceil(len(before) * len(steps) / strokes))
    rest = steps[made:]
    reach = [angle + sum(rest[:k]) for k in range(len(rest) + 1)]
    best = min(range(len(reach)), key=lambda k: abs(reach[k] - wanted))
    note = (
        f"crease {now.doubt.crease} was measured at {angle:g}° of {wanted:.1f}°: {best} of the "
        f"{len(rest)} passes "
        f"that were left are made, to {reach[best]:.1f}°"
    )
    if abs(reach[best] - wanted) > max(abs(x) for x in steps):
        note += "; more than that this job does not hold"
    return "done", best, note
