"""What must be true before and during a replay: hashes, settings, positions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigs.dialects import dialect_mistake
from rigs.errors import JobError, MachineError
from rigs.gate import Gate, split_words
from rigs.identity import Identity
from rigs.job_walk import JobWalk
from rigs.journal import read_journal
from rigs.motion_time import line_seconds
from rigs.replay_blocks import ReplayJob, lit_block
from rigs.rig import Rig

__all__ = [
    "Certificate",
    "check_certificate",
    "check_dry_run",
    "check_identity",
    "check_job",
    "identity_mistakes",
    "position_mistake",
    "travel_seconds",
]

_ROTARY_DEG = 0.1
_LINEAR_MM = 0.01
_REPORT = 0.0006  # status reports have three decimals


@dataclass(frozen=True)
class Certificate:
    """What a validation says, as far as arming needs it.

    Attributes:
        verdict: ``pass`` or the reason why not.
        job_sha256: the job that was validated.
        rig_sha256: the rig that it was validated for.
        material_sha256: the material that it was validated for.
    """

    verdict: str
    job_sha256: str
    rig_sha256: str
    material_sha256: str


def check_job(job: ReplayJob, rig: Rig) -> None:
    """Refuse a job of another rig, with too long a beam block, or with a line that may not pass.

    What a block says about itself is not believed: its lines are walked through (``rigs.job_walk``).

    Raises:
        JobError: saying what does not fit.
    """
    if job.rig_sha256 != rig.sha256:
        raise JobError(
            f"the job was made for another rig (hash {job.rig_sha256[:12] or 'missing'}) than {rig.name} "
            f"({rig.sha256[:12]}): make the job anew for this rig"
        )
    gate, walk = Gate(None, rig), JobWalk(rig)
    gate.level = "armed"
    for block in job.blocks:
        if block.beam_s > rig.laser.max_beam_s + 1e-9:
            raise JobError(
                f"block {block.index} (step {block.step}) burns {block.beam_s:.2f} s, "
                f"{rig.laser.max_beam_s:g} s at most may be in flight on {rig.name}: make the job anew"
            )
        try:
            gate.check(lit_block(block))
            _check_reach(block.lines, rig)
            walk.block(block.lines, block.beam_s)
        except JobError as error:
            raise JobError(f"block {block.index} (step {block.step}): {error}") from error


def _check_reach(lines: Sequence[str], rig: Rig) -> None:
    reach = {"X": rig.axes.x_mm, "Y": rig.axes.y_mm, "Z": rig.axes.z_mm}
    low, high = (angle * rig.rotary.units_per_deg for angle in rig.rotary.range_deg)
    reach[rig.rotary.word] = (-math.inf, math.inf) if rig.rotary.endless else (low, high)
    for line in lines:
        for letter, value in split_words(line) or ():
            low, high = reach.get(letter, (-math.inf, math.inf))
            if not low - _REPORT <= value <= high + _REPORT:
                raise JobError(f"'{line}' leaves the reach of axis {letter}, {low:g} to {high:g}")


def check_certificate(certificate: Certificate | None, job: ReplayJob, rig: Rig) -> None:
    """Arm only what was validated: this job, on this rig, in this material.

    Raises:
        JobError: saying which of them differs.
    """
    if certificate is None:
        raise JobError(
            "a real laser is armed only with a validation of this job: validate it, or do a dry run"
        )
    if certificate.verdict != "pass":
        raise JobError(
            f"the validation of this job says '{certificate.verdict}', not 'pass': it is not armed"
        )
    for name, wanted, have in (
        ("job", job.sha256, certificate.job_sha256),
        ("rig", rig.sha256, certificate.rig_sha256),
        ("material", job.material_sha256, certificate.material_sha256),
    ):
        if not wanted or wanted != have:
            raise JobError(
                f"the validation belongs to another {name} ({have[:12] or 'none'}, this is {wanted[:12]}): "
                "validate again before arming"
            )


def check_dry_run(path: Path | None, job: ReplayJob, rig: Rig) -> None:
    """Where the rig demands it, arm only after a complete dry run of this very job on the real machine.

    Raises:
        JobError: saying what is missing.
    """
    if not rig.safety.require_dry_run:
        return
    if path is None:
        raise JobError(
            f"{rig.name} demands a dry run of this job before it is armed: replay it with --dry-run"
        )
    done = read_journal(path)
    header = done.header
    if (
        header.get("mode") != "dry-run"
        or done.outcome != "complete"
        or done.emulated
        or header.get("job_sha256") != job.sha256
        or header.get("rig_sha256") != rig.sha256
    ):
        raise JobError(
            f"{path}: not the journal of a complete dry run of this job on this machine: do it again"
        )


def check_identity(identity: Identity, rig: Rig, *, armed: bool) -> None:
    """Refuse a controller that is not what the profile says.

    Args:
        identity: answers of the controller.
        rig: the profile.
        armed: True compares every expected setting; otherwise only what moves depend on.

    Raises:
        MachineError: naming the setting, what it is and what the profile expects.
    """
    for mistake in identity_mistakes(identity, rig, armed=armed):
        raise MachineError(mistake)


def identity_mistakes(identity: Identity, rig: Rig, *, armed: bool = True) -> Iterator[str]:
    """Every difference between what a controller says and the profile, in words."""
    if rig.controller.dialect == "marlin" and "[Cap:EMERGENCY_PARSER:1]" not in identity.info:
        yield (
            "this Marlin does not say EMERGENCY_PARSER:1 (M115): a stop would wait behind the motion; "
            "build the firmware with it"
        )
    words = rig.axis_words
    offset = identity.offset("G54")
    if len(offset) != len(words):
        yield (
            f"the controller has {len(offset)} axes, {rig.name} needs {len(words)} ({' '.join(words)}): "
            "wrong firmware"
        )
    if (mistake := dialect_mistake(rig.controller.dialect, identity.info)) is not None:
        yield mistake
    for key, wanted in rig.controller.expect.items():
        have = identity.settings.get(key)
        if (have is None or abs(have - wanted) > 1e-3 * max(1.0, abs(wanted))) and (armed or _moves(key)):
            found = "missing" if have is None else f"{have:g}"
            yield (
                f"setting {key} of the controller is {found}, the profile {rig.name} expects {wanted:g}: "
                "correct the one that is wrong"
            )
    if rig.controller.g54_mm and any(
        abs(a - b) > 0.01 for a, b in zip(offset, rig.controller.g54_mm, strict=False)
    ):
        yield (
            f"the work offset G54 of the controller is {list(offset)}, the profile {rig.name} expects "
            f"{list(rig.controller.g54_mm)}: set it, or correct controller.g54_mm"
        )


def position_mistake(expect: Sequence[tuple[str, float]], place: Mapping[str, float], rig: Rig) -> str | None:
    """What is wrong with a position, in words, or None: within a step or 0.01 mm, and 0.1 degrees."""
    steps = dict(zip("XYZ", rig.axes.steps_per_mm, strict=True))
    for word, wanted in expect:
        if word == rig.rotary.word:
            tolerance, unit = _ROTARY_DEG * rig.rotary.units_per_deg, "deg"
        else:
            tolerance, unit = max(1.0 / steps.get(word, 100.0), _LINEAR_MM), "mm"
        have = place.get(word)
        if have is None or abs(have - wanted) > tolerance + _REPORT:
            shown = "not reported" if have is None else f"{have:.3f} {unit}"
            return f"axis {word} is at {shown}, it should be at {wanted:.3f} {unit}"
    return None


def travel_seconds(rig: Rig, place: Mapping[str, float], expect: Sequence[tuple[str, float]]) -> float:
    """Longest time that a rapid from ``place`` to ``expect`` can take: all axes one after the other."""
    rotary = rig.rotary
    limits = dict(zip("XYZ", zip(rig.axes.max_mm_s, rig.axes.accel_mm_s2, strict=True), strict=True))
    limits[rotary.word] = (
        rotary.max_deg_s * rotary.units_per_deg,
        rotary.accel_deg_s2 * rotary.units_per_deg,
    )
    return sum(
        line_seconds(abs(wanted - place[word]), *limits[word])
        for word, wanted in expect
        if word in place and word in limits
    )


def _moves(key: str) -> bool:
    number = int(key[1:])
    return 100 <= number < 110 or number in (13, 32)
