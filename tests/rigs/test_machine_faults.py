"""What a machine, a second sender, a clock or a disk can do in the middle of a job: it stops, dark."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from rigs.errors import JobError, MachineError
from rigs.grbl import error_text
from rigs.journal import read_journal
from rigs.modes import modes_mistake
from rigs.replay_blocks import lit_block
from rigs.replay_checks import Certificate
from rigs.resume import standing
from tests.rigs.fault_runs import (
    check_end,
    check_light,
    check_union,
    same,
    simulated,
    strokes,
    wanted_strokes,
)
from tests.rigs.harm_cases import JOB, PLAN
from tests.rigs.simulated_link import Harm, SimulatedLink

CERTIFICATE = Certificate("pass", PLAN.sha256, PLAN.rig_sha256, PLAN.material_sha256)
REAL = {"url": "/dev/ttyUSB9", "certificate": CERTIFICATE, "confirm": lambda _text: True}
START = 1000.0
HARMLESS = {b"$I", b"$$", b"$#", b"$G", b"M5", b""}


def lines_of(link: SimulatedLink) -> list[bytes]:
    """Lines that left the host, realtime bytes taken out."""
    data = bytes(byte for _, byte in link.sent)
    for realtime in (b"?", b"!", b"\x18"):
        data = data.replace(realtime, b"")
    return data.split(b"\n")


def sent_after(link: SimulatedLink, t: float) -> bytes:
    return bytes(byte for when, byte in link.sent if when > t)


def at(seconds: float, act) -> dict[str, object]:
    """Arguments of a run in which something happens ``seconds`` after its start."""
    return {"prepare": lambda link: link.events.append((START + seconds, act))}


INSTANTS = [0.69, 0.9, 1.9, 2.7, 4.0, 5.6, 7.3, 8.6, 9.9, 12.6, 14.5, 16.9]
"""In head, goto, rotate, cut, passes, a half turn, waits and the tail of the job."""


@pytest.mark.parametrize("seconds", INSTANTS)
def test_power_cycle_in_any_state(tmp_path, seconds):
    run = simulated(PLAN, tmp_path / "first.jsonl", **at(seconds, lambda link: link.machine.power_cycle()))
    assert isinstance(run.error, MachineError)
    assert not [r for r in run.lit if r["t0"] > START + seconds]  # nothing is lit any more
    assert set(sent_after(run.link, START + seconds + 0.7).split(b"\n")) <= {b"M5", b""}
    check_light(run)
    check_union(JOB, run, tmp_path)


@pytest.mark.parametrize("seconds", [0.3, 2.7, 5.6, 7.3, 9.0, 12.6])
@pytest.mark.parametrize("byte", [0x18, ord("!"), 0x84], ids=["reset", "hold", "door"])
def test_another_sender(tmp_path, seconds, byte):
    run = simulated(
        PLAN, tmp_path / "first.jsonl", **at(seconds, lambda link: link.machine.receive(bytes([byte])))
    )
    assert isinstance(run.error, MachineError)
    assert b"~" not in sent_after(run.link, 0.0)
    assert run.ended - START - seconds < 2.0
    check_light(run)
    check_union(JOB, run, tmp_path)


@pytest.mark.parametrize("seconds", [2.7, 5.6, 9.0])
def test_a_controller_that_stands_still_for_five_seconds(tmp_path, seconds):
    def freeze(link: SimulatedLink) -> None:
        link.frozen = (START + seconds, START + seconds + 5.0)

    run = simulated(PLAN, tmp_path / "first.jsonl", prepare=freeze)
    assert isinstance(run.error, MachineError)
    stopped = next(t for t, byte in run.link.sent if byte == 0x18)
    assert stopped - START - seconds <= 1.5
    assert set(sent_after(run.link, stopped).replace(b"\x18", b"").split(b"\n")) <= {b"M5", b""}
    check_union(JOB, run, tmp_path)


REPLIES = {
    "o": b"o\r\n", "k": b"k\r\n", "okok": b"okok\r\n", "one too many": b"ok\r\n",
    "odd bytes": b"\xff\xfe\xc3\r\n", "error to nothing": b"error:9\r\n",
    "no line end": b"x" * 6000, "echo": b"echo:busy\r\n",
}  # fmt: skip


@pytest.mark.parametrize("name", REPLIES)
@pytest.mark.parametrize("seconds", [2.7, 5.3, 8.61])
def test_answers_that_were_not_given(tmp_path, name, seconds):
    run = simulated(PLAN, tmp_path / "first.jsonl", **at(seconds, lambda link: link.inject(REPLIES[name])))
    assert isinstance(run.error, MachineError), name
    assert len(run.link._buffer) < 20_000
    check_light(run)
    check_end(run)
    check_union(JOB, run, tmp_path)


def test_a_missing_answer_in_every_beam_block(tmp_path):
    whole = simulated(PLAN, tmp_path / "whole.jsonl")
    assert whole.error is None
    for number in range(3, 9):
        place = tmp_path / str(number)
        place.mkdir()
        run = simulated(PLAN, place / "first.jsonl", faults=[f"no-ok@{12 + 4 * number}"])
        assert isinstance(run.error, MachineError)
        check_light(run)
        check_end(run)
        check_union(JOB, run, place)


def test_an_answer_that_comes_half_a_minute_late(tmp_path):
    def slow(link: SimulatedLink) -> None:
        link.latency_s = 30.0

    run = simulated(PLAN, tmp_path / "first.jsonl", alone_s=120.0, **at(2.7, slow))
    assert isinstance(run.error, MachineError)
    check_light(run)
    check_end(run)


def test_every_error_on_every_line_of_a_beam_block(tmp_path):
    """Whatever line is refused: nothing behind the block lights."""
    first = next(b for b in PLAN.blocks if b.beam_s > 0.0)
    head = sum(len(lit_block(b)) for b in PLAN.blocks[: PLAN.blocks.index(first)])
    before = 1 + 4  # M5 and the questions
    for line in range(len(first.lines)):
        for code in range(1, 39):
            journal = tmp_path / f"{line}-{code}.jsonl"
            run = simulated(PLAN, journal, faults=[f"error:{code}@{before + head + line + 1}"], alone_s=10.0)
            assert isinstance(run.error, MachineError)
            assert error_text(code) in str(run.error)
            assert run.doubt == first.index
            check_light(run)
            assert len(strokes(run)) <= 2  # of this cut of two edges


@pytest.mark.parametrize(
    ("wanted", "instead", "words"),
    [("F1200", "F1210", "worked with F1210"), ("S500", "S400", "worked with S400")],
)
def test_a_damaged_feed_or_power_of_a_cut_is_noticed(tmp_path, wanted, instead, words):
    """Grbl has no checksums: its modal state afterwards tells what place and answers do not."""
    whole = simulated(PLAN, tmp_path / "whole.jsonl")
    data = bytes(byte for _, byte in whole.link.sent)
    first = data.index(wanted.encode())
    changed = next(i for i, (a, b) in enumerate(zip(wanted, instead, strict=True)) if a != b)
    flip = Harm("out", first + changed, "flip", ord(wanted[changed]) ^ ord(instead[changed]))
    run = simulated(PLAN, tmp_path / "first.jsonl", harms=[flip])
    assert words in str(run.error)
    assert run.doubt == next(b.index for b in PLAN.blocks if b.beam_s > 0.0)


@pytest.mark.parametrize(
    ("report", "words"),
    [
        ((), None),
        (("[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F1200 S500]",), None),
        (("[GC:G1 G54 G17 G21 G91 G94 M5 M9 T0 F1200 S500]",), "should be in G90"),
        (("[GC:G1 G54 G17 G21 G90 G94 M4 M9 T0 F1200 S500]",), "should be in M5"),
        (("[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F120 S500]",), "worked with F120, it was sent F1200"),
        (("[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F1200]",), "worked with nothing, it was sent S500"),
    ],
)
def test_modes_after_a_block(report, words):
    said = modes_mistake(("M4S0", "G1X1Y1F1200S500", "M5", "G4P0.01"), report)
    assert said is None if words is None else words in str(said)


def test_a_limit_mutes_it_until_a_reset(tmp_path):
    run = simulated(PLAN, tmp_path / "first.jsonl", **at(2.7, lambda link: link.machine.alarm(1)))
    assert "ALARM:1" in str(run.error)
    assert 0x18 in sent_after(run.link, START + 2.7)
    assert run.ended - START - 2.7 < 1.0
    assert not run.link.machine.mute
    check_light(run)


@pytest.mark.parametrize("jump", [3600.0, -3600.0])
def test_a_clock_that_jumps_disarms(tmp_path, jump):
    def sleep(link: SimulatedLink) -> None:
        link.clock.jump = jump

    run = simulated(PLAN, tmp_path / "first.jsonl", **at(5.0, sleep))
    assert isinstance(run.error, JobError)
    assert "no longer armed: the clock jumped" in str(run.error)
    assert run.journal is not None and run.journal.outcome == "stopped"
    assert run.doubt is None
    check_union(JOB, run, tmp_path)


def test_a_host_that_stood_still_is_no_longer_armed(tmp_path):
    """Stopped with Ctrl-Z and continued a minute later, in the cooling after a pass."""

    def stand_still(link: SimulatedLink) -> None:
        link.dies_at = link.clock.now + 1e9
        link.clock.now += 60.0

    run = simulated(PLAN, tmp_path / "first.jsonl", **at(5.86, stand_still))
    assert isinstance(run.error, (JobError, MachineError))
    assert not [r for r in run.lit if r["t0"] > START + 7.0]
    check_union(JOB, run, tmp_path)


def test_time_for_a_question_does_not_disarm(tmp_path):
    """A person may take minutes over a question of the job."""
    clocks: list[SimulatedLink] = []

    def answer(question: str) -> bool:
        clocks[0].clock.now += 300.0
        assert question
        return True

    run = simulated(PLAN, tmp_path / "first.jsonl", prepare=clocks.append, ask=answer, **REAL)
    assert run.error is None


@pytest.mark.parametrize("latency", [0.001, 0.004, 0.016, 0.040])
def test_a_slow_link_changes_nothing(tmp_path, latency):
    run = simulated(PLAN, tmp_path / "first.jsonl", latency_s=latency)
    assert run.error is None
    wanted = wanted_strokes(JOB, range(len(JOB.blocks)))
    assert all(same(a, b) for a, b in zip(strokes(run), wanted, strict=True))
    check_light(run)


def test_after_a_stop_nothing_but_questions_and_darkness(tmp_path):
    """A real machine with a job half done: without a person nothing moves, whatever state it is in."""
    first = simulated(PLAN, tmp_path / "first.jsonl", harms=[Harm("out", 300, "cut")])
    assert first.doubt is not None
    for answer in (None, lambda _text: False):
        journal = tmp_path / f"again-{answer is None}.jsonl"
        run = simulated(PLAN, journal, homed=answer is None, **{**REAL, "confirm": answer})
        assert isinstance(run.error, (JobError, MachineError))
        assert set(lines_of(run.link)) <= HARMLESS
        assert not run.lit


def test_light_at_rest_is_put_out_before_anything_else(tmp_path):
    """A Grbl left in M3 with S over 0 shines at standstill; the first line that it gets is M5."""

    def shining(link: SimulatedLink) -> None:
        link.machine.receive(b"M3 S500\n")
        link.machine.out.clear()

    run = simulated(PLAN, tmp_path / "first.jsonl", prepare=shining)
    assert run.error is None
    assert lines_of(run.link)[0] == b"M5"
    rest = [r for r in run.records if r["kind"] == "rest" and r["s"] == 0.0]
    assert rest and rest[0]["t"] - START < 0.2


@pytest.mark.parametrize("fails", [errno.ENOSPC, errno.EIO])
def test_a_disk_that_fails_lights_nothing(tmp_path, monkeypatch, fails):
    def broken(*_: object) -> None:
        raise OSError(fails, os.strerror(fails))

    monkeypatch.setattr("rigs.journal.os.fsync", broken)
    run = simulated(PLAN, tmp_path / "first.jsonl", **REAL)
    assert isinstance(run.error, (MachineError, OSError))
    assert "stopped before light" in str(run.error)
    assert not run.lit


def test_the_promise_is_on_the_disk_before_the_light(tmp_path, monkeypatch):
    """Every INTENT is synced while the machine stands dark; nothing is synced while light burns."""
    links: list[SimulatedLink] = []
    synced: list[float] = []
    path = tmp_path / "first.jsonl"

    def sync(_descriptor: int) -> None:
        synced.append(links[0].clock.now)

    monkeypatch.setattr("rigs.journal.os.fsync", sync)
    run = simulated(PLAN, path, prepare=links.append, ask=lambda _q: True, **REAL)
    assert run.error is None
    lit = [(r["t0"], r["t1"]) for r in run.lit]
    assert not [t for t in synced if any(a < t < b for a, b in lit)]
    intents = [r for r in read_journal(path).records if r["kind"] == "intent"]
    assert len(intents) == sum(b.lit for b in JOB.blocks)
    assert len(synced) >= len(intents)


def test_stop_to_dark(tmp_path):
    """A stop that comes in the middle of a stroke: the light is off within 150 ms."""

    def stopped(link: SimulatedLink) -> None:
        raise KeyboardInterrupt

    for seconds in (2.7, 3.3, 5.6, 9.2):
        journal = tmp_path / f"{seconds}.jsonl"
        run = simulated(PLAN, journal, **at(seconds, stopped))
        assert isinstance(run.error, KeyboardInterrupt)
        last = max(r["t1"] for r in run.lit)
        assert last <= START + seconds + 0.150
        assert run.journal is not None and run.journal.outcome == "stopped"


@pytest.mark.parametrize("seconds", [2.0, 2.35, 2.7, 3.3, 5.6, 5.95, 9.2, 9.4, 14.6])
def test_the_bounds_of_the_dose_in_doubt_hold(tmp_path, seconds):
    """What the journal says of the doubted block, against what the machine really burnt."""

    def stopped(link: SimulatedLink) -> None:
        raise KeyboardInterrupt

    run = simulated(PLAN, tmp_path / "first.jsonl", **at(seconds, stopped))
    assert run.journal is not None
    doubt = standing([run.journal], JOB).doubt
    if doubt is None:
        return
    sent = next(t for t, b in run.begun if b.index == doubt.block)
    burnt = sum(r["t1"] - r["t0"] for r in run.lit if r["t0"] >= sent)
    assert doubt.least_s <= burnt + 1e-3
    assert burnt <= doubt.most_s + 1e-3
    assert doubt.most_s <= doubt.whole_s + 1.0


def test_some_light_is_sure_where_a_report_showed_it(tmp_path):
    def stopped(link: SimulatedLink) -> None:
        raise KeyboardInterrupt

    run = simulated(PLAN, tmp_path / "first.jsonl", **at(2.35, stopped))
    doubt = standing([run.journal], JOB).doubt
    assert doubt is not None and doubt.least_s > 0.1


def test_a_stop_from_another_thread(tmp_path):
    import threading

    stop = threading.Event()
    run = simulated(PLAN, tmp_path / "first.jsonl", stop=stop, **at(2.7, lambda _link: stop.set()))
    assert "stopped on request" in str(run.error)
    assert max(r["t1"] for r in run.lit) <= START + 2.7 + 0.150


def test_a_read_only_folder_lights_nothing(tmp_path):
    run = simulated(PLAN, Path("/proc/no-such-folder/journal.jsonl"))
    assert "cannot write the journal" in str(run.error)
    assert set(lines_of(run.link)) <= HARMLESS
