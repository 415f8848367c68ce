"""The twin beside the machine: its shadow, measured angles, and a journal replayed into the twin."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.errors import UsageError
from studio.workspace import Workspace

if TYPE_CHECKING:
    from rigs.angle_steering import AngleSteering
    from rigs.grbl import Status
    from rigs.job import Job
    from rigs.measuring import Measure
    from rigs.replay_blocks import ReplayBlock
    from rigs.watch import Watch
    from twin.shadow import Shadow
    from twin.workpiece import Workpiece

__all__ = ["Hardware", "hardware", "shadow_of_journal", "workpiece_of"]

TYPED, VIRTUAL = "typed", "virtual"
"""Ways to measure beside the URL of a gauge: a person types, or the emulated part tells its angle."""


@dataclass(frozen=True)
class Hardware:
    """What looks at a replay and steers it.

    Attributes:
        watch: shadow and virtual part, or None.
        steering: makes passes by measured angles, or None.
        shadow: the shadow alone, or None.
    """

    watch: Watch | None
    steering: AngleSteering | None
    shadow: Shadow | None

    def words(self) -> list[str]:
        """What they found, for the summary."""
        out = []
        if self.shadow is not None:
            part = self.shadow.part
            out.append(
                f"shadow: {self.shadow.reports_seen} reports, at most {self.shadow.off_mm:.3f} mm "
                "off the path, "
                f"{max(self.shadow.late_s, 0.0):.1f} s late; folded {100.0 * part.completion():.1f} %, "
                f"{part.shape_rms_mm():.2f} mm rms"
            )
        if self.steering is not None and self.steering.readings:
            made = sum(r.made for r in self.steering.readings)
            planned = sum(r.planned for r in self.steering.readings)
            worst = max(abs(r.measured_deg - r.wanted_deg) for r in self.steering.readings)
            out.append(
                f"measured {len(self.steering.readings)} folds: {made} passes instead of {planned}, at most "
                f"{worst:.1f}° off the plan; a pass is worth {self.steering.gain.value:.2f} of the model's"
            )
        return out


class _Both:
    """Several watches as one."""

    def __init__(self, watches: Sequence[Watch]) -> None:
        self.watches = watches

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        for watch in self.watches:
            watch.begins(block, seconds, t)

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        for watch in self.watches:
            watch.reports(status, place, t)

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        for watch in self.watches:
            watch.confirmed(block, place, t)


def workpiece_of(ws: Workspace, gain: float = 1.0) -> Workpiece:
    """The flat part of a bundle."""
    from twin.workpiece import Workpiece

    return Workpiece(ws.plan, ws.process, ws.rig, ws.material, gain)


def hardware(ws: Workspace, job: Job, *, shadow: bool, measure: str | None, lit: bool) -> Hardware:
    """Set up what looks at a replay.

    Args:
        ws: the bundle.
        job: its job.
        shadow: the twin's shadow follows and stops the machine where it differs.
        measure: ``typed``, ``virtual`` or ``virtual:GAIN`` (emulated machines only), or the URL of a gauge.
        lit: the replay fires.

    Raises:
        UsageError: if ``measure`` makes no sense here.
        MachineError: if the gauge does not answer.
    """
    from twin.shadow import Shadow

    watches: list[Watch] = []
    made: Shadow | None = None
    if shadow:
        made = Shadow(job, ws.rig, workpiece_of(ws), lit)
        watches.append(made)
    steering: AngleSteering | None = None
    if measure is not None:
        from rigs.angle_steering import AngleSteering
        from twin.shadow import VirtualPart

        if not lit:
            raise UsageError("--measure needs --arm: without light nothing folds")
        gauge, part = _gauge(ws, measure)
        if part is not None:
            watches.append(VirtualPart(job, part))
        steering = AngleSteering(job, ws.process, gauge, _accept(ws), told=_into(made))
    watch: Watch | None = _Both(watches) if watches else None
    return Hardware(watch, steering, made)


def _into(shadow: Shadow | None) -> Callable[[int, float], None]:
    """A function that gives the shadow's part the measured angles."""

    def tell(crease: int, angle_rad: float) -> None:
        if shadow is not None:
            shadow.part.angles_rad[crease] = angle_rad

    return tell


def _gauge(ws: Workspace, measure: str) -> tuple[Measure, Workpiece | None]:
    from rigs.measuring import SerialGauge, TypedGauge

    if measure == TYPED:
        if not sys.stdin.isatty():
            raise UsageError("--measure typed needs a terminal on which angles can be typed")
        return TypedGauge(_ask), None
    name, _, text = measure.partition(":")
    if name == VIRTUAL:
        try:
            gain = float(text) if text else 1.0
        except ValueError:
            gain = -1.0
        if not 0.1 <= gain <= 5.0:
            raise UsageError(f"--measure {measure}: expected virtual or virtual:GAIN, such as virtual:0.8")
        part = workpiece_of(ws, gain)
        return (lambda crease, _expected: (_degrees(part, crease), 0.2)), part
    return SerialGauge(measure), None


def _degrees(part: Workpiece, crease: int) -> float:
    import math

    return math.degrees(part.angles_rad.get(crease, 0.0))


def _ask(question: str) -> str:
    sys.stderr.write(question)
    sys.stderr.flush()
    return sys.stdin.readline()


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

    job = read_job(ws.path("job.json"), ws.path("job.gcode"))
    journal = read_journal(path)
    if journal.header.get("job_sha256") != job.sha256:
        raise JobError(f"{path}: the journal of another job")
    part = workpiece_of(ws)
    if journal.header.get("mode") == "arm":
        for number in journal.done:
            block = job.blocks[number]
            if block.kind == "pass":
                part.heat(block.path[0], block.path[-1], block.rotary_rad, block.power_w, block.speed_mm_s)
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
        "creases": rows,
    }
