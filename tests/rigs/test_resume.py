"""Going on after a stop: what is left, what is in doubt, and that light touches every stroke once."""

from __future__ import annotations

import contextlib
import json
import math
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.emulator import start_emulator
from rigs.errors import JobError, MachineError
from rigs.gcode import write_gcode
from rigs.job import Job
from rigs.job_build import make_job
from rigs.job_file import write_job
from rigs.journal import Journal, read_journal
from rigs.material import load_material
from rigs.replay import replay
from rigs.replay_blocks import mark_blocks, replay_job
from rigs.resume import Standing, blocks_left, resume_job, standing
from tests.rigs.replay_jobs import RIG
from tests.rigs.replay_runs import read_trace
from tests.twin.hand_plans import box, breadth_first_net, plan_of
from twin.plan_process import plan_process


@pytest.fixture(scope="module")
def job() -> Job:
    material = load_material("304")
    plan = plan_of(breadth_first_net(box(12.0, 16.0, 8.0)))
    whole = make_job(plan, plan_process(plan, RIG, material), RIG, material)
    turns = [k for k, b in enumerate(whole.blocks) if b.kind == "rotate"]
    return replace(whole, blocks=whole.blocks[: max(160, turns[1] + 40)][:400])


def strokes_of(trace: Path) -> list[tuple[float, ...]]:
    """Lit moves of a trace: from x y z, to x y z, rotary and S; those without length are left out."""
    return [
        (*r["from"][:3], *r["to"][:3], r["from"][3], r["s"])
        for r in read_trace(trace)
        if r["kind"] == "move" and r["beam"] != "off" and r["s"]
    ]


def run(job: Job, folder: Path, number: int, plan=None, resumes=None, **emulator) -> Journal:
    """One armed replay on a fresh emulator; the journal, also of one that fails."""
    path = folder / f"journal-{number:03d}.jsonl"
    with (
        start_emulator(trace=folder / f"trace-{number}", **emulator) as machine,
        contextlib.suppress(MachineError),
    ):
        replay(
            plan or replay_job(job), machine.url, rig=RIG, journal_path=path, mode="arm", grace_s=1.0,
            resumes=resumes,
        )  # fmt: skip
    return read_journal(path)


def header_of(now: Standing, counted=(), dropped=(), decision=None) -> dict[str, object]:
    return {
        "journal": now.journals[-1], "hash": now.last_hash, "done": list(counted), "left_out": list(dropped),
        "decision": decision, "emulated": now.emulated,
    }  # fmt: skip


@pytest.fixture(scope="module")
def whole(job: Job, tmp_path_factory: pytest.TempPathFactory) -> list[tuple[float, ...]]:
    folder = tmp_path_factory.mktemp("whole")
    assert run(job, folder, 1).outcome == "complete"
    return strokes_of(folder / "trace-1")


@pytest.mark.parametrize("fault", ["error:9", "alarm:1", "drop", "power", "no-ok", "garble"])
@pytest.mark.parametrize("share", [0.05, 0.4, 0.8])
def test_resumed_runs_together_are_the_job(job, whole, tmp_path, fault, share):
    """Strokes that were confirmed are never burnt again, and none is missing; the doubted one counts as
    done."""
    lines = sum(len(b.lines) for b in replay_job(job).blocks)
    first = run(job, tmp_path, 1, faults=[f"{fault}@{int(share * lines)}"])
    assert first.outcome == "fault"
    now = standing([first], job)
    assert now.begun
    left, counted, dropped = blocks_left(job, now, "done" if now.doubt else None)
    assert not dropped and len(counted) == (now.doubt is not None)
    again = run(job, tmp_path, 2, resume_job(job, left), header_of(now, counted))
    assert again.outcome == "complete"
    after = standing([first, again], job)
    assert not after.begun and after.done == frozenset(range(len(job.blocks)))
    lit = {k for k, b in enumerate(job.blocks) if b.lit}
    burnt = [k for k in first.done if k in lit] + [k for k in again.done if k in lit]
    assert sorted([*burnt, *counted]) == sorted(lit)  # each exactly once
    resumed = strokes_of(tmp_path / "trace-2")
    wanted = whole[len(whole) - len(resumed) :]
    assert len(resumed) == sum(k in left for k in lit)
    for have, want in zip(resumed, wanted, strict=True):
        assert max(abs(a - b) for a, b in zip(have, want, strict=True)) < 0.02


