"""A small job, replays of it in simulated time under harm, and what must hold whatever the harm was."""

from __future__ import annotations

import contextlib
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest import mock

from rigs.arming import Arming
from rigs.block_writer import gcode_style
from rigs.errors import JobError, MachineError
from rigs.grbl import Status
from rigs.job import Block, Job, MachinePoint
from rigs.journal import Journal, read_journal
from rigs.motion_time import line_seconds
from rigs.replay import Mode, replay
from rigs.replay_blocks import ReplayBlock, ReplayJob, light_of, lit_block, replay_job
from rigs.resume import Standing, blocks_left, resume_job, standing
from rigs.rig import Rig
from tests.rigs.replay_jobs import RIG
from tests.rigs.simulated_link import Clock, Harm, HostKilled, SimulatedLink, machine_for, records_of

Lit = tuple[float, ...]
JOB_RIG = RIG
OFFSET = RIG.controller.g54_mm


def fault_job(rig: Rig = RIG) -> Job:
    """Cuts, passes to and fro on two creases, both sides of the sheet: every kind of block, 21 of them."""
    x0, y0, z0 = rig.rotary.axis_point_mm
    blocks: list[Block] = []
    place: MachinePoint = (x0, y0, z0)
    turned = 0.0

    def add(kind: Any, end: MachinePoint, **more: Any) -> None:
        nonlocal place
        blocks.append(Block(kind, more.pop("step"), place, more.pop("path", ()), end, turned, **more))
        place = end

    def goto(end: MachinePoint, step: int) -> None:
        add(
            "goto", end, step=step, seconds=0.01 + line_seconds(max(math.dist(place, end), 1e-9), 20.0, 200.0)
        )

    def turn(to: float, step: int) -> None:
        nonlocal turned
        seconds = line_seconds(math.degrees(abs(to - turned)), 60.0, 360.0) + 0.5
        turned = to
        add("rotate", place, step=step, wait_s=0.5, seconds=seconds)

    def lit(kind: Any, path: Sequence[MachinePoint], run_out: MachinePoint, wait: float, **more: Any) -> None:
        speed, lengths = 20.0, [math.dist(a, b) for a, b in itertools.pairwise([place, *path, run_out])]
        light = sum(lengths[1:-1]) / speed
        add(
            kind, run_out, path=tuple(path), power_w=rig.laser.power_for_s(500.0), s_word=500.0,
            speed_mm_s=speed, wait_s=wait,
            beam_s=light + 0.02, seconds=sum(lengths) / speed + speed / 2000.0 + 0.05 + wait, **more,
        )  # fmt: skip

    goto((x0, y0, z0), -1)
    turn(0.0, -1)
    goto((x0 - 6.0, y0 - 5.0, z0), 0)
    corners = [(x0 - 6.0, y0 - 5.0, z0), (x0 + 6.0, y0 - 5.0, z0), (x0 + 6.0, y0 + 5.0, z0)]
    lit("cut", corners, corners[-1], 0.01, step=0)
    lit("cut", [corners[-1], (x0 - 6.0, y0 + 5.0, z0)], (x0 - 6.0, y0 + 5.0, z0), 0.01, step=0)
    for step, crease, y in ((1, 3, y0 - 2.0), (2, 7, y0 + 2.0)):
        turn(math.pi if step == 2 else 0.0, step)
        goto((x0 - 5.0, y, z0), step)
        for number in range(4):
            sign = 1.0 if number % 2 == 0 else -1.0
            path = [(x0 - 4.0 * sign, y, z0), (x0 + 4.0 * sign, y, z0)]
            lit("pass", path, (x0 + 5.0 * sign, y, z0), 0.2, step=step, crease=crease)
    add("wait", place, step=3, wait_s=1.0, seconds=1.0)
    turn(0.0, -1)
    goto((x0, y0, z0), -1)
    add("ask", place, step=-1, wait_s=0.01, seconds=0.01, text="take the part out")
    hashes = {"rig": rig.sha256, "material": "c" * 64}
    return Job(rig.name, hashes, gcode_style(rig), tuple(blocks))


