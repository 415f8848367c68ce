"""What is refused before a byte is sent or a beam is armed."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import msgspec
import pytest

from rigs.emulator import start_emulator
from rigs.errors import JobError, MachineError
from rigs.journal import read_journal
from rigs.replay import replay
from rigs.replay_blocks import PlainBlock
from rigs.replay_checks import Certificate, check_certificate, check_dry_run
from tests.rigs.replay_jobs import RIG, small_job
from tests.rigs.replay_runs import STROKES, lit, read_trace, run


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
