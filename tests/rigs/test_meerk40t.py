"""MeerK40t's GRBL emulator, which nobody here wrote, takes our jobs over a socket without an error."""

from __future__ import annotations

import itertools
import math
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from rigs.controller import Controller
from rigs.link import open_link
from rigs.replay_blocks import lit_block, replay_job
from rigs.replay_checks import identity_mistakes
from tests.rigs.fault_runs import JOB_RIG, fault_job
from tests.rigs.made_jobs import made

pytest.importorskip("meerk40t", reason="MeerK40t is not installed (pip install meerk40t pillow)")


class Driver:
    """Keeps what MeerK40t's parser asks a laser to do."""

    speed, power = 0, 0

    def __init__(self) -> None:
        self.place = (0.0, 0.0)
        self.lit: list[tuple[float, float, float, float, float]] = []

    def status(self) -> tuple[tuple[float, float], str, str]:
        return self.place, "idle", "idle"

    def move_abs(self, x: float, y: float) -> None:
        self.place = (x, y)

    def plot(self, cut: object) -> None:
        points = getattr(cut, "_points", [])
        powers = getattr(cut, "_powers", [])
        for (before, after), on in zip(itertools.pairwise(points), powers, strict=True):
            if on:
                self.lit.append((*before, *after, cut.settings["power"]))  # type: ignore[attr-defined]
        if points:
            self.place = points[-1]

    def __getattr__(self, name: str) -> object:
        return lambda *_args: None


@contextmanager
def meerk40t() -> Iterator[tuple[str, Driver, float]]:
    """The emulator behind a socket; its URL, what it was asked, its units in a mm."""
    from meerk40t.grbl.emulator import GRBLEmulator
    from meerk40t.svgelements import Matrix

    driver = Driver()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        emulator = GRBLEmulator(SimpleNamespace(driver=driver), Matrix())

        def run() -> None:
            client, _ = listener.accept()
            emulator.reply = lambda text: client.sendall(text.encode("utf-8"))
            with client:
                client.sendall("Grbl 1.1f [‘$’ for help]\r\nok\r\nok\r\n".encode())  # as its server greets
                while data := client.recv(4096):
                    emulator.write(data)

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        yield f"socket://127.0.0.1:{listener.getsockname()[1]}", driver, float(emulator.job.scale)
        thread.join(timeout=10.0)


@pytest.mark.parametrize("goal", ["by hand", "star", "box"])
def test_it_takes_a_job_without_an_error(goal):
    rig, job = (JOB_RIG, fault_job()) if goal == "by hand" else made(goal, "grbl-4axis")[2:]
    with meerk40t() as (url, driver, scale):
        link = open_link(url, rig)
        try:
            controller = Controller(link, rig)
            controller.hello()
            assert any("does not say what it is" in m for m in identity_mistakes(controller.identify(), rig))
            controller.gate.level = "armed"
            for block in replay_job(job).blocks:
                controller.run(lit_block(block), block.seconds, 5.0)
                place = controller.work_position(controller.confirm_idle())
                for word, wanted in block.expect:
                    assert word not in "XY" or abs(place[word] - wanted) <= 0.01
        finally:
            link.close()
    lit = [(x0 / scale, y0 / scale, x1 / scale, y1 / scale, s) for x0, y0, x1, y1, s in driver.lit]
    lit = [move for move in lit if math.dist(move[:2], move[2:4]) > 1e-3]
    blocks = [b for b in job.blocks if b.lit]
    wanted = [(*p[:2], *q[:2], b.s_word) for b in blocks for p, q in itertools.pairwise(b.path)]
    assert len(lit) == len(wanted) > 0
    for have, want in zip(lit, wanted, strict=True):
        assert max(abs(p - q) for p, q in zip(have, want, strict=True)) < 0.01