@dataclass
class Recorder:
    """Notes when each block was sent."""

    clock: Clock
    begun: list[tuple[float, ReplayBlock]]
    confirmed_at: list[tuple[float, int]]

    def begins(self, block: ReplayBlock, seconds: float, t: float) -> None:
        self.begun.append((self.clock.now, block))

    def reports(self, status: Status, place: Mapping[str, float], t: float) -> None:
        pass

    def confirmed(self, block: ReplayBlock, place: Mapping[str, float], t: float) -> None:
        self.confirmed_at.append((self.clock.now, block.index))


@dataclass
class Outcome:
    """One replay: its journal (None if none was begun), what was lit, when blocks went out, when it ended."""

    journal: Journal | None
    records: list[dict[str, Any]]
    begun: list[tuple[float, ReplayBlock]]
    ended: float
    error: BaseException | None
    link: SimulatedLink

    @property
    def travel_s(self) -> float:
        """Longest time that a dark move to the work may take, from wherever the head is."""
        return 40.0 if self.begun and self.begun[-1][1].index <= 0 else 0.0

    @property
    def lit(self) -> list[dict[str, Any]]:
        return [r for r in self.records if r["kind"] == "move" and r["beam"] != "off" and r["s"] > 0.0]

    @property
    def doubt(self) -> int | None:
        return None if self.journal is None else self.journal.in_doubt

    @property
    def done(self) -> tuple[int, ...]:
        return () if self.journal is None else self.journal.done


def simulated(
    plan: ReplayJob,
    journal: Path,
    *,
    harms: Sequence[Harm] = (),
    dies_after: float | None = None,
    faults: Sequence[str] = (),
    mode: Mode = "arm",
    resumes: Mapping[str, Any] | None = None,
    latency_s: float = 0.0,
    alone_s: float = 60.0,
    prepare: Callable[[SimulatedLink], None] | None = None,
    url: str = "socket://127.0.0.1:1",
    homed: bool = True,
    rig: Rig = RIG,
    watched: bool = True,
    **more: Any,
) -> Outcome:
    """A replay on a fresh machine; afterwards the machine is left alone."""
    clock = Clock()
    machine = machine_for(rig, clock, faults, homed=homed)
    link = SimulatedLink(machine, clock, harms, latency_s, url=url)
    if prepare is not None:
        prepare(link)
    if dies_after is not None:
        link.dies_at = clock.now + dies_after
    recorder = Recorder(clock, [], [])
    error: BaseException | None = None
    with contextlib.ExitStack() as stack:
        for module in ("controller", "holding", "listener", "replay", "replay_run", "send_ahead"):
            stack.enter_context(mock.patch(f"rigs.{module}.time", clock))
        stack.enter_context(mock.patch("rigs.replay_run.Arming", lambda: Arming(clock.monotonic, clock.time)))
        stack.enter_context(mock.patch("rigs.replay.open_link", lambda _url, _rig: link))
        try:
            replay(
                plan,
                link.url,
                rig=rig,
                journal_path=journal,
                mode=mode,
                resumes=resumes,
                watch=recorder if watched else None,
                **more,
            )
        except (MachineError, JobError, HostKilled, KeyboardInterrupt) as caught:
            error = caught
    ended = clock.now
    link.leave_alone(alone_s)
    back = read_journal(journal) if journal.exists() and journal.stat().st_size else None
    return Outcome(back, records_of(machine), recorder.begun, ended, error, link)


def check_light(run: Outcome, slack_s: float = 0.5) -> None:
    """No light at rest; all light inside the planned time of the beam block in flight and half a second."""
    windows = []
    for sent, block in run.begun:
        if block.beam_s > 0.0:
            _, seconds, _ = light_of(lit_block(block), block.seconds)
            windows.append((sent, sent + seconds + slack_s))
    rest = [r for r in run.records if r["kind"] == "rest" and r["s"] > 0.0]
    assert not rest, f"light at standstill: {rest}"
    for move in run.lit:
        inside = any(a - 1e-6 <= move["t0"] and move["t1"] <= b + 1e-6 for a, b in windows)
        assert inside, f"light {move['t0']:.3f} to {move['t1']:.3f} s outside of {windows[-1:]}"


