"""What was lit, in order: by a job, an emulated machine or a journal; and how two of these differ."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rigs.errors import JobError
from rigs.job import Job
from rigs.journal import read_journal
from rigs.rig import Rig

__all__ = [
    "DOSE_SHARE", "LINEAR_MM", "ROTARY_DEG", "MachineTrace", "Stroke", "compare_traces",
    "trace_of_file", "trace_of_job", "trace_of_journal",
]  # fmt: skip

LINEAR_MM, ROTARY_DEG, DOSE_SHARE = 0.01, 0.1, 0.02
"""Largest differences that two traces of the same job may have; a step of the axis if that is more than
LINEAR_MM."""

_MOST_TOLD = 20


@dataclass(frozen=True)
class Stroke:
    """A straight move with light.

    Attributes:
        start: x, y, z in work coordinates, mm; NaN where it is not known.
        end: the same.
        rotary_deg: angle of the rotary at its start.
        turned_deg: how far the rotary turned during it.
        dose_j_mm: laser energy per length, J/mm; NaN where it is not known.
        block: index of its block in the job, -1 if not known.
        crease: net edge, -1 for cuts or if not known.
    """

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    rotary_deg: float
    turned_deg: float
    dose_j_mm: float
    block: int = -1
    crease: int = -1

    @property
    def length(self) -> float:
        """Length, mm."""
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class MachineTrace:
    """Everything that was lit.

    Attributes:
        name: where it comes from.
        strokes: in order.
        rest_s: seconds of light at standstill.
        complete: False for a journal of a replay that stopped.
        ends_only: True where only the ends of blocks are known (a journal).
    """

    name: str
    strokes: tuple[Stroke, ...]
    rest_s: float = 0.0
    complete: bool = True
    ends_only: bool = field(default=False)


def trace_of_job(job: Job, name: str = "job") -> MachineTrace:
    """What a job asks for."""
    strokes = [
        Stroke(
            a, b, math.degrees(block.rotary_rad), 0.0, block.power_w / block.speed_mm_s, number, block.crease
        )
        for number, block in enumerate(job.blocks)
        if block.lit
        for a, b in itertools.pairwise(block.path)
        if a != b
    ]
    return MachineTrace(name, tuple(strokes))


def trace_of_file(path: Path, rig: Rig) -> MachineTrace:
    """The trace file of the emulated machine (``start_emulator(trace=…)``).

    Raises:
        JobError: if it cannot be read or is no trace.
    """
    offset = rig.controller.g54_mm or (0.0, 0.0, 0.0, 0.0)
    strokes, rest_s = [], 0.0
    try:
        for line in path.read_text("ascii").splitlines():
            record = json.loads(line)
            if record["kind"] == "move" and record["beam"] != "off" and record["s"] > 0.0:
                strokes.append(_stroke(record, offset, rig))
            elif record["kind"] == "end":
                rest_s = float(record["rest_beam_s"])
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise JobError(f"{path}: not a trace of the emulated machine: {error}") from error
    return MachineTrace(path.name, tuple(strokes), rest_s)


def _stroke(record: dict[str, list[float]], offset: Sequence[float], rig: Rig) -> Stroke:
    ends = []
    for key in ("from", "to"):
        x, y, z = (float(record[key][i]) - offset[i] for i in range(3))
        ends.append((x, y, z))
    index = rig.axis_words.index(rig.rotary.word)
    turn = [float(record[key][index]) - offset[index] for key in ("from", "to")]
    units = rig.rotary.units_per_deg * rig.rotary.sign
    if rig.rotary.word == "Z":  # a swapped plug: the focus is fixed
        height = rig.rotary.axis_point_mm[2]
        ends = [(x, y, height) for x, y, _ in ends]
    speed = float(record["feed"])  # type: ignore[arg-type]
    dose = rig.laser.power_for_s(float(record["s"])) / speed if speed > 0.0 else math.inf  # type: ignore[arg-type]
    return Stroke(ends[0], ends[1], turn[0] / units, (turn[1] - turn[0]) / units, dose)


def trace_of_journal(path: Path, job: Job, rig: Rig) -> MachineTrace:
    """The lit blocks that a machine confirmed, by its journal: where each ended, and in which order.

    Raises:
        JobError: if the journal cannot be read, was edited, or belongs to another job.
    """
    journal = read_journal(path)
    if journal.header.get("job_sha256") != job.sha256:
        raise JobError(f"{path}: the journal of another job")
    if journal.header.get("mode") != "arm":
        raise JobError(f"{path}: the journal of a replay without light ({journal.header.get('mode')})")
    words = rig.axis_words
    nan = math.nan
    strokes = []
    for record in journal.records:
        number = record.get("block", -1)
        if record["kind"] != "done" or not 0 <= number < len(job.blocks) or not job.blocks[number].lit:
            continue
        place = dict(zip(words, record["at"], strict=False))
        z = rig.rotary.axis_point_mm[2] if rig.rotary.word == "Z" else place.get("Z", nan)
        turn = place.get(rig.rotary.word, nan) / (rig.rotary.units_per_deg * rig.rotary.sign)
        end = (place.get("X", nan), place.get("Y", nan), z)
        strokes.append(Stroke((nan, nan, nan), end, turn, 0.0, nan, number, job.blocks[number].crease))
    return MachineTrace(path.name, tuple(strokes), 0.0, journal.outcome == "complete", ends_only=True)


def compare_traces(
    wanted: MachineTrace, got: MachineTrace, rig: Rig, job: Job | None = None
) -> tuple[str, ...]:
    """Every way in which ``got`` differs from ``wanted``, in words; empty if they are the same.

    Same order, places within ``LINEAR_MM`` or a step, the rotary within ``ROTARY_DEG`` and at rest, the
    dose of each
    stroke and of each crease within ``DOSE_SHARE``, no light at standstill.

    Args:
        wanted: such as the job.
        got: such as what the machine did.
        rig: for the size of a step.
        job: needed where one of them is a journal.

    Raises:
        JobError: if one is a journal and ``job`` is missing.
    """
    differences = list(itertools.islice(_differences(wanted, got, rig, job), _MOST_TOLD + 1))
    if len(differences) > _MOST_TOLD:
        differences[-1] = "and more"
    return tuple(differences)


def _differences(wanted: MachineTrace, got: MachineTrace, rig: Rig, job: Job | None) -> Iterator[str]:
    for trace in (wanted, got):
        if trace.rest_s > 0.0:
            yield f"{trace.name}: {trace.rest_s:.3g} s of light at standstill"
        for number, stroke in enumerate(trace.strokes):
            if abs(stroke.turned_deg) > 1e-6:
                turned = f"the rotary turns {stroke.turned_deg:.3g}° with the light on"
                yield f"{trace.name}, stroke {number}: {turned}"
    if wanted.ends_only or got.ends_only:
        if job is None:
            raise JobError("a journal can be compared only beside its job")
        wanted, got = (_block_ends(trace, job) for trace in (wanted, got))
    if len(wanted.strokes) != len(got.strokes):
        yield f"{got.name} has {len(got.strokes)} strokes, {wanted.name} {len(wanted.strokes)}"
    tolerance = max(LINEAR_MM, *(1.0 / s for s in rig.axes.steps_per_mm))
    for number, (a, b) in enumerate(zip(wanted.strokes, got.strokes, strict=False)):
        where = f"stroke {number}" + (f" (block {a.block})" if a.block >= 0 else "")
        if a.block >= 0 and b.block >= 0 and a.block != b.block:
            yield f"{where}: {got.name} has block {b.block} here: another order"
            return
        off = max(_apart(a.start, b.start), _apart(a.end, b.end))
        if off > tolerance:
            yield f"{where}: {off:.3f} mm apart, {tolerance:g} are allowed"
        if abs(a.rotary_deg - b.rotary_deg) > ROTARY_DEG:
            yield f"{where}: rotary at {b.rotary_deg:.2f}° instead of {a.rotary_deg:.2f}°"
        if abs(b.dose_j_mm - a.dose_j_mm) > DOSE_SHARE * a.dose_j_mm:
            yield f"{where}: {b.dose_j_mm:.4g} J/mm instead of {a.dose_j_mm:.4g}"
    yield from _doses(wanted, got)


def _apart(a: tuple[float, float, float], b: tuple[float, float, float]) -> float:
    """Distance; 0 where one of them is not known."""
    apart = math.dist(a, b)
    return 0.0 if math.isnan(apart) else apart


def _block_ends(trace: MachineTrace, job: Job) -> MachineTrace:
    """One stroke per lit block, of which only the end counts (after its dark run-out)."""
    if trace.ends_only:
        return trace
    last: dict[int, Stroke] = {stroke.block: stroke for stroke in trace.strokes}
    if -1 in last:
        raise JobError(
            f"{trace.name} does not say which stroke belongs to which block: compare it with the job"
        )
    nan = math.nan
    strokes = tuple(
        Stroke((nan, nan, nan), job.blocks[k].end, s.rotary_deg, 0.0, nan, k, s.crease)
        for k, s in sorted(last.items())
    )
    return MachineTrace(trace.name, strokes, trace.rest_s, trace.complete, ends_only=True)


def _doses(wanted: MachineTrace, got: MachineTrace) -> Iterator[str]:
    """Energy per crease; strokes of a trace that does not know its creases are told by order."""
    if wanted.ends_only or got.ends_only or len(wanted.strokes) != len(got.strokes):
        return
    energy: dict[int, list[float]] = {}
    for a, b in zip(wanted.strokes, got.strokes, strict=True):
        pair = energy.setdefault(max(a.crease, b.crease), [0.0, 0.0])
        pair[0] += a.dose_j_mm * a.length
        pair[1] += b.dose_j_mm * b.length
    for crease, (a_j, b_j) in sorted(energy.items()):
        if abs(b_j - a_j) > DOSE_SHARE * max(a_j, 1e-12):
            what = f"crease {crease}" if crease >= 0 else "cuts"
            yield f"{what}: {b_j:.4g} J instead of {a_j:.4g} J"
