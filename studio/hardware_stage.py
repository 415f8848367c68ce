"""The twin beside the machine: its shadow, measured angles, and a journal replayed into the twin."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.errors import UsageError
from studio.gauges import encoder_of, gauge_of, workpiece_of
from studio.workspace import Workspace

if TYPE_CHECKING:
    from rigs.angle_steering import AngleSteering
    from rigs.job import Job
    from rigs.rotary_encoder import RotaryEncoder
    from rigs.steering_so_far import SoFar
    from rigs.watch import Watch
    from twin.shadow import Shadow
    from twin.workpiece import Workpiece

__all__ = ["Before", "Hardware", "folds", "hardware", "shadow_of_journal"]


@dataclass(frozen=True)
class Before:
    """What earlier replays of the sheet in the machine did.

    Attributes:
        shadow: followed their journals; its part is the one in the machine.
        measured: what was measured.
        left: blocks that are to be made.
    """

    shadow: Shadow
    measured: SoFar
    left: frozenset[int]


@dataclass(frozen=True)
class Hardware:
    """What looks at a replay and steers it.

    Attributes:
        watch: shadow and encoder, or None.
        steering: makes passes by measured angles, or None.
        shadow: the shadow alone, or None.
        encoder: what reads the encoder of the rotary, or None.
    """

    watch: Watch | None
    steering: AngleSteering | None
    shadow: Shadow | None
    encoder: RotaryEncoder | None = None

    def words(self) -> list[str]:
        """What they found, for the summary."""
        out = []
        if self.shadow is not None:
            part = self.shadow.part
            seen = self.shadow
            out.append(
                f"shadow: {seen.reports_seen} reports, at most {seen.off_mm:.3f} mm off the path, "
                f"{max(seen.late_s, 0.0):.1f} s late, doses within {seen.dose_off:.1%}; "
                f"folded {100.0 * part.completion():.1f} %, {part.shape_rms_mm():.2f} mm rms"
            )
        if self.encoder is not None:
            out.append(f"encoder: {self.encoder.turns} turns, at most {self.encoder.off_deg:.2f}° off")
        if self.steering is not None and self.steering.readings:
            made = sum(r.made for r in self.steering.readings)
            planned = sum(r.planned for r in self.steering.readings)
            worst = max(abs(r.measured_deg - r.wanted_deg) for r in self.steering.readings)
            out.append(
                f"measured {len(self.steering.readings)} folds: {made} passes instead of {planned}, at most "
                f"{worst:.1f}° off the plan; a pass is worth {self.steering.gain.value:.2f} of the model's"
            )
        return out


def folds(ws: Workspace) -> bool:
    """True if the bundle has a plan; a test strip has none, and nothing of it turns."""
    return ws.path("plan.json").is_file()


@contextlib.contextmanager
def hardware(
    ws: Workspace,
    job: Job,
    *,
    shadow: bool,
    measure: str | None,
    lit: bool,
    trace: Path | None = None,
    encoder: str | None = None,
    before: Before | None = None,
) -> Iterator[Hardware]:
    """Set up what looks at a replay, while the block runs.

    Args:
        ws: the bundle.
        job: its job.
        shadow: the twin's shadow follows and stops the machine where it differs.
        measure: how creases are measured; ``gauge_of`` says which ways there are.
        lit: the replay fires.
        encoder: port of an encoder on the rotary, ``virtual`` for that of the emulated machine.
        before: what earlier replays of this sheet did; None on a new sheet.
        trace: file in which the emulated machine tells what it does, None for a real one.

    Raises:
        UsageError: if ``measure`` makes no sense here.
        MachineError: if the gauge does not answer.
        ProfileError: if a camera file has a mistake.
    """
    from rigs.watch import Watches
    from twin.shadow import Shadow, VirtualPart
    from twin.turn_check import TurnCheck

    with contextlib.ExitStack() as stack:
        made: Shadow | None = None
        part = None if before is None else before.shadow.part
        if part is None and (shadow or measure is not None or folds(ws)):
            part = workpiece_of(ws)
        if shadow:
            assert part is not None  # noqa: S101
            due = None if before is None else before.left
            made = Shadow(job, ws.rig, part, lit, steered=measure is not None, due=due)
            made.wanted = made.wanted if before is None else before.shadow.wanted
        steering: AngleSteering | None = None
        if measure is not None:
            assert part is not None  # noqa: S101
            from rigs.angle_steering import AngleSteering

            if not lit:
                raise UsageError("--measure needs --arm: without light nothing folds")
            from rigs.steering_so_far import SoFar

            folded = {} if before is None else dict(before.shadow.part.angles_rad)
            gauge = gauge_of(ws, measure, trace, stack, folded)
            steering = AngleSteering(
                job, ws.process, gauge, _accept(ws), told=_into(part),
                before=SoFar() if before is None else before.measured,
            )  # fmt: skip
        turns = encoder_of(ws, encoder, trace, stack) if encoder is not None else None
        watches: list[Watch] = [w for w in (turns, made) if w is not None]
        if lit and part is not None:
            # turns with the part as it is by now: as the shadow has it, else as the confirmed passes fold it
            angles = part.angles_rad
            watches += [] if shadow else [VirtualPart(job, part)]
            watches.append(TurnCheck(ws.plan, job, lambda: angles))
        yield Hardware(Watches(*watches) if watches else None, steering, made, turns)


def _into(part: Workpiece) -> Callable[[int, float], None]:
    """A function that gives the twin's part the measured angles."""

    def tell(crease: int, angle_rad: float) -> None:
        part.angles_rad[crease] = angle_rad

    return tell


