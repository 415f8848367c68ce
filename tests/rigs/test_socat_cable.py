"""A real serial path: socat's pseudo-terminals between pyserial and the emulated machine, and pulled out."""

from __future__ import annotations

import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rigs.emulator import start_emulator
from rigs.errors import MachineError
from rigs.journal import read_journal
from rigs.link import open_link
from rigs.replay import replay
from tests.rigs.replay_jobs import RIG, small_job
from tests.rigs.replay_runs import lit, read_trace

SOCAT = shutil.which("socat")
pytestmark = pytest.mark.skipif(SOCAT is None, reason="socat is not installed (Debian: socat)")


@contextmanager
def cable(folder: Path, url: str) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A pseudo-terminal that leads to the emulator; its name, and the process that is the cable."""
    port = folder / "ttyV0"
    assert SOCAT is not None
    process = subprocess.Popen(
        [SOCAT, f"pty,link={port},raw,echo=0", "tcp:" + url.removeprefix("socket://") + ",nodelay"]
    )
    try:
        for _ in range(200):
            if port.exists():
                break
            time.sleep(0.05)
        yield str(port), process
    finally:
        process.kill()
        process.wait()


def test_a_job_goes_through_a_serial_port(tmp_path):
    with start_emulator(trace=tmp_path / "trace") as machine, cable(tmp_path, machine.url) as (port, _):
        journal = replay(
            small_job(), port, rig=RIG, journal_path=tmp_path / "j", mode="dry-run", home=True, grace_s=5.0
        )
    assert journal.outcome == "complete"
    assert journal.header["machine"] == "REAL"  # the mark of the emulator does not count over a cable
    assert lit(read_trace(tmp_path / "trace")) == []


def test_the_port_is_taken_once(tmp_path):
    with start_emulator() as machine, cable(tmp_path, machine.url) as (port, _):
        first = open_link(port, RIG)
        with pytest.raises(MachineError, match="cannot open the port"):
            open_link(port, RIG)
        first.close()


def test_the_cable_is_pulled(tmp_path):
    with start_emulator(time_scale=30.0) as machine, cable(tmp_path, machine.url) as (port, process):

        def pull(progress: object) -> None:
            if progress.block == 3:  # type: ignore[attr-defined]
                process.kill()

        with pytest.raises(MachineError):
            replay(
                small_job(400), port, rig=RIG, journal_path=tmp_path / "j", mode="dry-run", home=True,
                on_progress=pull, grace_s=5.0,
            )  # fmt: skip
    assert read_journal(tmp_path / "j").outcome == "fault"