def test_stops_one_after_the_other(job, tmp_path):
    """Five faults in a row: the journals add up to the job, each block once."""
    journals: list[Journal] = []
    plan, header = replay_job(job), None
    lit = {k for k, b in enumerate(job.blocks) if b.lit}
    counted_all: list[int] = []
    for number in range(1, 30):
        faults = [f"error:5@{40 + 30 * number}"] if number < 6 else []
        journals.append(run(job, tmp_path, number, plan, header, faults=faults))
        now = standing(journals, job)
        if not now.begun:
            break
        left, counted, _ = blocks_left(job, now, "done" if now.doubt else None)
        counted_all += counted
        plan, header = resume_job(job, left), header_of(now, counted)
    assert number == 6
    burnt = [k for journal in journals for k in journal.done if k in lit]
    assert sorted([*burnt, *counted_all]) == sorted(lit)


KILL = """
import sys, json
from pathlib import Path
from rigs.job_file import read_job
from rigs.replay import replay
from rigs.rig import load_rig
folder = Path(sys.argv[1])
job = read_job(folder / "job.json", folder / "job.gcode")
print("go", flush=True)
replay(job, sys.argv[2], rig=load_rig("grbl-4axis"), journal_path=folder / "journal-001.jsonl", mode="arm")
"""


def killed(job: Job, folder: Path, after_s: float, scale: float) -> tuple[Journal | None, Path]:
    """A replay in a process of its own, killed with SIGKILL; the emulated machine lives on."""
    write_job(job, folder / "job.json")
    (folder / "job.gcode").write_text(write_gcode(job))
    trace = folder / "trace"
    with start_emulator(trace=trace, time_scale=scale) as machine:
        host = subprocess.Popen(
            [sys.executable, "-c", KILL, str(folder), machine.url], stdout=subprocess.PIPE, cwd=Path.cwd()
        )
        assert host.stdout is not None and host.stdout.readline() == b"go\n"
        time.sleep(after_s)
        host.send_signal(signal.SIGKILL)
        host.wait()
        host.stdout.close()
        time.sleep(0.3)
    path = folder / "journal-001.jsonl"
    return (read_journal(path) if path.exists() and path.stat().st_size else None), trace


@pytest.mark.parametrize("after_s", [0.15, 0.3, 0.5, 0.8])
def test_a_killed_host_leaves_the_beam_off_and_one_doubt_at_most(job, tmp_path, after_s):
    """SIGKILL while blocks run: light ends with the block, the journal tells all but one."""
    journal, trace = killed(job, tmp_path, after_s, scale=200.0)
    records = read_trace(trace)
    assert records[-1].get("rest_beam_s", 0.0) == 0.0  # never lit at standstill
    lit = {k for k, b in enumerate(job.blocks) if b.lit}
    seen = sum(r["kind"] == "move" and r["beam"] != "off" and r["s"] > 0 for r in records)
    if journal is None:
        assert seen == 0
        return
    if journal.outcome == "complete":
        assert seen == len(lit)
        return
    assert journal.outcome == "unfinished"
    now = standing([journal], job)
    sure = len([k for k in now.done if k in lit])
    assert sure <= seen <= sure + (now.doubt is not None)
    if now.doubt is not None:
        assert 0.0 <= now.doubt.least_s <= now.doubt.most_s <= now.doubt.whole_s + 1e-9


