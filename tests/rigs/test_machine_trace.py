"""Comparing what was lit: the emulated machine does the job, and every kind of deviation is found."""

from __future__ import annotations

import json
import random
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.emulator import start_emulator
from rigs.errors import JobError
from rigs.job import Job
from rigs.machine_trace import (
    MachineTrace,
    compare_traces,
    trace_of_file,
    trace_of_job,
    trace_of_journal,
)
from rigs.replay import replay
from rigs.rig import Rig
from tests.rigs.made_jobs import made


@pytest.fixture(scope="module", params=[("star", "grbl-4axis"), ("box", "galvo-like")], ids=lambda p: p[1])
def played(request, tmp_path_factory) -> tuple[Job, Rig, Path, Path]:
    """A job of a rig and what an emulated machine made of it."""
    goal, name = request.param
    _, _, rig, job = made(goal, name)
    if len(job.blocks) > 500:
        job = replace(job, blocks=job.blocks[:500])
    folder = tmp_path_factory.mktemp("played")
    with start_emulator(name, trace=folder / "trace.jsonl") as machine:
        replay(job, machine.url, rig=rig, journal_path=folder / "journal.jsonl", mode="arm")
    return job, rig, folder / "trace.jsonl", folder / "journal.jsonl"


def test_the_machine_does_the_job(played):
    job, rig, trace, journal = played
    assert compare_traces(trace_of_job(job), trace_of_file(trace, rig), rig) == ()
    assert compare_traces(trace_of_job(job), trace_of_journal(journal, job, rig), rig, job) == ()


def shifted(stroke, dx: float):
    return replace(stroke, start=(stroke.start[0] + dx, *stroke.start[1:]))


MUTATIONS = {
    "missing": (lambda t, k: [*t[:k], *t[k + 1 :]], "strokes"),
    "twice": (lambda t, k: [*t[: k + 1], *t[k:]], "strokes"),
    "moved": (lambda t, k: [*t[:k], shifted(t[k], 0.05), *t[k + 1 :]], "mm apart"),
    "turned": (
        lambda t, k: [*t[:k], replace(t[k], rotary_deg=t[k].rotary_deg + 0.3), *t[k + 1 :]],
        "rotary at",
    ),
    "turning": (lambda t, k: [*t[:k], replace(t[k], turned_deg=1.0), *t[k + 1 :]], "rotary turns"),
    "hotter": (lambda t, k: [*t[:k], replace(t[k], dose_j_mm=1.05 * t[k].dose_j_mm), *t[k + 1 :]], "J/mm"),
    "reversed": (
        lambda t, k: [*t[:k], replace(t[k], start=t[k].end, end=t[k].start), *t[k + 1 :]],
        "mm apart",
    ),
}


@pytest.mark.parametrize("kind", MUTATIONS)
@settings(max_examples=6, deadline=None)
@given(data=st.data())
def test_every_kind_of_deviation_is_found(played, kind, data):
    job, rig, trace, _ = played
    whole = trace_of_file(trace, rig)
    change, word = MUTATIONS[kind]
    k = data.draw(st.integers(0, len(whole.strokes) - 1))
    other = replace(whole, strokes=tuple(change(list(whole.strokes), k)))
    found = compare_traces(trace_of_job(job), other, rig)
    assert found and any(word in text for text in found)


def test_light_at_standstill_is_found(played):
    job, rig, trace, _ = played
    other = replace(trace_of_file(trace, rig), rest_s=0.2)
    assert any("standstill" in text for text in compare_traces(trace_of_job(job), other, rig))


def test_swapped_strokes_and_too_many_differences(played):
    job, rig, trace, _ = played
    strokes = list(trace_of_file(trace, rig).strokes)
    random.Random(1).shuffle(strokes)  # noqa: S311
    found = compare_traces(trace_of_job(job), MachineTrace("mixed", tuple(strokes)), rig)
    assert len(found) == 21 and found[-1] == "and more"


def test_a_journal_that_stopped_is_shorter(played, tmp_path):
    job, rig, _, journal = played
    from rigs.journal import JournalWriter

    records = [json.loads(line) for line in journal.read_text().splitlines()]
    writer = JournalWriter(tmp_path / "short.jsonl", durable=False)
    for record in records[: len(records) // 2]:
        writer.write(record["kind"], **{k: v for k, v in record.items() if k not in ("n", "kind", "hash")})
    writer.close()
    short = trace_of_journal(tmp_path / "short.jsonl", job, rig)
    assert not short.complete
    assert any("strokes" in text for text in compare_traces(trace_of_job(job), short, rig, job))


def test_files_that_are_no_traces(played, tmp_path):
    job, rig, trace, journal = played
    (tmp_path / "x").write_text("hello\n")
    with pytest.raises(JobError, match="not a trace"):
        trace_of_file(tmp_path / "x", rig)
    with pytest.raises(JobError, match="not a trace"):
        trace_of_file(tmp_path / "none", rig)
    with pytest.raises(JobError, match="another job"):
        trace_of_journal(journal, replace(job, hashes={}), rig)
    whole = trace_of_journal(journal, job, rig)
    with pytest.raises(JobError, match="beside its job"):
        compare_traces(whole, whole, rig)
    with pytest.raises(JobError, match="which block"):
        compare_traces(trace_of_file(trace, rig), whole, rig, job)
