"""Starting the emulator as a process of its own."""

from __future__ import annotations

import contextlib
import json
import select
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigs.errors import MachineError

__all__ = ["Emulator", "start_emulator"]

_START_S = 30.0


@dataclass(frozen=True)
class Emulator:
    """A running emulator.

    Attributes:
        url: where it listens, ``socket://127.0.0.1:PORT``.
        process: its process.
    """

    url: str
    process: subprocess.Popen[bytes]

    def stop(self) -> None:
        """Let it finish its trace and end it."""
        if self.process.stdin is not None:
            with contextlib.suppress(OSError):
                self.process.stdin.close()
        try:
            self.process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe is not None:
                pipe.close()


@contextlib.contextmanager
def start_emulator(
    rig: str | Path = "grbl-4axis",
    *,
    time_scale: float = 0.0,
    trace: Path | None = None,
    faults: Sequence[str] = (),
    settings: dict[int, float] | None = None,
    baud: int = 0,
    port: int = 0,
) -> Iterator[Emulator]:
    """Run an emulated machine while the block runs.

    Args:
        rig: name or file of the rig to emulate.
        time_scale: simulated seconds in a real second; 0 runs as fast as possible.
        trace: file for what the machine did, complete once the block is left.
        faults: fault script, such as ``["error:9@120"]``.
        settings: ``$`` settings to change.
        baud: pace of the link as of a serial line; 0 passes bytes at once.
        port: on 127.0.0.1; 0 takes a free one.

    Yields:
        the emulator with its URL.

    Raises:
        MachineError: if it does not start.
    """
    command = [sys.executable, "-m", "rigs.emulator", "--rig", str(rig), "--time-scale", str(time_scale)]
    command += ["--with-parent"]
    command += ["--trace", str(trace)] if trace is not None else []
    command += ["--port", str(port)] if port else []
    command += ["--baud", str(baud)] if baud else []
    command += [word for fault in faults for word in ("--fault", fault)]
    command += [word for key, value in (settings or {}).items() for word in ("--set", f"{key}={value}")]
    process = subprocess.Popen(  # noqa: S603  the command is built here, no shell
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    emulator: Emulator | None = None
    try:
        emulator = Emulator(_read_url(process), process)
        yield emulator
    finally:
        (emulator or Emulator("", process)).stop()


def _read_url(process: subprocess.Popen[bytes]) -> str:
    if process.stdout is None or process.stderr is None:
        raise MachineError("the emulator was started without pipes")
    deadline = time.monotonic() + _START_S
    while time.monotonic() < deadline:
        ready, _, _ = select.select([process.stdout], [], [], 0.2)
        if ready:
            line = process.stdout.readline()
            if line:
                return str(json.loads(line)["url"])
        if process.poll() is not None:
            break
    process.kill()
    words = process.stderr.read().decode("utf-8", "replace").strip()
    raise MachineError(f"the emulator did not start: {words or 'no answer within 30 s'}")
