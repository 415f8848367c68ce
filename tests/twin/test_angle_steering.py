"""Passes by measured angles: how many, the running factor, and what happens beyond the tolerance."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigs.angle_steering import AngleSteering, Gain
from rigs.errors import JobError
from rigs.journal import read_journal
from rigs.replay_blocks import replay_job
from tests.twin.star_replay import heat_all, made_star, part_of, run
from twin.shadow import VirtualPart


@pytest.fixture(scope="module")
def star():
    return made_star()


@pytest.mark.parametrize("gain", [0.7, 0.8, 1.0, 1.25])
def test_measuring_ends_within_a_pass_of_the_plan(star, tmp_path, gain):
    """A part that bends by another factor than the model: within a pass with measuring, far off without."""
    _, process, _, job = star
    blind = part_of(star, gain)
    heat_all(blind, job)
    part = part_of(star, gain)
    steering = AngleSteering(
        job, process, lambda crease, _: (math.degrees(part.angles_rad.get(crease, 0.0)), 0.1), lambda *_: True
    )
    assert run(star, tmp_path, watch=VirtualPart(job, part), steering=steering).outcome == "complete"
    for fold in process.folds:
        one_pass = max(abs(x) for x in fold.increments_rad) * max(gain, 1.0)
        assert abs(part.angles_rad[fold.crease] - fold.to_rad) <= 1.01 * one_pass
        if abs(gain - 1.0) > 0.15:
            assert abs(blind.angles_rad[fold.crease] - fold.to_rad) > 3.0 * one_pass
    assert steering.gain.value == pytest.approx(gain, abs=0.05)
    assert len(steering.readings) == len(process.folds)


def test_38_where_45_were_expected_makes_more_passes(star):
    """T22: a gauge that reads less gives further passes of the same setting."""
    _, process, _, job = star
    fold = process.folds[0]
    last = [k for k, b in enumerate(job.blocks) if b.step == fold.step and b.kind == "pass"][-1]
    readings = iter([38.0 / 45.0, 0.97, 1.0, 1.0])
    steering = AngleSteering(
        job, process, lambda *_: (math.degrees(fold.to_rad) * next(readings), 0.1), lambda *_: True,
        gain=Gain(1.0, 1e-6),
    )  # fmt: skip
    plan = replay_job(job)
    sent = [b for k in range(last + 1) for b in steering.blocks_for(plan.blocks[k + 1])]
    passes = [b for b in sent if b.kind == "pass" and b.step == fold.step]
    assert len(passes) > fold.passes
    lines = {b.lines for b in passes}
    assert lines <= {plan.blocks[k + 1].lines for k in range(last + 1)}  # nothing that was not validated


@pytest.mark.parametrize("accepts", [True, False])
def test_beyond_tolerance_the_rest_of_the_plan_is_checked(star, tmp_path, accepts):
    _, process, _, job = star
    part = part_of(star, 3.0)  # nothing takes an overshoot back
    asked: list[tuple[int, float]] = []

    def accept(step: int, angle: float) -> bool:
        asked.append((step, angle))
        return accepts

    steering = AngleSteering(
        job, process, lambda crease, _: (math.degrees(part.angles_rad.get(crease, 0.0)), 0.1), accept
    )
    if accepts:
        assert run(star, tmp_path, watch=VirtualPart(job, part), steering=steering).outcome == "complete"
    else:
        with pytest.raises(JobError, match="does not hold"):
            run(star, tmp_path, watch=VirtualPart(job, part), steering=steering)
        assert read_journal(tmp_path / "journal.jsonl").outcome == "stopped"
    assert asked


def test_the_gain_learns_within_limits():
    gain = Gain()
    for _ in range(50):
        gain.learn(40.0, 32.0, 0.3)
    assert gain.value == pytest.approx(0.8, abs=1e-3) and gain.at_most < 0.9
    wild = Gain()
    for _ in range(20):
        wild.learn(40.0, 4000.0, 0.3)
    assert wild.value <= 2.5
    small = Gain()
    small.learn(0.2, 5.0, 0.3)
    assert small.value == 1.0


def test_random_gains_of_creases_average_out(star, tmp_path):
    _, process, _, job = star
    rng = np.random.default_rng(3)
    gains = {f.crease: float(rng.normal(0.9, 0.05)) for f in process.folds}
    part = part_of(star, 0.9, gains=gains)
    steering = AngleSteering(
        job, process, lambda crease, _: (math.degrees(part.angles_rad.get(crease, 0.0)), 0.2), lambda *_: True
    )
    run(star, tmp_path, watch=VirtualPart(job, part), steering=steering)
    worst = max(abs(part.angles_rad[f.crease] - f.to_rad) for f in process.folds)
    assert worst <= 1.5 * max(abs(x) for f in process.folds for x in f.increments_rad)
