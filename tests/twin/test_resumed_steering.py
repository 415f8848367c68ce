"""A measuring replay that stops anywhere and goes on: same angles, no needless pass, the shadow agrees."""

from __future__ import annotations

import math
from collections import Counter

import pytest

from rigs.angle_steering import AngleSteering
from rigs.emulator import start_emulator
from rigs.errors import MachineError
from rigs.journal import read_journal
from rigs.replay import replay
from rigs.resume import blocks_left, resume_job, standing
from rigs.steering_so_far import so_far
from rigs.watch import Watches
from tests.twin.star_replay import made_star, part_of
from twin.journal_shadow import sheet_shadow
from twin.shadow import Shadow, VirtualPart


@pytest.fixture(scope="module")
def star():
    return made_star()


class StopsAfter:
    """A watch that stops the machine after so many confirmed passes."""

    def __init__(self, passes: int) -> None:
        self.left = passes

    def begins(self, block, seconds, t) -> None:
        """Nothing to do."""

    reports = begins

    def confirmed(self, block, place, t) -> None:
        self.left -= block.kind == "pass"
        if self.left == 0:
            raise MachineError("pulled")


class Gauge:
    """Reads the part; the call number ``breaks`` fails."""

    def __init__(self, part, breaks: int | None = None) -> None:
        self.part, self.calls, self.breaks = part, 0, breaks

    def __call__(self, crease: int, _expected: float) -> tuple[float, float]:
        self.calls += 1
        if self.calls == self.breaks:
            raise MachineError("the gauge fell off")
        return math.degrees(self.part.angles_rad.get(crease, 0.0)), 0.1


def go_on(star, folder, part, first, number: int, stops=None):
    """Resume from the journals so far; returns the new journal."""
    _, process, rig, job = star
    now = standing(first, job)
    left, counted, _ = blocks_left(job, now, "done" if now.doubt else None)
    for k in counted:
        made = job.blocks[k]
        part.heat(made.path[0], made.path[-1], made.rotary_rad, made.power_w, made.speed_mm_s)
    before = sheet_shadow(first, job, rig, part_of(star), counted)
    for crease, angle in part.angles_rad.items():  # what was measured counts, the rest is by the model
        before.part.angles_rad[crease] = angle
    shadow = Shadow(job, rig, before.part, True, steered=True, due=frozenset(left))
    steering = AngleSteering(
        job, process, Gauge(part), lambda *_: True, before=so_far(first, job, counted),
        told=lambda c, a: shadow.part.angles_rad.__setitem__(c, a),
    )  # fmt: skip
    header = {
        "journal": now.journals[-1], "hash": now.last_hash, "done": list(counted), "left_out": [],
        "decision": "done" if counted else None, "emulated": True,
    }  # fmt: skip
    path = folder / f"journal-{number:03d}.jsonl"
    watch = Watches(VirtualPart(job, part), shadow, *([stops] if stops else []))
    with start_emulator() as machine:
        try:
            replay(
                resume_job(job, left), machine.url, rig=rig, journal_path=path, mode="arm", watch=watch,
                steering=steering, resumes=header,
            )  # fmt: skip
        except MachineError as error:
            assert stops is not None and "pulled" in str(error), error
    return read_journal(path)


@pytest.mark.parametrize("gain", [0.8, 1.3])
@pytest.mark.parametrize(("passes", "breaks"), [(3, None), (40, None), (10**6, 1)])
def test_stopped_and_resumed_it_ends_where_it_would_have(star, tmp_path, gain, passes, breaks):
    _, process, rig, job = star
    part = part_of(star, gain)
    steering = AngleSteering(job, process, Gauge(part, breaks), lambda *_: True)
    path = tmp_path / "journal-001.jsonl"
    with start_emulator() as machine, pytest.raises(MachineError, match=r"pulled|fell off"):
        replay(
            job, machine.url, rig=rig, journal_path=path, mode="arm", steering=steering,
            watch=Watches(VirtualPart(job, part), StopsAfter(passes)),
        )  # fmt: skip
    journals = [read_journal(path)]
    journals.append(go_on(star, tmp_path, part, journals, 2, StopsAfter(25)))
    if journals[-1].outcome != "complete":
        journals.append(go_on(star, tmp_path, part, journals, 3))
    assert journals[-1].outcome == "complete"
    for fold in process.folds:
        one_pass = max(abs(x) for x in fold.increments_rad) * max(gain, 1.0)
        assert abs(part.angles_rad[fold.crease] - fold.to_rad) <= 1.01 * one_pass
    reached = Counter(r["step"] for j in journals for r in j.records if r["kind"] == "reached")
    assert reached == {fold.step: 1 for fold in process.folds}
    needless = {k for j in journals for r in j.records if r["kind"] == "reached" for k in r["left_out"]}
    made = Counter(k for j in journals for k in j.done)
    assert not needless & set(made)
    assert needless or gain < 1.0


def test_what_measuring_left_out_is_not_burnt_afterwards(star, tmp_path):
    """The blocks that are left after a measured fold hold none of the passes that it did not need."""
    _, process, rig, job = star
    part = part_of(star, 1.3)
    steering = AngleSteering(job, process, Gauge(part, breaks=3), lambda *_: True)
    path = tmp_path / "journal-001.jsonl"
    with start_emulator() as machine, pytest.raises(MachineError, match="fell off"):
        replay(
            job, machine.url, rig=rig, journal_path=path, mode="arm", steering=steering,
            watch=VirtualPart(job, part),
        )  # fmt: skip
    journal = read_journal(path)
    left, _, _ = blocks_left(job, standing([journal], job))
    steps = {r["step"] for r in journal.records if r["kind"] == "reached"}
    assert steps
    assert not [k for k in left if job.blocks[k].kind == "pass" and job.blocks[k].step in steps]
    found = so_far([journal], job)
    assert found.reached == steps and found.gain is not None
    assert found.gain[0] == pytest.approx(1.3, abs=0.1)