def check_end(run: Outcome) -> None:
    """It ended within two seconds of when the last block should have."""
    if run.begun:
        sent, block = run.begun[-1]
        assert run.ended <= sent + 1.1 * block.seconds + 2.1, (
            f"hung {run.ended - sent:.1f} s in {block.lines}"
        )


def strokes(run: Outcome) -> list[Lit]:
    """Lit moves as (from x y z, to x y z, rotary), work coordinates; pieces of one move are joined."""
    out: list[Lit] = []
    ended, way = float("nan"), [0.0] * 3
    for r in run.lit:
        a, b = ([round(v - o, 3) for v, o in zip(r[k], OFFSET, strict=True)] for k in ("from", "to"))
        before, way = way, _unit(a, b)
        if ended == r["t0"] and math.dist(before, way) < 1e-2:
            out[-1] = (*out[-1][:3], *b[:3], a[3])
        else:
            out.append((*a[:3], *b[:3], a[3]))
        ended = r["t1"]
    return out


def _unit(a: Sequence[float], b: Sequence[float]) -> list[float]:
    length = math.dist(a[:3], b[:3]) or 1.0
    return [(q - p) / length for p, q in zip(a[:3], b[:3], strict=True)]


def wanted_strokes(job: Job, numbers: Sequence[int]) -> list[Lit]:
    return [
        (*a, *b, round(math.degrees(job.blocks[k].rotary_rad), 3))
        for k in numbers
        if job.blocks[k].lit
        for a, b in itertools.pairwise(job.blocks[k].path)
    ]


def same(a: Lit, b: Lit, tolerance: float = 0.02) -> bool:
    return max(abs(p - q) for p, q in zip(a, b, strict=True)) <= tolerance


def resumed(job: Job, first: Outcome, journal: Path) -> tuple[Outcome, Standing, tuple[int, ...]]:
    """Go on after a run that stopped, the block in doubt counted as done."""
    assert first.journal is not None
    now = standing([first.journal], job)
    left, counted, dropped = blocks_left(job, now, "done" if now.doubt else None)
    assert not dropped
    header = {
        "journal": now.journals[-1], "hash": now.last_hash, "done": list(counted), "left_out": [],
        "decision": "done" if counted else None, "emulated": True,
    }  # fmt: skip
    return simulated(resume_job(job, left), journal, resumes=header), now, counted


def check_union(job: Job, first: Outcome, folder: Path) -> None:
    """Both runs together are the job: each fold pass once, the block in doubt at most once."""
    if first.journal is None or not first.journal.records:
        assert not first.lit
        return
    if first.journal.outcome == "complete":
        assert len(strokes(first)) == len(wanted_strokes(job, range(len(job.blocks))))
        return
    second, now, counted = resumed(job, first, folder / "second.jsonl")
    assert second.error is None, second.error
    lit = [k for k, b in enumerate(job.blocks) if b.lit]
    burnt = [k for k in first.done if k in lit] + [k for k in second.done if k in lit]
    assert sorted([*burnt, *counted]) == lit
    sure = wanted_strokes(job, [k for k in first.done if k in lit])
    have = strokes(first)
    assert len(have) >= len(sure)
    for a, b in zip(have, sure, strict=False):
        assert same(a, b), f"{a} instead of {b}"
    if now.doubt is None:
        assert len(have) == len(sure), f"light outside of any promise: {have[len(sure) :]}"
    wanted = wanted_strokes(job, second.done)
    for a, b in zip(strokes(second), wanted, strict=True):
        assert same(a, b), f"{a} instead of {b}"


def plan_of_fault_job() -> tuple[Job, ReplayJob]:
    job = fault_job()
    return job, replay_job(job)
