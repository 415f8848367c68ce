"""A job from plan and process, replayed: the machine does what the job says, stroke by stroke."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.job import Job
from rigs.job_build import make_job
from rigs.journal import Journal
from rigs.material import load_material
from rigs.replay import replay
from tests.rigs.replay_jobs import RIG
from tests.twin.hand_plans import box, breadth_first_net, plan_of
from twin.plan_process import plan_process


@pytest.fixture(scope="module")
def job() -> Job:
    material = load_material("304")
    plan = plan_of(breadth_first_net(box(12.0, 16.0, 8.0)))
    return make_job(plan, plan_process(plan, RIG, material), RIG, material)


@pytest.fixture(scope="module")
def replayed(job: Job, tmp_path_factory: pytest.TempPathFactory) -> tuple[Journal, list[dict[str, object]]]:
    folder: Path = tmp_path_factory.mktemp("replay")
    with start_emulator(trace=folder / "trace") as machine:
        journal = replay(job, machine.url, rig=RIG, journal_path=folder / "journal", mode="arm")
    return journal, [json.loads(line) for line in (folder / "trace").read_text("ascii").splitlines()]


def test_every_block_is_confirmed_in_order(
    job: Job, replayed: tuple[Journal, list[dict[str, object]]]
) -> None:
    assert replayed[0].outcome == "complete"
    assert replayed[0].done == tuple(range(len(job.blocks)))


def test_lit_moves_are_the_strokes_of_the_job(
    job: Job, replayed: tuple[Journal, list[dict[str, object]]]
) -> None:
    offset = RIG.controller.g54_mm
    lit = [r for r in replayed[1] if r["kind"] == "move" and r["beam"] != "off"]
    strokes = [(b, a, c) for b in job.blocks if b.lit for a, c in zip(b.path, b.path[1:], strict=False)]
    moved = [r for r in lit if r["s"]]
    assert len(moved) == len(strokes)
    for record, (block, start, end) in zip(moved, strokes, strict=True):
        for have, want in ((record["from"], start), (record["to"], end)):
            place = [h - o for h, o in zip(have[:3], offset[:3], strict=True)]  # type: ignore[index]
            assert math.dist(place, want) < 0.01
        assert record["from"][3] == record["to"][3] == pytest.approx(math.degrees(block.rotary_rad), abs=0.1)  # type: ignore[index]
        dose = RIG.laser.power_for_s(record["s"]) / record["feed"]  # type: ignore[arg-type, operator]
        assert dose == pytest.approx(block.power_w / block.speed_mm_s, rel=0.02)


def test_the_rotary_stands_still_and_nothing_burns_outside_beam_blocks(
    job: Job, replayed: tuple[Journal, list[dict[str, object]]]
) -> None:
    end = replayed[1][-1]
    assert end["rest_beam_s"] == 0.0
    assert end["beam_s"] == pytest.approx(job.beam_s, rel=0.02)


def test_planned_time_is_the_time_that_the_machine_takes(
    job: Job, replayed: tuple[Journal, list[dict[str, object]]]
) -> None:
    lines = [r for r in replayed[1] if r["kind"] == "line"]
    start = next(r["t"] for r in lines if r["text"] == "G54")
    assert replayed[1][-1]["t"] - start == pytest.approx(job.seconds, rel=0.05)  # type: ignore[operator]
