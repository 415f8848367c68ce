"""Replays against the emulator: what is lit, in which order, and what is told."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any

import pytest

from rigs.emulator import start_emulator
from rigs.journal import Journal, read_journal
from rigs.replay import Progress, replay
from rigs.replay_blocks import PlainBlock, ReplayJob
from rigs.rig import load_rig
from tests.rigs.replay_jobs import RIG, small_job
from tests.rigs.replay_runs import STROKES, lit, read_trace, run


def test_armed_replay_lights_exactly_the_strokes_of_the_job(tmp_path: Path) -> None:
    journal, trace = run(tmp_path)
    assert journal.outcome == "complete"
    assert journal.done[-1] == max(b.index for b in small_job().blocks)
    assert journal.in_doubt is None
    assert journal.emulated
    assert journal.header["machine"] == "EMULATED"
    assert lit(trace) == STROKES
    assert trace[-1]["rest_beam_s"] == 0.0
    turns = [r for r in trace if r["kind"] == "move" and r["from"][3] != r["to"][3]]
    assert len(turns) == 1
    assert turns[0]["beam"] == "off"


def test_dry_run_makes_the_same_moves_in_the_dark(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    _, armed = run(tmp_path / "a")
    journal, dark = run(tmp_path / "b", mode="dry-run")
    assert journal.outcome == "complete"
    assert lit(dark) == []
    assert dark[-1]["beam_s"] == 0.0

    def path(trace: list[dict[str, Any]]) -> list[Any]:
        return [(r["from"], r["to"]) for r in trace if r["kind"] == "move"]

    assert path(dark) == path(armed)
    assert not any("M3" in r["text"] or "M4" in r["text"] for r in dark if r["kind"] == "line")
    assert dark[-1]["t"] < armed[-1]["t"] - 2.5, "the wait is left out"


def test_frame_traces_the_rectangle_in_the_dark(tmp_path: Path) -> None:
    journal, trace = run(tmp_path, mode="frame")
    assert journal.outcome == "complete"
    assert lit(trace) == []
    assert [r["text"] for r in trace if r["kind"] == "line"].count("M8") == 4
    xs = [r["to"][0] + 400.0 for r in trace if r["kind"] == "move"][-4:]
    assert (min(xs), max(xs)) == (190.0, 210.0)


def test_intent_precedes_light_and_done_follows_it(tmp_path: Path) -> None:
    journal, _ = run(tmp_path)
    state: dict[int, str] = {}
    beams = {b.index for b in small_job().blocks if b.beam_s > 0.0}
    for record in journal.records:
        if record["kind"] == "intent":
            assert record["block"] in beams
            state[record["block"]] = "intent"
        elif record["kind"] == "done" and record["block"] in beams:
            assert state[record["block"]] == "intent"
            state[record["block"]] = "done"
    assert state == dict.fromkeys(beams, "done")


def test_progress_counts_to_the_end_and_its_exception_stops_the_machine(tmp_path: Path) -> None:
    seen: list[Progress] = []
    with start_emulator() as machine:
        replay(
            small_job(),
            machine.url,
            rig=RIG,
            journal_path=tmp_path / "a",
            mode="arm",
            on_progress=seen.append,
        )
    assert [p.block for p in seen] == list(range(1, len(small_job().blocks) + 1))
    assert seen[-1].left_s == 0.0
    assert all(p.emulated for p in seen)

    def fail(progress: Progress) -> None:
        if progress.block == 4:
            raise RuntimeError("display broke")

    trace = tmp_path / "trace"
    with start_emulator(trace=trace) as machine, pytest.raises(RuntimeError, match="display broke"):
        replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "b", mode="arm", on_progress=fail)
    assert read_journal(tmp_path / "b").outcome == "fault"
    assert len(lit(read_trace(trace))) == 2


def test_replay_from_another_thread(tmp_path: Path) -> None:
    results: list[Journal] = []
    with start_emulator() as machine:
        thread = threading.Thread(
            target=lambda: results.append(
                replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "j", mode="arm")
            )
        )
        thread.start()
        thread.join(timeout=20)
    assert results[0].outcome == "complete"


@pytest.mark.parametrize("name", ["grbl-diode-swap", "galvo-like"])
def test_other_rigs_replay_too(tmp_path: Path, name: str) -> None:
    rig = load_rig(name)
    x, y, z = rig.rotary.axis_point_mm
    here, word = (("X", x), ("Y", y)), rig.rotary.word
    focus = f"Z{z:g}" if rig.has_focus_axis else ""
    blocks = (
        PlainBlock(-1, "head", ("G21", "G90", "G94", "G17", "G54", "M5 S0")),
        PlainBlock(0, "goto", (f"G0X{x:g}Y{y:g}{focus}", "G4P0.01"), seconds=3.0, expect=here),
        PlainBlock(1, "rotate", (f"G0{word}180", "G4P1"), seconds=9.0, expect=((word, 180.0),)),
        PlainBlock(2, "pass", ("M4S0", f"G1X{x + 9:g}F600S500", "M5", "G4P0.01"), beam_s=0.9, seconds=1.0),
        PlainBlock(-1, "tail", ("M5 S0", "M2")),
    )  # fmt: skip
    job = ReplayJob(blocks, "a" * 64, rig.sha256, "c" * 64)
    trace = tmp_path / "trace"
    with start_emulator(name, trace=trace) as machine:
        journal = replay(job, machine.url, rig=rig, journal_path=tmp_path / "j", mode="arm")
    assert journal.outcome == "complete"
    assert len(lit(read_trace(trace))) == 1
    assert read_trace(trace)[-1]["rest_beam_s"] == 0.0
