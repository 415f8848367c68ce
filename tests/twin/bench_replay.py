"""A job replayed on the emulated machine in simulated time, with a watch that sees its status reports."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from rigs.emulator.config import config_for
from rigs.emulator.faults import read_faults
from rigs.emulator.machine import GrblMachine
from rigs.emulator.trace import Trace
from rigs.grbl import Status, read_status
from rigs.replay_blocks import ReplayBlock, lit_block
from rigs.rig import Rig
from rigs.watch import Watch

REPORT_S = 0.02


def bench_replay(
    blocks: Iterable[ReplayBlock],
    rig: Rig,
    watch: Watch,
    *,
    change: Callable[[ReplayBlock, tuple[str, ...]], Sequence[str]] = lambda _block, lines: lines,
    faults: Sequence[str] = (),
    trace: Path | None = None,
) -> GrblMachine:
    """Run blocks with a report every ``REPORT_S``; ``change`` says what is really sent of a block."""
    with (trace or Path(os.devnull)).open("w", encoding="ascii", buffering=1) as file:
        machine = GrblMachine(config_for(rig), Trace(file), read_faults(faults))
        machine.state = "Idle"
        machine.motion.position = (0.0,) * len(rig.axis_words)
        machine.out.clear()

        def look() -> tuple[Status, dict[str, float]]:
            machine.receive(b"?")
            text = machine.out.decode("ascii").strip().splitlines()
            answers.extend(t for t in text if not t.startswith("<"))
            machine.out.clear()
            status = read_status(text[-1])
            assert status is not None and status.machine is not None
            offset = rig.controller.g54_mm or (0.0,) * len(rig.axis_words)
            places = (m - o for m, o in zip(status.machine, offset, strict=True))
            return status, dict(zip(rig.axis_words, places, strict=True))

        for block in blocks:
            lines = change(block, lit_block(block))
            answers: list[str] = []
            watch.begins(block, block.seconds, machine.now)
            machine.receive("".join(f"{line}\n" for line in lines).encode("ascii"))
            status, place = look()
            while sum(a == "ok" for a in answers) < len(lines):
                assert not any(a.startswith(("error", "ALARM")) for a in answers), answers
                machine.advance(machine.now + REPORT_S)
                status, place = look()
                watch.reports(status, place, machine.now)
            watch.confirmed(block, place, machine.now)
        machine.advance(machine.now)
        return machine
