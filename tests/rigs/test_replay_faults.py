"""What every fault of machine, port and host ends in: dark, with a journal that says where."""

from __future__ import annotations

import dataclasses
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.errors import MachineError
from rigs.journal import read_journal
from rigs.link import open_link
from rigs.replay import replay
from tests.rigs.replay_jobs import RIG, small_job
from tests.rigs.replay_runs import lit, read_trace, run

REPOSITORY = Path(__file__).resolve().parents[2]

FAULTS = [
    ("error:20@17", "error:20 to 'G1X210Y150F6000S500': command not supported", 1),
    ("alarm:1@17", "ALARM:1: hard limit", 1),
    ("alarm:171@17", "ALARM:171: not listed", 1),
    ("drop@17", "the port vanished", 1),
    ("mute@17", "the end of the light was due", 1),
    ("power@17", "restarted in the middle of the job", 1),
    ("no-ok@17", "answers are missing", 1),
    ("garble@17", "answer not understood: 'o'", 1),
    ("extra-ok@19", "an 'ok' too many", 1),
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
        run(tmp_path, faults=["error:9@12"])
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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_signal_darkens_and_closes_the_journal(tmp_path: Path, number: signal.Signals) -> None:
    script = (
        # a suite that was started in the background passes an ignored SIGINT on
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"
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