@pytest.mark.slow
def test_two_hundred_kills(job, tmp_path):
    """T2 of the machine tests, at 200 instants."""
    import random

    rng = random.Random(0)  # noqa: S311
    for number in range(200):
        folder = tmp_path / str(number)
        folder.mkdir()
        test_a_killed_host_leaves_the_beam_off_and_one_doubt_at_most(job, folder, rng.uniform(0.0, 1.5))


# Standing and decisions, without a machine


def journal_of(
    path: Path, job: Job, done: int, intent: int | None, *, end: str | None, before=None
) -> Journal:
    from rigs.journal import JournalWriter

    writer = JournalWriter(path, durable=False)
    writer.write("header", format="metal-blossom/journal", version=1, mode="arm", emulated=True,
                 job_sha256=job.sha256, resumes=before or {})  # fmt: skip
    for k in range(done):
        writer.write("done", block=k, step=0, t=0.1 * k, at=[0.0])
    if intent is not None:
        writer.write("intent", block=intent, step=0, beam_s=job.blocks[intent].beam_s, t=1.0)
    if end is not None:
        writer.write("end", outcome=end, reason="", t=1.0)
    writer.close()
    return read_journal(path)


def a_pass(job: Job) -> int:
    return next(k for k, b in enumerate(job.blocks) if b.kind == "pass")


def test_a_pass_in_doubt_is_never_burnt_again(job, tmp_path):
    k = a_pass(job)
    now = standing([journal_of(tmp_path / "journal-001.jsonl", job, k, k, end=None)], job)
    assert now.doubt is not None and now.doubt.block == k and now.doubt.kind == "pass"
    assert str(k) in now.doubt.words and "crease" in now.doubt.words
    with pytest.raises(JobError, match="never burnt again"):
        blocks_left(job, now, "redo")
    with pytest.raises(JobError, match="say what becomes of it"):
        blocks_left(job, now)
    left, counted, dropped = blocks_left(job, now, "done")
    assert counted == (k,) and not dropped and left == tuple(range(k + 1, len(job.blocks)))
    left, counted, dropped = blocks_left(job, now, "abandon")
    assert k in dropped and not counted
    assert {job.blocks[i].crease for i in dropped} == {job.blocks[k].crease}
    assert all(job.blocks[i].crease != job.blocks[k].crease for i in left)


def test_measured_passes_are_dropped_whole(job, tmp_path):
    k = a_pass(job)
    now = standing([journal_of(tmp_path / "journal-001.jsonl", job, k, k, end=None)], job)
    same = [i for i, b in enumerate(job.blocks) if b.kind == "pass" and b.step == job.blocks[k].step]
    for passes in range(len(same)):
        left, _, dropped = blocks_left(job, now, "done", passes=passes)
        kept = [i for i in left if i in same]
        assert kept == same[1 : 1 + passes] and set(dropped) == set(same[1 + passes :])


def test_a_stop_that_was_seen_bounds_the_dose(job, tmp_path):
    k = a_pass(job)
    whole = job.blocks[k].beam_s
    seen = standing([journal_of(tmp_path / "journal-001.jsonl", job, k, k, end="fault")], job).doubt
    assert seen is not None and seen.most_s == pytest.approx(min(whole, 0.5))


def test_a_new_sheet_starts_anew_and_other_jobs_do_not_count(job, tmp_path):
    first = journal_of(tmp_path / "journal-001.jsonl", job, 30, None, end="stopped")
    fresh = journal_of(tmp_path / "journal-002.jsonl", job, 2, None, end="stopped")
    assert standing([first, fresh], job).done == {0, 1}
    other = replace(job, hashes={**job.hashes, "plan": "ff" * 32})
    assert standing([first], other).outcome == "new" and not standing([first], other).begun
    assert not standing([], job).begun


