"""Plan and process to job: every block in the coordinates of the rig, checked before anything is written."""

from __future__ import annotations

from collections.abc import Mapping

from planner.fold_plan import Cut, Fold, FoldPlan, Polyline, Release, Rotate, Wait
from planner.pattern import Pattern, pattern_of
from planner.pattern_check import pattern_figures
from rigs.block_writer import BlockWriter
from rigs.errors import JobError
from rigs.job import Job
from rigs.material import Material
from rigs.process import Process
from rigs.rig import Rig

__all__ = ["make_job"]


def make_job(
    plan: FoldPlan,
    process: Process,
    rig: Rig,
    material: Material,
    hashes: Mapping[str, str] | None = None,
) -> Job:
    """The blocks that make ``plan`` on ``rig``.

    Fold passes run to and fro, each with a dark run-in and run-out so that the head is at speed over the
    crease; cuts are split into pieces of at most ``rig.laser.max_beam_s`` seconds of beam. The rotary moves
    in blocks of its own, beam off. Cuts and passes lie where the pattern has them, which allows for the
    bends; passes begin and end at the edge of relief holes.

    Args:
        plan: the plan.
        process: settings of its steps.
        rig: the machine.
        material: what the sheet is made of; its hash binds the job.
        hashes: further hashes of what the job was made from, such as ``plan``.

    Raises:
        JobError: if process and plan do not belong together, or a block would leave the travel of an axis,
            exceed the power cap, a speed or a step rate, or hold a figure that is not finite; names step and
            crease.
    """
    pattern = pattern_of(plan)
    builder = _Builder(pattern, process, rig)
    for number, step in enumerate(plan.steps):
        if isinstance(step, (Cut, Release)):
            paths = pattern.paths(step.paths)
            builder.cut(number, paths, step.why if isinstance(step, Cut) else "release the part")
        elif isinstance(step, Rotate):
            builder.rotate(number, step.to_rad)
        elif isinstance(step, Fold):
            builder.fold(number, step)
        elif isinstance(step, Wait):
            builder.dark(number, "wait", step.seconds)
    builder.finish()
    return Job(
        rig_name=rig.name,
        hashes={
            **dict(hashes or {}),
            "rig": rig.sha256,
            "material": material.sha256,
            "process": process.sha256,
        },
        style=builder.style,
        blocks=tuple(builder.blocks),
        notices=tuple(builder.notices),
        pattern=pattern_figures(plan, pattern).to_values(),
    )


class _Builder(BlockWriter):
    """Blocks of the steps of a plan."""

    def __init__(self, pattern: Pattern, process: Process, rig: Rig) -> None:
        super().__init__(rig)
        self.pattern, self.process = pattern, process

    def fold(self, number: int, step: Fold) -> None:
        """All passes of one fold step, to and fro."""
        made = self.process.fold_at.get(number)
        if made is None or made.crease != step.crease:
            raise JobError(
                f"step {number} folds crease {step.crease}, but the process table has "
                f"{'no fold' if made is None else f'crease {made.crease}'} there: it was made for another "
                "plan"
            )
        if made.passes:
            self.passes(
                number, step.crease, self.pattern.creases[step.crease], made.power_w, made.speed_mm_s,
                made.waits_s, f"step {number}, crease {step.crease}",
            )  # fmt: skip

    def cut(self, number: int, paths: tuple[Polyline, ...], why: str) -> None:
        """All paths of one cut step."""
        made = self.process.cut_at.get(number)
        if made is None:
            raise JobError(f"step {number} cuts, but the process table has no cut there: make it anew")
        for index, path in enumerate(paths):
            where = f"step {number}, path {index}"
            self.cuts(number, path, made.power_w, made.speed_mm_s, made.passes, where, why)
