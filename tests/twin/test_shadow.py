"""The twin beside the machine: the virtual part, and the shadow that stops what differs from the job."""

from __future__ import annotations

import contextlib
import math
import re
import socket
from dataclasses import replace

import pytest

from rigs.angle_steering import AngleSteering
from rigs.errors import MachineError
from rigs.grbl import Status
from rigs.measuring import SerialGauge
from rigs.replay_blocks import lit_block, replay_job
from rigs.rotary_encoder import RotaryEncoder
from rigs.watch import Watches
from tests.rigs.made_jobs import made
from tests.twin.bench_replay import bench_replay
from tests.twin.star_replay import STEEL, heat_all, made_star, part_of, run
from twin.gauge_port import gauge_port
from twin.journal_shadow import journal_shadow
from twin.shadow import Shadow, VirtualPart
from twin.traced_part import TracedPart
from twin.workpiece import Workpiece


@pytest.fixture(scope="module")
def star():
    return made_star()


@pytest.mark.parametrize("tilt", [0.0, 20.0])
def test_the_strokes_of_the_job_fold_what_the_process_predicts(tilt):
    plan, process, rig, job = made("star", tilt_deg=tilt)
    part = Workpiece(plan, process, rig, STEEL)
    heat_all(part, job)
    predicted = {fold.crease: fold.predicted_rad for fold in process.folds}
    assert set(part.angles_rad) == set(predicted)
    for crease, angle in predicted.items():
        assert part.angles_rad[crease] == pytest.approx(angle, rel=0.02)
    assert part.completion() > 0.98


def test_gain_and_dose_scale_what_a_stroke_does(star):
    _, process, _, job = star
    block = next(b for b in job.blocks if b.kind == "pass")
    plain, strong = part_of(star), part_of(star, 1.5)
    one = plain.heat(block.path[0], block.path[-1], block.rotary_rad, block.power_w, block.speed_mm_s)
    two = strong.heat(block.path[0], block.path[-1], block.rotary_rad, block.power_w, 2.0 * block.speed_mm_s)
    assert one.crease == two.crease == block.crease
    assert two.change_rad == pytest.approx(0.75 * one.change_rad)
    first = next(f for f in process.folds if f.crease == block.crease)
    assert one.change_rad == pytest.approx(first.increments_rad[0], rel=0.02)


def test_cuts_and_strokes_elsewhere_fold_nothing(star):
    _, _, _, job = star
    part = part_of(star)
    for block in job.blocks:
        if block.kind == "cut":
            for a, b in zip(block.path, block.path[1:], strict=False):
                part.heat(a, b, block.rotary_rad, block.power_w, block.speed_mm_s)
    assert not part.angles_rad
    assert part.heat((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.0, 5.0, 50.0).crease == -1
    assert part.heat((200.0, 150.0, 0.0), (201.0, 150.0, 0.0), math.pi / 2, 5.0, 50.0).crease == -1


def test_the_shadow_of_a_good_run_sees_the_plan(star, tmp_path):
    _, _, rig, job = star
    shadow = Shadow(job, rig, part_of(star))
    assert run(star, tmp_path, watch=shadow).outcome == "complete"
    assert shadow.reports_seen >= len(job.blocks) // 2 and shadow.off_mm < 0.01
    assert shadow.part.completion() > 0.98


def test_the_journal_afterwards_gives_the_same_picture(star, tmp_path):
    """With measured angles too, and of a part that bends less than the model."""
    _, process, rig, job = star
    for name, gain in (("plain", None), ("measured", 0.8)):
        part = part_of(star, gain or 1.0)
        shadow = Shadow(job, rig, part_of(star), steered=gain is not None)
        steering = None
        if gain is not None:
            steering = AngleSteering(
                job, process, gauge_of(part), lambda *_: True, told=shadow.part.angles_rad.__setitem__
            )
        folder = tmp_path / name
        folder.mkdir()
        watch = Watches(shadow, VirtualPart(job, part))
        journal = run(star, folder, watch=watch, steering=steering)
        again = journal_shadow(journal, job, rig, part_of(star))
        assert again.part.angles_rad == pytest.approx(shadow.part.angles_rad, abs=1e-9)
        assert again.part.strokes == pytest.approx(shadow.part.strokes) and not again.unlike
        kinds = {r["kind"] for r in journal.records}
        assert "status" in kinds and ("measured" in kinds) == (gain is not None)


def gauge_of(part):
    return lambda crease, _: (math.degrees(part.angles_rad.get(crease, 0.0)), 0.1)


def test_the_shadow_of_a_dry_run_folds_nothing(star, tmp_path):
    _, _, rig, job = star
    shadow = Shadow(job, rig, part_of(star), lit=False)
    assert run(star, tmp_path, watch=shadow, mode="dry-run").outcome == "complete"
    assert shadow.part.completion() == 0.0 and shadow.off_mm < 0.01


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"X": 3.0}, "off its path"), ({"A": 5.0}, "rotary is at"), ({"s": 900.0}, "instead of S"),
        ({"t": 60.0}, "longer than"),
    ],
)  # fmt: skip
def test_what_differs_stops_the_machine(star, change, words):
    _, _, rig, job = star
    shadow = Shadow(job, rig, part_of(star))
    plan = replay_job(job)
    number = next(k for k, b in enumerate(job.blocks) if b.kind == "pass")
    sent, block = plan.blocks[number + 1], job.blocks[number]
    for before in plan.blocks[: number + 1]:
        shadow.begins(before, 0.1, 0.0)
        shadow.confirmed(before, dict(before.expect), 0.1)
    shadow.begins(sent, block.seconds, 0.2)
    place = dict(zip("XYZ", block.path[0], strict=True)) | {"A": math.degrees(block.rotary_rad)}
    good = Status("Run", s=block.s_word)
    shadow.reports(good, place, 0.3)
    for word in ("X", "A"):
        if word in change:
            place[word] += change[word]
    with pytest.raises(MachineError, match=words):
        shadow.reports(replace(good, s=change.get("s", good.s)), place, change.get("t", 0.3))


