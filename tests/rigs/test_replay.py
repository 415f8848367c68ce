"""Replays against the emulator: what is lit, what is refused, and what every fault ends in."""

from __future__ import annotations

import dataclasses
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

import msgspec
import pytest

from rigs.emulator import start_emulator
from rigs.errors import JobError, MachineError
from rigs.journal import Journal, read_journal
from rigs.link import open_link
from rigs.replay import Mode, Progress, replay
from rigs.replay_blocks import PlainBlock, ReplayJob
from rigs.replay_checks import Certificate, check_certificate, check_dry_run
from rigs.rig import load_rig
from tests.rigs.replay_jobs import RIG, small_job

REPOSITORY = Path(__file__).resolve().parents[2]


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


FAULTS = [
    ("error:20@16", "error:20 to 'G1X210Y150F6000S500': command not supported", 1),
    ("alarm:1@16", "ALARM:1: hard limit", 1),
    ("alarm:171@16", "ALARM:171: not listed", 1),
    ("drop@16", "the port vanished", 1),
    ("mute@16", "no answer for 1 s", 1),
    ("power@16", "restarted in the middle of the job", 1),
    ("no-ok@16", "answers are missing", 1),
    ("garble@16", "answer not understood: 'o'", 1),
    ("extra-ok@18", "an 'ok' too many", 1),
]


@pytest.mark.parametrize(("fault", "words", "step"), FAULTS)
def test_each_fault_ends_dark_with_block_and_step_named(
    tmp_path: Path, fault: str, words: str, step: int
) -> None:
    with pytest.raises(MachineError) as caught:
        run(tmp_path, faults=[fault])
    assert words in str(caught.value)
    assert caught.value.block == 1
    assert caught.value.step == 2
    assert "(block 1, step 2)" in str(caught.value)
    journal = read_journal(tmp_path / "journal.jsonl")
    assert journal.outcome == "fault"
    assert words in journal.reason
    assert journal.done == (0,)
    assert journal.in_doubt == step
    trace = read_trace(tmp_path / "trace.jsonl")
    assert trace[-1]["rest_beam_s"] == 0.0
    assert len(lit(trace)) <= 1


def test_fault_before_any_light_leaves_nothing_in_doubt(tmp_path: Path) -> None:
    with pytest.raises(MachineError):
        run(tmp_path, faults=["error:9@11"])
    journal = read_journal(tmp_path / "journal.jsonl")
    assert journal.in_doubt is None
    assert lit(read_trace(tmp_path / "trace.jsonl")) == []


def test_lost_steps_stop_the_job(tmp_path: Path) -> None:
    blocks = [
        dataclasses.replace(b, expect=(("X", 199.9),)) if b.index == 2 else b for b in small_job().blocks
    ]  # type: ignore[type-var]
    job = dataclasses.replace(small_job(), blocks=tuple(blocks))
    with pytest.raises(MachineError, match=r"axis X is at 190.000 mm, it should be at 199.900 mm"):
        run(tmp_path, job)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({32: 0}, r"setting \$32 of the controller is 0"),
        ({30: 255}, r"setting \$30"),
        ({100: 40}, r"setting \$100"),
    ],
)
def test_wrong_settings_refuse_to_arm(tmp_path: Path, settings: dict[int, float], words: str) -> None:
    with pytest.raises(MachineError, match=words):
        run(tmp_path, settings=settings)
    trace = read_trace(tmp_path / "trace.jsonl")
    assert not [r for r in trace if r["kind"] == "move"]
    assert not (tmp_path / "journal.jsonl").exists()


def test_wrong_firmware_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MachineError, match="has 3 axes"):
        run(tmp_path, rig="grbl-diode-swap")


def test_job_of_another_rig_or_with_too_long_a_beam_is_refused(tmp_path: Path) -> None:
    with pytest.raises(JobError, match="made for another rig"):
        run(tmp_path, dataclasses.replace(small_job(), rig_sha256="0" * 64))
    long = PlainBlock(5, "cut", ("M4S0", "G1X200F1S1", "M5"), beam_s=60.0, step=7)
    with pytest.raises(JobError, match=r"block 5 \(step 7\) burns 60.00 s"):
        run(tmp_path, dataclasses.replace(small_job(), blocks=(long,)))


