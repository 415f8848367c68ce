"""Runs of a small job on a fresh emulator, and what its trace says was lit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rigs.emulator import start_emulator
from rigs.journal import Journal, read_journal
from rigs.replay import Mode, replay
from rigs.replay_blocks import ReplayJob
from tests.rigs.replay_jobs import RIG, small_job


def run(
    tmp_path: Path,
    job: ReplayJob | None = None,
    mode: Mode = "arm",
    **emulator: Any,
) -> tuple[Journal, list[dict[str, Any]]]:
    """Replay on a fresh emulator; the journal and the trace of the machine."""
    trace = tmp_path / "trace.jsonl"
    with start_emulator(trace=trace, **emulator) as machine:
        replay(
            job or small_job(),
            machine.url,
            rig=RIG,
            journal_path=tmp_path / "journal.jsonl",
            mode=mode,
            grace_s=1.0,
        )
    return read_journal(tmp_path / "journal.jsonl"), read_trace(trace)


def read_trace(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text("ascii").splitlines()]


def lit(trace: list[dict[str, Any]]) -> list[tuple[tuple[float, ...], tuple[float, ...], float]]:
    return [
        (tuple(r["from"][:2]), tuple(r["to"][:2]), r["s"])
        for r in trace
        if r["kind"] == "move" and r["beam"] != "off"
    ]


def stroke(x0: float, x1: float) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    return ((x0 - 400.0, -150.0), (x1 - 400.0, -150.0), 500.0)


STROKES = [stroke(190, 210), stroke(210, 190), stroke(190, 210), stroke(210, 190)]