def test_light_in_a_dark_block_stops_the_machine(star):
    _, _, rig, job = star
    shadow = Shadow(job, rig, part_of(star))
    sent = replay_job(job).blocks[1]
    shadow.begins(sent, 1.0, 0.0)
    with pytest.raises(MachineError, match="no light"):
        shadow.reports(Status("Run", s=300.0), dict(sent.expect), 0.1)


# Deviations that a machine really makes, seen in its own status reports


def runs(star, change=None, faults=(), pick=lambda blocks: blocks, trace=None, **more):
    """Everything up to the fourth pass on the bench; the shadow that watched it."""
    _, _, rig, job = star
    shadow = Shadow(job, rig, part_of(star), **more)
    plan = replay_job(job)
    passes = [k for k, b in enumerate(plan.blocks) if b.kind == "pass"]
    blocks = pick(list(plan.blocks[: passes[3] + 1]))
    named = {} if change is None else {"change": change}
    bench_replay(blocks, rig, shadow, faults=faults, trace=trace, **named)
    return shadow


def in_passes(edit):
    """Change what is sent of the third pass."""
    seen = []

    def change(block, lines):
        if block.kind == "pass":
            seen.append(block.index)
        return [edit(line) for line in lines] if len(seen) == 3 and block.kind == "pass" else lines

    return change


def word(letter, by):
    """Adds to a word of a line, or multiplies where ``by`` is a text such as ``x0.5``."""

    def number(match):
        value = float(match[1])
        return f"{letter}{value * float(by[1:]) if isinstance(by, str) else value + by:.3f}"

    return lambda line: re.sub(rf"{letter}(-?[\d.]+)", number, line)


def test_the_shadow_of_what_the_beam_crossed_is_the_plan(star, tmp_path):
    shadow = runs(star)
    assert shadow.reports_seen > 20 and shadow.off_mm < 0.01 and shadow.dose_off < 0.01
    assert shadow.angle_off_deg < 0.01 and len(shadow.part.angles_rad) >= 1


def test_small_deviations_are_in_the_part_and_do_not_stop(star):
    """3 % less light within the limits: the shadow's part is folded less, as the reports say."""
    shadow = runs(star, in_passes(word("S", "x0.975")))
    assert 0.01 < shadow.dose_off < 0.05
    assert 0.0 < shadow.angle_off_deg < 0.2


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (word("X", 0.8), "mm off its path"),
        (word("X", 0.4), "along no crease, not along crease"),
        (word("S", "x0.8"), "instead of S"),
        (word("S", "x1.1"), "instead of S"),
        (word("F", "x0.15"), "it burns S465 at F778 instead of F5187.9"),
        (word("F", "x1.4"), "instead of F"),
        (lambda line: line.replace("M4", "M5"), "reports S0 instead of S"),
        (lambda line: line.replace("G1", "A4 G1", 1) if line.startswith("G1") else line, "rotary is at"),
    ],
)  # fmt: skip
def test_wrong_place_power_speed_and_rotary_stop_the_machine(star, edit, words):
    with pytest.raises(MachineError, match=f"the shadow stopped the machine in block.*({words})"):
        runs(star, in_passes(edit))