def test_homing_needs_leave_on_a_machine_that_is_locked(tmp_path: Path) -> None:
    with start_emulator() as machine, pytest.raises(MachineError, match="must be homed"):
        replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "j", home=False)
    assert read_journal(tmp_path / "j").done == ()


def test_journal_is_never_written_over(tmp_path: Path) -> None:
    (tmp_path / "journal.jsonl").write_text("mine")
    with pytest.raises(JobError, match="exists already"):
        run(tmp_path)
    assert (tmp_path / "journal.jsonl").read_text() == "mine"


def test_port_that_refuses_and_port_that_is_no_machine(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
    with pytest.raises(MachineError, match="cannot open the port") as caught:
        replay(small_job(), url, rig=RIG, journal_path=tmp_path / "j")
    assert isinstance(caught.value, OSError)
    with pytest.raises(MachineError, match="cannot open the port"):
        replay(small_job(), "/dev/no-such-port", rig=RIG, journal_path=tmp_path / "j")
    with pytest.raises(MachineError, match="cannot open the port"):
        open_link("carrier-pigeon://here", RIG)


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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signal_darkens_and_closes_the_journal(tmp_path: Path, number: signal.Signals) -> None:
    script = (
        "import sys; from pathlib import Path; from rigs.replay import replay\n"
        "from tests.rigs.replay_jobs import RIG, small_job\n"
        "def say(p): print(p.block, flush=True)\n"
        "journal = Path(sys.argv[2])\n"
        "url = sys.argv[1]\n"
        "try: replay(small_job(400), url, rig=RIG, journal_path=journal, mode='arm', on_progress=say)\n"
        "except KeyboardInterrupt: sys.exit(130)\n"
    )
    trace, journal = tmp_path / "trace", tmp_path / "journal"
    with start_emulator(trace=trace, time_scale=20.0) as machine:
        host = subprocess.Popen(
            [sys.executable, "-c", script, machine.url, str(journal)], cwd=REPOSITORY, stdout=subprocess.PIPE
        )
        assert host.stdout is not None
        for line in host.stdout:
            if int(line) == 6:
                break
        os.kill(host.pid, number)
        host.stdout.read()
        host.stdout.close()
        assert host.wait(timeout=20) == 130
    back = read_journal(journal)
    assert back.outcome == "stopped"
    assert back.reason == "interrupted"
    assert 3 <= len(back.done) < 400
    records = read_trace(trace)
    assert records[-1]["rest_beam_s"] == 0.0
    assert len(lit(records)) <= len(back.done) + 1


def test_host_that_dies_leaves_at_most_one_block_burning(tmp_path: Path) -> None:
    script = (
        "import os, sys; from pathlib import Path; from rigs.replay import replay\n"
        "from tests.rigs.replay_jobs import RIG, small_job\n"
        "def die(p):\n    if p.block == 9: os.kill(os.getpid(), 9)\n"
        "journal = Path(sys.argv[2])\n"
        "replay(small_job(400), sys.argv[1], rig=RIG, journal_path=journal, mode='arm', on_progress=die)\n"
    )
    trace, journal = tmp_path / "trace", tmp_path / "journal"
    with start_emulator(trace=trace) as machine:
        host = subprocess.run([sys.executable, "-c", script, machine.url, str(journal)], cwd=REPOSITORY)
        assert host.returncode == -9
        time.sleep(0.1)
    back = read_journal(journal)
    assert back.outcome == "unfinished"
    assert len(back.done) == 8
    assert len(lit(read_trace(trace))) <= 8
    assert read_trace(trace)[-1]["rest_beam_s"] == 0.0


def test_second_host_is_turned_away(tmp_path: Path) -> None:
    with start_emulator() as machine:
        first = open_link(machine.url, RIG)
        with pytest.raises(MachineError, match=r"vanished|cannot open"):
            replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "j")
        first.close()


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


class TestCertificate:
    """A real laser is armed only for the very job, rig and material that were validated."""

    def good(self) -> Certificate:
        return Certificate("pass", "a" * 64, RIG.sha256, "c" * 64)

    def test_good_one_passes(self) -> None:
        check_certificate(self.good(), small_job(), RIG)

    @pytest.mark.parametrize(
        ("changes", "words"),
        [
            ({"verdict": "contact"}, "says 'contact'"),
            ({"job_sha256": "b" * 64}, "another job"),
            ({"rig_sha256": "b" * 64}, "another rig"),
            ({"material_sha256": ""}, "another material"),
        ],
    )
    def test_any_difference_refuses(self, changes: dict[str, str], words: str) -> None:
        with pytest.raises(JobError, match=words):
            check_certificate(dataclasses.replace(self.good(), **changes), small_job(), RIG)

    def test_none_refuses(self) -> None:
        with pytest.raises(JobError, match="only with a validation"):
            check_certificate(None, small_job(), RIG)


