"""How fast the host sends, what a confirmed block costs, how well times are estimated, how much CPU is used.

``python benchmarks/replay_speed.py`` prints a Markdown table. Times of the machine are simulated (emulated
controller, link of 115 200 baud), so they do not depend on this computer; lines per second, CPU and fsync do.
"""

from __future__ import annotations

import itertools
import os
import resource
import socket
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from rigs.emulator import start_emulator
from rigs.job import Job
from rigs.profile_writer import profile_toml
from rigs.replay import Progress, replay
from rigs.replay_blocks import PlainBlock, ReplayJob, replay_job
from rigs.rig import Rig
from rigs.watch import Watches
from tests.rigs.fault_runs import simulated
from tests.rigs.made_jobs import made
from tests.rigs.replay_jobs import RIG, small_job
from tests.rigs.simulated_link import SimulatedLink
from tests.rigs.test_odd_peers import GOOD, STATUS
from tests.rigs.test_send_ahead import replace_buffer, wire_job

PASSES = 100


@contextmanager
def null_peer() -> Iterator[str]:
    """Answers everything at once and does nothing."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def talk() -> None:
            client, _ = listener.accept()
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with client:
                while data := client.recv(65536):
                    out = b""
                    for part in data.replace(b"?", b"?\0").replace(b"\n", b"\n\0").split(b"\0"):
                        if part:
                            out += GOOD.get(part, STATUS if part == b"?" else b"ok\r\n")
                    client.sendall(out)

        thread = threading.Thread(target=talk, daemon=True)
        thread.start()
        yield f"socket://127.0.0.1:{listener.getsockname()[1]}"


def null_job(blocks: int) -> ReplayJob:
    """Dark blocks of ten lines that end where the null peer says that it stands."""
    here = (("X", 400.0), ("Y", 300.0))
    lines = tuple(f"G1X{400 - n % 2}Y300F6000" for n in range(9))
    made_blocks = [PlainBlock(-1, "head", ("G21", "G90"))]
    made_blocks += [
        PlainBlock(k, "goto", (*lines, "G4P0.01"), seconds=1.0, expect=here) for k in range(blocks)
    ]
    return ReplayJob(tuple(made_blocks), "a" * 64, RIG.sha256, "c" * 64)


def lines_per_second(folder: Path) -> tuple[float, float]:
    """Host against the null peer: lines in a second, and in a second of the host's own CPU time.

    The peer is Python too and shares the process; the second figure does not depend on other load.
    """
    job = null_job(1500)
    lines = sum(len(b.lines) + 1 for b in job.blocks)
    wall, own = 0.0, 0.0
    for number in range(5):
        with null_peer() as url:
            start, cpu = time.perf_counter(), time.thread_time()
            replay(job, url, rig=RIG, journal_path=folder / f"null-{number}", mode="dry-run")
            wall = max(wall, lines / (time.perf_counter() - start))
            own = max(own, lines / (time.thread_time() - cpu))
    return wall, own


def window_share(folder: Path, rig: Rig, name: str, *, ahead: bool, real: bool) -> tuple[float, float]:
    """Lines in a second and share of the bytes that 115 200 baud carry, of a dry run that the wire holds up.

    Counted between the first and the last answer of its second half; ``real`` runs processes and a paced
    socket in real time, else all of it is simulated.
    """
    job = wire_job(rig, blocks=400, lines=4)
    half = job.blocks[len(job.blocks) // 2 :]
    lines = [f"{line}\n" for block in half for line in block.lines]
    seen: dict[int, float] = {}

    def told(at: Progress) -> None:
        seen[at.block] = time.perf_counter() if real else clock()

    clock: Callable[[], float] = time.perf_counter
    journal = folder / f"{name}.jsonl"
    if real:
        profile = folder / f"{name}.toml"
        profile.write_text(profile_toml(rig), "utf-8")
        with start_emulator(profile, time_scale=1.0, baud=115200) as machine:
            watch = None if ahead else Watches()
            replay(job, machine.url, rig=rig, journal_path=journal, on_progress=told, watch=watch)
    else:

        def note(link: SimulatedLink) -> None:
            nonlocal clock
            clock = link.clock.monotonic

        run = simulated(
            job,
            journal,
            mode="dry-run",
            rig=rig,
            watched=not ahead,
            on_progress=told,
            prepare=note,
            alone_s=1.0,
        )
        assert run.error is None, run.error
    seconds = seen[len(job.blocks)] - seen[len(job.blocks) - len(half)]
    return len(lines) / seconds, sum(map(len, lines)) / seconds / 11520.0


def overhead_ms(folder: Path, latency_s: float) -> float:
    """Simulated time of 100 passes of 20 mm at 100 mm/s beyond their motion and cooling."""
    job = small_job(PASSES)
    run = simulated(job, folder / f"overhead-{latency_s}", latency_s=latency_s, alone_s=1.0)
    assert run.error is None, run.error
    times = [t for t, b in run.begun if b.kind == "pass"]
    steps = sorted(b - a for a, b in itertools.pairwise(times))
    motion = 20.0 / 100.0 + 100.0 / 2000.0 + 0.01
    return 1000.0 * (statistics.median(steps) - motion)


def fsync_ms(folder: Path) -> float:
    """Median of one record with fsync on this disk."""
    from rigs.journal import JournalWriter

    journal = JournalWriter(folder / "fsync", durable=True)
    times = []
    for number in range(200):
        start = time.perf_counter()
        journal.write("intent", sync=True, block=number, step=0, beam_s=1.0, t=0.0)
        times.append(time.perf_counter() - start)
    journal.close()
    return 1000.0 * statistics.median(times)


def cpu_share(folder: Path) -> float:
    """CPU time of the host over wall time, beside an emulated machine in real time."""
    job = small_job(60)
    with start_emulator(time_scale=1.0) as machine:
        before, start = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter()
        replay(job, machine.url, rig=RIG, journal_path=folder / "cpu", mode="arm")
        after, wall = resource.getrusage(resource.RUSAGE_SELF), time.perf_counter() - start
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / wall


def jobs() -> Iterator[tuple[str, Job, Rig]]:
    """Twenty-four jobs: three shapes, two rigs, tilts and materials."""
    for goal in ("star", "box", "ball"):
        for material in ("304", "316", "1095"):
            for rig, tilt in (("grbl-4axis", 0.0), ("galvo-like", 0.0), ("grbl-4axis", 15.0)):
                if (goal, material) == ("ball", "1095"):
                    continue
                _, _, machine, job = made(goal, rig, material, tilt_deg=tilt)
                yield f"{goal}, {material}, {rig}, {tilt:g} degrees", job, machine


def estimates(folder: Path, most_blocks: int = 400) -> list[tuple[str, float, float]]:
    """(job, estimated, executed) in seconds, from the first block after the way to the work."""
    rows = []
    for number, (name, job, rig) in enumerate(jobs()):
        short = replace(job, blocks=job.blocks[:most_blocks])
        run = simulated(replay_job(short), folder / f"eta-{number}", rig=rig, alone_s=1.0)
        assert run.error is None, (name, run.error)
        begun = {b.index: t for t, b in run.begun}
        executed = run.ended - begun[2]
        rows.append((name, sum(b.seconds for b in short.blocks[2:]), executed))
    return rows


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        print(f"computer: {os.cpu_count()} cores\n")
        print("| what | figure | goal |\n|---|---|---|")
        wall, own = lines_per_second(folder)
        print(f"| host against a null peer | {wall:.0f} lines/s | 5000 |")
        print(f"| the same, by its own CPU time | {own:.0f} lines/s | |")
        print(f"| a confirmed pass over its motion, 115 200 baud | {overhead_ms(folder, 0.0):.1f} ms | 35 |")
        print(f"| the same with 4 ms of latency each way | {overhead_ms(folder, 0.004):.1f} ms | |")
        print(f"| one INTENT with fsync, light off | {fsync_ms(folder):.2f} ms | |")
        print(f"| CPU of the host while it runs | {100.0 * cpu_share(folder):.1f} % of a core | 10 |")
        for rx_bytes, real in ((255, False), (128, False), (255, True), (128, True)):
            for ahead in (True, False):
                name = f"{rx_bytes}-{real}-{ahead}"
                lines, share = window_share(folder, replace_buffer(rx_bytes), name, ahead=ahead, real=real)
                how = "sent ahead" if ahead else "block by block"
                where = "processes, real time" if real else "simulated"
                goal = "95 %" if ahead else ""
                print(
                    f"| dry run {how}, {rx_bytes} bytes, {where} | {lines:.0f} lines/s, "
                    f"{100.0 * share:.1f} % of the link | {goal} |"
                )
        rows = estimates(folder)
        worst = max(abs(done / planned - 1.0) for _, planned, done in rows)
        print(f"| estimated against executed, {len(rows)} jobs | {100.0 * worst:.1f} % at most | 5 |\n")
        print("| job | estimated, s | executed, s | off |\n|---|---|---|---|")
        for name, planned, done in rows:
            print(f"| {name} | {planned:.1f} | {done:.1f} | {100.0 * (done / planned - 1.0):+.1f} % |")


if __name__ == "__main__":
    main()
