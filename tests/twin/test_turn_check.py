"""T21: a turn that the part as folded now would not survive is refused before it is sent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from planner.clearance import check_rotation_clearance
from rigs.emulator import start_emulator
from rigs.errors import JobError
from rigs.journal import read_journal
from rigs.replay import replay
from rigs.replay_blocks import replay_job
from rigs.watch import Watches
from tests.rigs.replay_runs import lit, read_trace
from tests.twin.star_replay import made_star, part_of
from twin.shadow import VirtualPart
from twin.turn_check import TurnCheck


@pytest.fixture(scope="module")
def star():
    return made_star()


class Folded(TurnCheck):
    """Looks at the turns of the folded part only: the flat one reaches farther."""

    def begins(self, block, seconds, t) -> None:
        if len(self.angles_rad()) >= 2:
            super().begins(block, seconds, t)


def narrow(plan):
    """The plan in a strip of sheet along the rotary axis, so that the part reaches farther than its sheet."""
    squeeze = np.array([1.0, 0.02])
    sheet = plan.sheet
    return replace(
        plan, sheet=replace(sheet, outline=sheet.outline * squeeze, vertices=sheet.vertices * squeeze)
    )


def tight(star, room_mm: float):
    """The star's plan over a bed that leaves so much room under the turning part as planned."""
    plan, _, _, job = star
    plan = narrow(plan)
    folded = {}
    check = Folded(plan, job, lambda: folded)
    for block in replay_job(job).blocks:
        if block.kind == "pass":
            folded[job.blocks[block.index].crease] = float(plan.final_angles[job.blocks[block.index].crease])
        check.begins(block, 0.0, 0.0)
    lowest = check.least_mm
    assert check.turns >= 2 and lowest > 0.0
    limits = replace(plan.limits, axis_height=plan.limits.axis_height - lowest + room_mm)
    return replace(plan, limits=limits)


def test_the_plan_itself_turns_with_room(star):
    plan, _, _, job = star
    assert check_rotation_clearance(plan) == []
    part = part_of(star)
    check = TurnCheck(plan, job, lambda: part.angles_rad)
    follow = VirtualPart(job, part)
    for block in replay_job(job).blocks:
        check.begins(block, 0.0, 0.0)
        follow.confirmed(block, {}, 0.0)
    assert check.turns == sum(b.kind == "rotate" for b in job.blocks)


@pytest.mark.parametrize(("gain", "refused"), [(1.0, False), (0.6, True)])
def test_a_part_that_bends_less_is_not_turned_into_the_bed(star, tmp_path, gain, refused):
    _, _, rig, job = star
    plan = tight(star, 0.05)
    part = part_of(star, gain)
    check = Folded(plan, job, lambda: part.angles_rad)
    path, trace = tmp_path / "journal.jsonl", tmp_path / "trace"

    def run() -> None:
        with start_emulator(trace=trace) as machine:
            replay(
                job, machine.url, rig=rig, journal_path=path, mode="arm",
                watch=Watches(VirtualPart(job, part), check),
            )  # fmt: skip

    if not refused:
        run()
        assert read_journal(path).outcome == "complete"
        assert 0.0 <= check.least_mm < 0.2
        return
    with pytest.raises(JobError, match=r"turn refused in block \d+ .* into the bed"):
        run()
    journal = read_journal(path)
    assert journal.outcome == "stopped" and journal.in_doubt is None
    stopped = max(journal.done) + 1
    assert job.blocks[stopped].kind == "rotate"
    assert len(lit(read_trace(trace))) >= sum(b.lit for b in job.blocks[:stopped])
    records = [r for r in read_trace(trace) if r["kind"] == "move"]
    last = max(r["t1"] for r in records if r["beam"] != "off")
    assert not [r for r in records if r["t0"] > last and r["from"][3] != r["to"][3]], "it was not turned"


def test_angles_of_the_part_count_not_those_of_the_plan(star):
    plan, _, _, job = star
    plan = narrow(plan)
    far = TurnCheck(plan, job, lambda: {k: 0.5 * np.pi * np.sign(a) for k, a in enumerate(plan.final_angles)})
    flat = TurnCheck(plan, job, dict)
    for block in replay_job(job).blocks:
        far.begins(block, 0.0, 0.0)
        flat.begins(block, 0.0, 0.0)
    assert abs(far.least_mm - flat.least_mm) > 1.0