def test_real_machine_is_armed_by_a_person_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigs.controller.Identity.emulated", property(lambda self: False))
    good = Certificate("pass", "a" * 64, RIG.sha256, "c" * 64)
    asked: list[str] = []
    trace = tmp_path / "trace"
    with start_emulator(trace=trace) as machine:
        with pytest.raises(JobError, match="only with a validation"):
            replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "a", mode="arm", home=True)
        for number, confirm in enumerate([None, lambda text: bool(asked.append(text))]):
            with pytest.raises(JobError, match="a person has to confirm"):
                replay(
                    small_job(), machine.url, rig=RIG, journal_path=tmp_path / f"b{number}", mode="arm",
                    certificate=good, home=True, confirm=confirm,
                )  # fmt: skip
    assert asked == [f"arm REAL laser grbl-4axis, job {'a' * 12}, up to 19 W"]
    assert lit(read_trace(trace)) == []
    with start_emulator(trace=trace) as machine:
        done = replay(
            small_job(), machine.url, rig=RIG, journal_path=tmp_path / "c", mode="arm", certificate=good,
            home=True, confirm=lambda text: True,
        )  # fmt: skip
    assert done.header["machine"] == "REAL"
    assert lit(read_trace(trace)) == STROKES


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("G0X500", "leaves the reach of axis X, 0 to 400"),
        ("G0Y-1", "leaves the reach of axis Y"),
        ("G0Z241", "leaves the reach of axis Z"),
        ("G0A720", "leaves the reach of axis A"),
        ("M3S500", "only M4 is used"),
        ("$32=0", "not plain G-code"),
        ("G92X0", "changes offsets"),
    ],
)
def test_no_byte_is_sent_of_a_job_with_a_bad_line(tmp_path: Path, line: str, words: str) -> None:
    bad = PlainBlock(7, "goto", (line, "G4P0.01"), step=3)
    job = dataclasses.replace(small_job(), blocks=(*small_job().blocks, bad))
    with pytest.raises(JobError, match=r"block 7 \(step 3\): .*" + re.escape(words)):
        replay(job, "socket://127.0.0.1:1", rig=RIG, journal_path=tmp_path / "j", mode="dry-run")


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


def test_a_real_machine_is_homed_when_a_person_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigs.controller.Identity.emulated", property(lambda self: False))
    asked: list[str] = []

    def answer(text: str) -> bool:
        asked.append(text)
        return len(asked) > 1

    with start_emulator() as machine:
        with pytest.raises(MachineError, match="must be homed"):
            replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "a", ask=answer)
        done = replay(small_job(), machine.url, rig=RIG, journal_path=tmp_path / "b", ask=answer)
    assert done.outcome == "complete"
    assert asked == ["REAL machine grbl-4axis: home it now? It moves to its switches"] * 2


def test_a_rig_may_demand_a_dry_run_of_this_very_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    safety = msgspec.structs.replace(RIG.safety, require_dry_run=True)
    rig = msgspec.structs.replace(RIG, safety=safety)
    job = small_job(rig=rig)
    with pytest.raises(JobError, match="demands a dry run"):
        check_dry_run(None, job, rig)
    check_dry_run(None, small_job(), RIG)
    with start_emulator() as machine:
        replay(job, machine.url, rig=rig, journal_path=tmp_path / "emulated")
        with pytest.raises(JobError, match="not the journal of a complete dry run"):
            check_dry_run(tmp_path / "emulated", job, rig)
        monkeypatch.setattr("rigs.controller.Identity.emulated", property(lambda self: False))
        replay(job, machine.url, rig=rig, journal_path=tmp_path / "real", home=True)
    check_dry_run(tmp_path / "real", job, rig)
    with pytest.raises(JobError, match="not the journal of a complete dry run"):
        check_dry_run(tmp_path / "real", dataclasses.replace(job, sha256="d" * 64), rig)
