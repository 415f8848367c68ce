"""T1: five thousand blocks with turns of the sheet, all confirmed in order, and lit as the job says."""

from __future__ import annotations

import dataclasses
import itertools

import pytest

from rigs.replay_blocks import PlainBlock
from tests.rigs.fault_runs import same, simulated, strokes
from tests.rigs.replay_jobs import RIG, small_job


def long_job(count: int):
    """Passes of 2 mm to and fro, and a half turn after every fifth of them."""
    job = small_job(0)
    head, goto = job.blocks[:2]
    blocks = [head, goto]
    places = []
    for number in range(count):
        turned = 180.0 if number // (count // 5) % 2 else 0.0
        if number and number % (count // 5) == 0:
            blocks.append(
                PlainBlock(
                    len(blocks) - 1, "rotate", (f"G0A{turned:g}", "G4P0.5"), seconds=4.0, step=0,
                    expect=(("A", turned),),
                )
            )  # fmt: skip
        x0, x1 = (190.0, 192.0) if number % 2 == 0 else (192.0, 190.0)
        lines = ("M4S0", f"G1X{x1:g}Y150F6000S500", "M5", "G4P0.01")
        place = (("X", x1), ("Y", 150.0), ("A", turned))
        blocks.append(
            PlainBlock(len(blocks) - 1, "pass", lines, beam_s=0.05, seconds=0.1, step=1, expect=place)
        )
        places.append((x0, 150.0, 120.0, x1, 150.0, 120.0, turned))
    blocks.append(job.blocks[-1])
    return dataclasses.replace(job, blocks=tuple(blocks)), places


@pytest.mark.parametrize("count", [300, pytest.param(5000, marks=pytest.mark.slow)])
def test_all_of_them_once_and_in_order(tmp_path, count):
    job, wanted = long_job(count)
    run = simulated(job, tmp_path / "journal.jsonl")
    assert run.error is None, run.error
    assert run.journal is not None and run.journal.outcome == "complete"
    assert run.journal.done == tuple(b.index for b in job.blocks if b.index >= 0)
    lit = strokes(run)
    assert len(lit) == count
    assert all(same(a, b) for a, b in zip(lit, wanted, strict=True))
    assert not [r for r in run.records if r["kind"] == "rest" and r["s"] > 0.0]
    turning = [r for r in run.records if r["kind"] == "move" and r["from"][3] != r["to"][3]]
    assert turning and all(r["beam"] == "off" for r in turning)
    assert all(a["t1"] <= b["t0"] + 1e-6 for a, b in itertools.pairwise(run.lit))
    assert RIG.rotary.word == "A"
