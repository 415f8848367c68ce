"""Ctrl-Z on a terminal holds a replay; ``go`` lets it go on, anything else stops it."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.journal import read_journal
from tests.rigs.replay_runs import lit, read_trace

pty = pytest.importorskip("pty", reason="no pseudo-terminals here")
REPOSITORY = Path(__file__).resolve().parents[2]
SCRIPT = """
import sys, types
from pathlib import Path
from rigs.errors import JobError
from rigs.replay import replay
from studio.progress import Progress
from studio.replay_stage import holding_of
from tests.rigs.replay_jobs import RIG, small_job
ws = types.SimpleNamespace(progress=Progress())
def say(p):
    if p.block == 6: print("SIX", flush=True)
with holding_of(ws) as holding, ws.progress.stage("replay", "test"):
    try:
        journal = Path(sys.argv[2])
        replay(small_job(60), sys.argv[1], rig=RIG, journal_path=journal, mode="arm", on_progress=say,
               holding=holding)
    except JobError as error:
        print(error)
        sys.exit(1)
"""


def until(terminal: int, words: str, seconds: float = 60.0) -> str:
    """What the program writes up to some words."""
    text, deadline = "", time.monotonic() + seconds
    while words not in text:
        ready, _, _ = select.select([terminal], [], [], max(deadline - time.monotonic(), 0.0))
        assert ready, f"'{words}' did not come: {text[-300:]}"
        text += os.read(terminal, 4096).decode("utf-8", "replace")
    return text


@pytest.mark.parametrize(("answer", "code"), [("go", 0), ("no", 1)])
def test_ctrl_z_and_an_answer(tmp_path, answer, code):
    trace, journal = tmp_path / "trace", tmp_path / "journal"
    ours, theirs = pty.openpty()
    with start_emulator(trace=trace, time_scale=10.0) as machine:
        host = subprocess.Popen(
            [sys.executable, "-c", SCRIPT, machine.url, str(journal)], cwd=REPOSITORY, stdin=theirs,
            stdout=theirs, stderr=theirs, preexec_fn=lambda: _terminal(theirs),
        )  # fmt: skip
        os.close(theirs)
        until(ours, "SIX")
        os.write(ours, b"\x1a")
        asked = until(ours, "stops the job: ")
        assert "EMULATED machine held in block" in asked and "Ctrl-Z holds" not in asked
        os.write(ours, answer.encode() + b"\n")
        deadline = time.monotonic() + 60.0
        while host.poll() is None and time.monotonic() < deadline:
            if select.select([ours], [], [], 0.1)[0]:
                try:
                    os.read(ours, 4096)
                except OSError:
                    break
        assert host.wait(timeout=30) == code
    os.close(ours)
    back = read_journal(journal)
    kinds = [r["kind"] for r in back.records]
    assert kinds.count("held") == 1
    assert kinds.count("released") == (1 if code == 0 else 0)
    assert back.outcome == ("complete" if code == 0 else "stopped")
    records = read_trace(trace)
    assert records[-1]["rest_beam_s"] == 0.0
    assert len(lit(records)) >= 60 if code == 0 else len(lit(records)) < 60


def _terminal(descriptor: int) -> None:
    import fcntl
    import termios

    os.setsid()
    fcntl.ioctl(descriptor, termios.TIOCSCTTY, 0)
