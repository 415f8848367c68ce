"""What measuring replays of a sheet have made and found, by their journals: where steering goes on."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from rigs.job import Job
from rigs.journal import Journal
from rigs.resume import pass_groups

__all__ = ["SoFar", "so_far"]


@dataclass(frozen=True)
class SoFar:
    """Where measuring stands on a sheet.

    Attributes:
        done: blocks that were confirmed or count as done.
        passes: plan step → passes that were made, repeated ones among them.
        angles_deg: crease → angle at the end of its last finished step.
        reached: plan steps whose crease was measured and is where it should be.
        gain: running correction (value, variance), None if nothing was measured.
    """

    done: frozenset[int] = frozenset()
    passes: Mapping[int, int] = field(default_factory=dict)
    angles_deg: Mapping[int, float] = field(default_factory=dict)
    reached: frozenset[int] = frozenset()
    gain: tuple[float, float] | None = None

    def open_step(self, job: Job) -> int | None:
        """The fold step whose passes were all made but whose crease was not measured at its end, if any."""
        lit = [k for k in self.done if job.blocks[k].kind == "pass"]
        if not lit:
            return None
        step = job.blocks[max(lit)].step
        last = pass_groups(job, step)[-1][-1]
        return step if last in self.done and step not in self.reached else None


def so_far(journals: Sequence[Journal], job: Job, counted: Collection[int] = ()) -> SoFar:
    """Read the journals of a sheet, oldest first.

    Args:
        journals: of this job and sheet.
        job: the job.
        counted: blocks that count as done by decision.
    """
    strokes = Counter[int](counted)
    angles: dict[int, float] = {}
    reached: set[int] = set()
    gain: tuple[float, float] | None = None
    for journal in journals:
        strokes.update(journal.done)
        strokes.update((journal.header.get("resumes") or {}).get("done", ()))
        for record in journal.records:
            if record["kind"] == "measured" and "gain" in record:
                gain = float(record["gain"]), float(record["variance"])
            elif record["kind"] == "reached":
                angles[int(record["crease"])] = float(record["deg"])
                reached.add(int(record["step"]))
    passes: dict[int, int] = {}
    for step in {job.blocks[k].step for k in strokes if job.blocks[k].kind == "pass"}:
        groups = pass_groups(job, step)
        passes[step] = sum(strokes[group[0]] for group in groups)
    return SoFar(frozenset(strokes), passes, angles, frozenset(reached), gain)