def _accept(ws: Workspace) -> Callable[[int, float], bool]:
    """Whether the rest of the plan is free of contact with a crease at another angle, by the exact kernel."""
    import numpy as np

    from twin.scatter_contact import ContactReplay
    from twin.scatter_draws import fold_turns

    turns = fold_turns(ws.plan, ws.process)
    angles = np.array([turn.to_rad for turn in turns])
    replay = ContactReplay(ws.plan, turns)

    def accept(step: int, angle_rad: float) -> bool:
        for n, turn in enumerate(turns):
            if turn.step == step:
                angles[n] = angle_rad
        return replay.first(angles).collision is None

    return accept


def shadow_of_journal(ws: Workspace, path: Path) -> dict[str, Any]:
    """Replay a journal into the twin: what the confirmed passes folded.

    Raises:
        JobError: if the journal cannot be read, was edited, or belongs to another job.
    """
    import math

    from rigs.errors import JobError
    from rigs.job_file import read_job
    from rigs.journal import read_journal
    from twin.journal_shadow import journal_shadow

    job = read_job(ws.path("job.json"), ws.path("job.gcode"))
    journal = read_journal(path)
    if journal.header.get("job_sha256") != job.sha256:
        raise JobError(f"{path}: the journal of another job")
    followed = journal_shadow(journal, job, ws.rig, workpiece_of(ws))
    part = followed.part
    net = ws.plan.net
    rows = [
        {
            "crease": crease,
            "angle_deg": round(math.degrees(part.angles_rad.get(crease, 0.0)), 4),
            "plan_deg": round(math.degrees(float(angle)), 4),
            "passes": round(part.strokes.get(crease, 0.0), 3),
        }
        for crease, angle in enumerate(ws.plan.final_angles.tolist())
        if net.assignment[crease] in ("V", "M")
    ]
    return {
        "format": "metal-blossom/shadow",
        "version": 1,
        "journal": path.name,
        "machine": "EMULATED" if journal.emulated else "REAL",
        "mode": journal.header.get("mode"),
        "outcome": journal.outcome,
        "blocks": len(journal.done),
        "fold_completion": part.completion(),
        "shape_rms_mm": part.shape_rms_mm(),
        "reports": followed.reports_seen,
        "off_mm": round(followed.off_mm, 4),
        "dose_off": round(followed.dose_off, 4),
        "unlike": followed.unlike,
        "creases": rows,
    }