def test_journals_that_do_not_belong_together_are_refused(job, tmp_path):
    first = journal_of(tmp_path / "journal-001.jsonl", job, 30, None, end="stopped")
    second = journal_of(
        tmp_path / "journal-002.jsonl", job, 2, None, end="stopped",
        before={"journal": "journal-007.jsonl", "hash": "0" * 64, "done": [], "left_out": []},
    )  # fmt: skip
    with pytest.raises(JobError, match="do not belong together"):
        standing([first, second], job)


def test_an_edited_journal_is_refused(job, tmp_path):
    path = tmp_path / "journal-001.jsonl"
    journal_of(path, job, 30, None, end="stopped")
    text = path.read_text()
    path.write_text(text.replace('"block":7', '"block":8'))
    with pytest.raises(JobError, match="hash chain"):
        read_journal(path)


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_every_block_begins_where_the_machine_stands(job, data):
    """Any set of blocks that is left: dark moves bring head and rotary to where each block begins."""
    left = data.draw(st.sets(st.integers(0, len(job.blocks) - 1), min_size=1, max_size=40))
    plan = resume_job(job, left)
    head, *middle, tail = plan.blocks
    assert [b.index for b in middle if b.index >= 0] == sorted(left)
    assert head.kind == "head" and tail.kind == "tail" and plan.sha256 == job.sha256
    place: dict[str, float] = {}
    for block in middle:
        if block.index < 0:
            assert block.beam_s == 0.0 and block.kind in ("goto", "rotate")
        elif block.index > 0:
            before = job.blocks[block.index]
            assert (place["X"], place["Y"], place["Z"]) == pytest.approx(before.start, abs=1e-9)
            if block.kind != "rotate":
                assert place["A"] == pytest.approx(math.degrees(before.rotary_rad), abs=1e-3)
        place |= dict(block.expect)


def test_it_does_not_go_on_in_another_kind_of_machine(job, tmp_path):
    now = standing([journal_of(tmp_path / "journal-001.jsonl", job, 30, None, end="stopped")], job)
    header = {**header_of(now), "emulated": False}
    left, _, _ = blocks_left(job, now)
    with start_emulator() as machine, pytest.raises(JobError, match="cannot go on here"):
        replay(
            resume_job(job, left),
            machine.url,
            rig=RIG,
            journal_path=tmp_path / "j",
            mode="arm",
            resumes=header,
        )
    assert not (tmp_path / "j").exists()


def test_the_pilot_runs_over_the_marks(job, tmp_path):
    marked = replace_marks(((-40.0, 30.0), (40.0, 30.0)))
    blocks = mark_blocks(marked)
    assert len(blocks) == (2 if marked.laser.pilot.kind != "none" else 0)
    assert not mark_blocks(RIG)  # the shipped rig declares no marks
    trace = tmp_path / "trace"
    small = replay_job(job)
    plan = type(small)(small.blocks, small.sha256, marked.sha256, small.material_sha256)
    with start_emulator(trace=trace) as machine:
        journal = replay(plan, machine.url, rig=marked, journal_path=tmp_path / "j", mode="arm", marks=blocks)
    looked = [r for r in journal.records if r["kind"] == "mark"]
    assert len(looked) == len(blocks)
    first = next(i for i, r in enumerate(journal.records) if r["kind"] == "state" and r["state"] == "armed")
    assert all(journal.records.index(r) < first for r in looked)


def replace_marks(marks: tuple[tuple[float, float], ...]):
    import msgspec

    return msgspec.structs.replace(RIG, sheet=msgspec.structs.replace(RIG.sheet, fiducials_mm=marks))


def test_the_header_says_what_it_goes_on_from(job, tmp_path):
    first = run(job, tmp_path, 1, faults=["error:9@60"])
    now = standing([first], job)
    left, counted, _ = blocks_left(job, now, "done" if now.doubt else None)
    again = run(job, tmp_path, 2, resume_job(job, left), header_of(now, counted))
    assert (
        again.header["resumes"]["hash"]
        == json.loads((tmp_path / "journal-001.jsonl").read_text().splitlines()[-1])["hash"]
    )
