"""The star and its job, its part, and runs of it on the emulated machine."""

from __future__ import annotations

from rigs.emulator import start_emulator
from rigs.job import Job
from rigs.material import load_material
from rigs.replay import replay
from tests.rigs.made_jobs import made
from twin.workpiece import Workpiece

STEEL = load_material("304")


def made_star():
    return made("star")


def part_of(star, gain: float = 1.0, **more) -> Workpiece:
    plan, process, rig, _ = star
    return Workpiece(plan, process, rig, STEEL, gain, **more)


def heat_all(part: Workpiece, job: Job) -> None:
    for block in job.blocks:
        if block.kind == "pass":
            part.heat(block.path[0], block.path[-1], block.rotary_rad, block.power_w, block.speed_mm_s)


def run(star, tmp_path, *, watch=None, steering=None, mode="arm", faults=(), settings=None):
    _, _, rig, job = star
    with start_emulator(faults=list(faults), settings=settings) as machine:
        return replay(
            job, machine.url, rig=rig, journal_path=tmp_path / "journal.jsonl", mode=mode, watch=watch,
            steering=steering,
        )  # fmt: skip
