"""Dry runs are sent ahead of the motion, within the receive buffer; whatever goes wrong stops them, named."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.errors import MachineError
from rigs.replay import replay
from rigs.replay_blocks import PlainBlock, ReplayJob, dark_lines
from rigs.rig import Rig
from rigs.send_ahead import stretches
from tests.rigs.fault_runs import Outcome, simulated
from tests.rigs.harm_cases import JOB, PLAN
from tests.rigs.replay_jobs import RIG
from tests.rigs.replay_runs import read_trace
from tests.rigs.simulated_link import Harm, SimulatedLink

START = 1000.0


def dry(folder: Path, plan: ReplayJob = PLAN, name: str = "dry", **more) -> Outcome:
    return simulated(plan, folder / f"{name}.jsonl", mode="dry-run", watched=False, **more)


def wire_job(rig: Rig = RIG, blocks: int = 40, lines: int = 4) -> ReplayJob:
    """Strokes of a twentieth of a millimetre, faster than their bytes come over the wire."""
    out = [
        PlainBlock(-1, "head", ("G21", "G90", "G94", "G17", "G54", "M5 S0")),
        PlainBlock(0, "goto", ("G0X150Y150Z120", "G4P0.01"), seconds=10.0),
    ]
    x = 150.0
    for number in range(1, blocks + 1):
        ends = [round(x + 0.05 * (n + 1), 3) for n in range(lines)]
        x = ends[-1]
        moves = (f"G1X{end:.3f}Y150.000F6000S0" for end in ends)
        out.append(PlainBlock(number, "goto", tuple(moves), seconds=0.05, expect=(("X", x),)))
    return ReplayJob(tuple(out), "a" * 64, rig.sha256, "c" * 64)


def moves(run: Outcome) -> list[tuple[list[float], list[float]]]:
    """Moves from end to end; pieces of one move are joined."""
    out: list[tuple[list[float], list[float]]] = []
    for r in run.records:
        if r["kind"] != "move":
            continue
        way = [round(b - a, 5) for a, b in zip(r["from"], r["to"], strict=True)]
        before = [round(b - a, 5) for a, b in zip(*out[-1], strict=True)] if out else way
        cosine = sum(a * b for a, b in zip(way, before, strict=True)) / (
            math.hypot(*way) * math.hypot(*before)
        )
        if out and out[-1][1] == r["from"] and cosine > 0.9999:
            out[-1] = (out[-1][0], r["to"])
        else:
            out.append((r["from"], r["to"]))
    return out


def sent_lines(run: Outcome) -> list[str]:
    data = bytes(b for _, b in run.link.sent if b not in b"?!\x18")
    return [line for line in data.decode("ascii").split("\n") if line]


def got_lines(run: Outcome) -> list[str]:
    return [r["text"] for r in run.records if r["kind"] == "line"]


def test_the_same_way_as_block_by_block_in_the_dark_and_sooner(tmp_path):
    slow = simulated(PLAN, tmp_path / "slow.jsonl", mode="dry-run")
    fast = dry(tmp_path)
    assert slow.error is None and fast.error is None
    assert moves(fast) == moves(slow)
    assert not fast.lit and not any("M3" in line or "M4" in line for line in sent_lines(fast))
    assert all(r["s"] == 0.0 for r in fast.records if r["kind"] in ("move", "rest"))
    assert fast.ended < slow.ended
    assert fast.journal is not None and fast.journal.outcome == "complete"
    assert set(fast.journal.done) == {b.index for b in PLAN.blocks if b.index >= 0 and dark_lines(b)}


@pytest.mark.parametrize("latency", [0.0, 0.016])
@pytest.mark.parametrize("rx_bytes", [96, 128, 255])
def test_every_line_arrives_once_and_in_order_and_no_byte_too_many(tmp_path, rx_bytes, latency):
    rig = replace_buffer(rx_bytes)
    run = dry(tmp_path, wire_job(rig, lines=2), rig=rig, latency_s=latency)
    assert run.error is None
    assert got_lines(run) == sent_lines(run)
    assert run.link.machine.config.rx_bytes == rx_bytes


def replace_buffer(rx_bytes: int) -> Rig:
    import msgspec

    return msgspec.structs.replace(RIG, controller=msgspec.structs.replace(RIG.controller, rx_bytes=rx_bytes))


def test_the_wire_is_full(tmp_path):
    """A job that the wire holds up: 95 % of the bytes that 115 200 baud carry; block by block far less."""
    job = wire_job(blocks=100, lines=8)

    def share(run: Outcome) -> float:
        assert run.error is None
        lines = [r for r in run.records if r["kind"] == "line" and r["text"].startswith("G1")]
        lines = lines[len(lines) // 2 :]  # at first the planner waits for the way to the work
        return sum(len(r["text"]) + 1 for r in lines[1:]) / (lines[-1]["t"] - lines[0]["t"]) / 11520.0

    fast, slow = dry(tmp_path, job), simulated(job, tmp_path / "slow.jsonl", mode="dry-run")
    assert share(fast) >= 0.95
    assert share(slow) < 0.8


FAULTS = {
    "error:20": "error:20 to '{line}'", "alarm:1": "ALARM:1", "alarm:171": "ALARM:171", "drop": "vanished",
    "power": "restarted in the middle",
    "garble": "answer not understood: 'o'", "no-ok": "answers are missing",
    "mute": "no answer for", "door": "the machine went to Door",
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("line", [14, 19, 24])
def test_a_fault_stops_it_and_names_block_and_line(tmp_path, fault, line):
    whole = got_lines(dry(tmp_path, name="whole"))
    run = dry(tmp_path, faults=[f"{fault}@{line}"])
    assert isinstance(run.error, MachineError)
    assert FAULTS[fault].format(line=whole[line - 1]) in str(run.error)
    assert run.error.block is not None
    near = [b for b in PLAN.blocks if b.index in (run.error.block, run.error.block - 1, run.error.block + 1)]
    assert "'" in run.error.message
    named = run.error.message.rsplit("'", 2)[1] if fault != "error:20" else whole[line - 1]
    assert any(named in (*dark_lines(b), "G4 P0.01") for b in near), (named, run.error.block)
    struck = next(r["t"] for r in run.records if r["kind"] == "line" and r["text"] == whole[line - 1])
    if fault == "no-ok":  # the machine makes what it has first
        struck = max([struck, *(r["t1"] for r in run.records if r["kind"] == "move")])
    assert run.ended - struck < 2.0
    assert not run.lit
    assert run.journal is not None and run.journal.outcome == "fault"


def test_an_answer_too_many_is_noticed(tmp_path):
    run = dry(tmp_path, faults=["extra-ok@19"])
    assert isinstance(run.error, MachineError)
    assert "too many" in str(run.error) or "to nothing" in str(run.error)


def test_lost_bytes_end_it(tmp_path):
    """Every byte dropped in turn from a stretch of the wire: never light, never a run that hangs."""
    whole = dry(tmp_path, name="whole")
    data = bytes(b for _, b in whole.link.sent)
    first = data.index(b"G1")
    wrong = 0
    for at in range(first, first + 120, 3):
        run = dry(tmp_path, name=str(at), harms=[Harm("out", at, "drop")], alone_s=5.0)
        assert run.error is None or isinstance(run.error, MachineError)
        assert not run.lit
        assert run.ended <= whole.ended + 4.0
        wrong += run.error is not None
    assert wrong > 20


@pytest.mark.parametrize("seconds", [0.7, 1.1, 1.5, 2.3, 3.0, 3.7])
def test_a_stop_in_the_middle(tmp_path, seconds):
    def stopped(link: SimulatedLink) -> None:
        raise KeyboardInterrupt

    run = dry(tmp_path, prepare=lambda link: link.events.append((START + seconds, stopped)))
    assert isinstance(run.error, KeyboardInterrupt)
    after = [(t, b) for t, b in run.link.sent if t >= START + seconds]
    assert bytes(b for _, b in after).startswith(b"!\x18")
    assert after[0][0] - START - seconds <= 0.1
    assert set(bytes(b for _, b in after).replace(b"!\x18", b"").split(b"\n")) <= {b"M5", b""}


def test_a_job_that_is_watched_goes_block_by_block(tmp_path):
    run = simulated(PLAN, tmp_path / "j.jsonl", mode="dry-run")
    assert [b.index for _, b in run.begun] == [b.index for b in PLAN.blocks if dark_lines(b)]


def test_stretches_keep_order_and_leave_turns_alone():
    parts = list(stretches(PLAN.blocks))
    assert list(itertools.chain.from_iterable(parts)) == list(PLAN.blocks)
    for part in parts:
        assert len(part) == 1 or not {b.kind for b in part} & {"rotate", "ask"}
        assert sum(b.seconds for b in part[:-1]) < 10.0
    assert max(len(part) for part in parts) > 3
    assert len(JOB.blocks) > 10


def test_a_paced_emulator_takes_a_dry_run(tmp_path):
    """Processes, a socket, the link paced in simulated time."""
    with start_emulator(trace=tmp_path / "trace", baud=115200) as machine:
        journal = replay(wire_job(), machine.url, rig=RIG, journal_path=tmp_path / "j")
    assert journal.outcome == "complete"
    trace = read_trace(tmp_path / "trace")
    times = [r["t"] for r in trace if r["kind"] == "line" and r["text"].startswith("G1")]
    least = sum(len(line) + 1 for b in wire_job().blocks[2:] for line in b.lines) / 11520.0
    assert times[-1] - times[0] >= 0.97 * least
    assert trace[-1]["beam_s"] == 0.0