def test_a_pass_that_is_missing_or_comes_twice_stops_the_machine(star):
    def without(blocks):
        third = [b for b in blocks if b.kind == "pass"][2]
        return [b for b in blocks if b is not third]

    with pytest.raises(MachineError, match=r"a pass over crease .* was left out"):
        runs(star, pick=without)
    with pytest.raises(MachineError, match="comes again: it was lit already"):
        runs(star, pick=lambda blocks: [*blocks, blocks[-2]])
    assert runs(star, pick=lambda blocks: [*blocks, blocks[-2]], steered=True).part.strokes


def test_a_block_that_hangs_stops_the_machine(star):
    def hangs(block, lines):
        return [*lines[:-1], "G4 P30"] if block.kind == "rotate" or block.kind == "pass" else lines

    with pytest.raises(MachineError, match=r"s longer than the [\d.]+ s planned"):
        runs(star, hangs)


def test_light_between_the_blocks_stops_the_machine(star):
    def lights(block, lines):
        return ["M3 S100", *lines] if block.kind == "goto" and block.step > 0 else lines

    with pytest.raises(MachineError, match="where there should be no light"):
        runs(star, lights)


def test_without_strictness_it_says_what_differed(star):
    shadow = runs(star, in_passes(word("S", "x0.8")), strict=False)
    assert any("instead of S" in line for line in shadow.unlike) and shadow.angle_off_deg > 0.1


def test_the_traced_part_is_folded_by_what_the_beam_burnt(star, tmp_path):
    """The trace knows of a slipped rotary, the status reports do not."""
    _, _, rig, job = star
    good, bad = (TracedPart(tmp_path / name, rig, part_of(star)) for name in ("good", "bad"))
    shadow = runs(star, trace=good.path)
    assert good.update().angles_rad == pytest.approx(shadow.part.angles_rad, rel=0.02)
    assert good.beside_j == pytest.approx(
        sum(b.energy_j for b in job.blocks[:20] if b.kind == "cut"), rel=0.01
    )
    runs(star, trace=bad.path, faults=("slip:X2@30",))
    assert not bad.update().angles_rad and bad.beside_j > good.beside_j


def test_lost_steps_of_the_rotary_stop_before_light(star, tmp_path):
    """T21: the controller believes to be where it should, an encoder on the rotary says otherwise."""
    _, _, rig, job = star
    plan = replay_job(job)
    turn = next(
        k for k, b in enumerate(plan.blocks) if b.kind == "rotate" and dict(b.expect).get("A", 0.0) > 90.0
    )
    lines = sum(len(lit_block(b)) for b in plan.blocks[:turn])
    for name, faults in (("good", ()), ("bad", (f"slip:A-5@{lines + 1}",))):
        traced = TracedPart(tmp_path / name, rig, part_of(star))
        with gauge_port(traced) as url, contextlib.closing(SerialGauge(url, timeout_s=5.0)) as gauge:
            encoder = RotaryEncoder(rig, lambda gauge=gauge: gauge.reading("A", "the rotary")[0])
            if name == "good":
                bench_replay(plan.blocks[: turn + 3], rig, encoder, trace=traced.path)
                assert encoder.turns >= 2 and encoder.off_deg < 0.05
                continue
            with pytest.raises(
                MachineError, match=r"encoder has the rotary at 175\.0.*controller at -?180\.0"
            ):
                bench_replay(plan.blocks, rig, encoder, faults=faults, trace=traced.path)
            assert not traced.update().angles_rad  # no pass after the turn


def test_the_gauge_on_the_port_measures_the_traced_part(star, tmp_path):
    _, _, rig, _ = star
    traced = TracedPart(tmp_path / "trace", rig, part_of(star))
    runs(star, trace=traced.path)
    crease, angle = next(iter(traced.update().angles_rad.items()))
    with gauge_port(traced) as url:
        gauge = SerialGauge(url, timeout_s=5.0)
        assert gauge(crease, math.degrees(angle)) == pytest.approx((math.degrees(angle), 0.2), abs=1e-3)
        gauge.close()
        host, port = url.removeprefix("socket://").split(":")
        with socket.create_connection((host, int(port)), timeout=5.0) as link:
            for question, answer in ((b"A\n", b"180.0000\n"), (b"hello\n", b"ERR\n"), (b"Mx\n", b"ERR\n")):
                link.sendall(question)
                assert link.recv(64) == answer
