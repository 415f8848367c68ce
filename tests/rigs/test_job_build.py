"""Jobs and their G-code, read back by a plain interpreter and compared with the plan."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from planner.fold_plan import Cut, Fold, Release, Rotate
from planner.pattern import pattern_of
from rigs.errors import JobError
from rigs.gcode import gcode_program, write_gcode
from rigs.job_build import make_job
from rigs.material import load_material
from rigs.rig import load_rig
from tests.rigs.gcode_reader import read
from tests.rigs.made_jobs import made

STEEL = load_material("304")
CASES = [("star", 0.0), ("box", 0.0), ("star", 35.0)]


@pytest.fixture(scope="module", params=CASES, ids=lambda c: f"{c[0]}-{c[1]:g}")
def case(request):
    return made(request.param[0], tilt_deg=request.param[1])


def in_sheet(rig, place: dict[str, float]) -> np.ndarray:
    """Sheet coordinates (x, y, z) of what the focus lights, from machine coordinates alone."""
    a = -math.radians(place["A"]) * rig.rotary.sign
    d = np.array([place["X"], place["Y"], place["Z"]]) - np.array(rig.rotary.axis_point_mm)
    return np.array([d[0], d[1] * math.cos(a) - d[2] * math.sin(a), d[1] * math.sin(a) + d[2] * math.cos(a)])


def lit_on_sheet(rig, place: dict[str, float]) -> np.ndarray:
    """Sheet point (x, y) under the beam, which comes straight down: where its line meets the sheet."""
    a = math.radians(place["A"]) * rig.rotary.sign
    y = (place["Y"] - rig.rotary.axis_point_mm[1]) / math.cos(a)
    return np.array([place["X"] - rig.rotary.axis_point_mm[0], y])


def test_light_falls_on_the_creases_of_the_pattern_with_the_planned_dose(case):
    plan, process, rig, job = case
    pattern = pattern_of(plan)
    assert pattern.largest_shift_mm > 0.01
    program = read(write_gcode(job))
    blocks = [b for b in gcode_program(job).blocks if b.kind == "pass"]
    lit = {m.line: m for m in program.moves if m.s > 0.0}
    dose: dict[int, float] = {}
    length: dict[int, float] = {}
    for block in blocks:
        moves = [lit[n] for n in range(block.first_line, block.last_line + 1) if n in lit]
        assert len(moves) == 1
        move = moves[0]
        start, end = np.array(pattern.creases[block.crease])
        u = (end - start) / np.linalg.norm(end - start)
        for place in (move.start, move.end):
            point = lit_on_sheet(rig, place)
            assert abs(u[0] * (point - start)[1] - u[1] * (point - start)[0]) < 0.005
            assert -0.005 <= u @ (point - start) <= np.linalg.norm(end - start) + 0.005
            assert (
                abs(in_sheet(rig, place)[2])
                <= rig.head.depth_of_focus_mm / 2 / math.cos(math.radians(45)) + 1e-3
            )
        head = math.dist([move.start[k] for k in "XYZ"], [move.end[k] for k in "XYZ"])
        seconds = head / (move.feed / 60.0)
        dose[block.step] = dose.get(block.step, 0.0) + rig.laser.power_for_s(move.s) * seconds
        on_sheet = np.linalg.norm(lit_on_sheet(rig, move.end) - lit_on_sheet(rig, move.start))
        length[block.step] = length.get(block.step, 0.0) + on_sheet
    for fold in process.folds:
        assert dose[fold.step] == pytest.approx(fold.energy_j, rel=0.01)
        assert length[fold.step] == pytest.approx(fold.passes * fold.length_mm, rel=1e-3)
    assert job.energy_j == pytest.approx(process.energy_j, rel=0.01)


def test_cuts_follow_their_paths_in_the_pattern_completely(case):
    plan, process, rig, job = case
    pattern = pattern_of(plan)
    program = read(write_gcode(job))
    spans = {
        n: b
        for b in gcode_program(job).blocks
        if b.kind == "cut"
        for n in range(b.first_line, b.last_line + 1)
    }
    length: dict[int, float] = {}
    for move in program.moves:
        if move.s > 0.0 and move.line in spans:
            step = spans[move.line].step
            a, b = lit_on_sheet(rig, move.start), lit_on_sheet(rig, move.end)
            length[step] = length.get(step, 0.0) + float(np.linalg.norm(b - a))
            near = min(
                max(distance_to_segment(p, np.array(start), np.array(end)) for p in (a, b))
                for path in pattern.paths(plan.steps[step].paths)
                for start, end in itertools.pairwise(path)
            )
            assert near < 0.005
    for cut in process.cuts:
        assert length[cut.step] == pytest.approx(cut.length_mm * cut.passes, rel=1e-3)


def distance_to_segment(p: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return float(np.linalg.norm(p - a - t * (b - a)))


def test_the_beam_obeys(case):
    """No rotary motion with light, light only between M4 and M5 of beam blocks, bounds, caps."""
    _, _, rig, job = case
    text = write_gcode(job)
    program = read(text)
    assert not program.lit_at_end
    cap = rig.laser.s_for_power(rig.laser.cap_fraction * rig.laser.max_w)
    for move in program.moves:
        if move.s > 0.0:
            assert move.start["A"] == move.end["A"]
        if move.start["A"] != move.end["A"]:
            assert all(move.start[k] == move.end[k] for k in "XYZ")
        assert move.s <= cap + 1e-9
        for k, (low, high) in zip("XYZ", (rig.axes.x_mm, rig.axes.y_mm, rig.axes.z_mm), strict=True):
            assert low <= move.end[k] <= high
        if move.feed:
            d = np.array([move.end[k] - move.start[k] for k in "XYZ"])
            speed = np.abs(d) / np.linalg.norm(d) * move.feed / 60.0
            assert np.all(speed <= np.array(rig.axes.max_mm_s) * 1.003)
    for block in gcode_program(job).blocks:
        if block.kind in ("pass", "cut"):
            assert block.lines[0] == "M4S0"
            assert block.lines[-2] == "M5"
            assert len(block.data) <= rig.controller.rx_bytes - 8
        elif block.kind != "head":
            assert not any("S" in line.replace("M5 S0", "") or "M4" in line for line in block.lines)
        if block.index >= 0:
            assert block.lines[-1].startswith("G4P")
        assert block.beam_s <= rig.laser.max_beam_s


def test_every_block_ends_where_it_says(case):
    _, _, _, job = case
    text = write_gcode(job)
    by_line = {m.line: m.end for m in read(text).moves}
    place: dict[str, float] = {}
    lines = text.split("\n")
    for block in gcode_program(job).blocks:
        assert tuple(lines[block.first_line - 1 : block.last_line]) == block.lines
        for n in range(block.first_line, block.last_line + 1):
            place = by_line.get(n, place)
        for word, value in block.expect:
            assert place[word] == pytest.approx(value, abs=6e-4)


def test_the_head_is_at_speed_while_the_beam_is_on(case):
    _, _, rig, job = case
    for block in job.blocks:
        if block.kind == "pass":
            accel = min(rig.axes.accel_mm_s2[:2])
            run_in = math.dist(block.start, block.path[0])
            full = run_in >= block.speed_mm_s**2 / (2 * accel) * 0.7
            assert full or min(block.start[0], block.start[1]) < 0.01
            assert block.beam_s == pytest.approx(block.lit_length_mm / block.speed_mm_s, rel=0.01)
            assert block.seconds > block.beam_s + block.wait_s


def test_steps_come_in_order_with_rotations_between(case):
    plan, _, _, job = case
    seen = [b.step for b in job.blocks if b.step >= 0]
    assert seen == sorted(seen)
    for number, step in enumerate(plan.steps):
        mine = [b for b in job.blocks if b.step == number]
        if isinstance(step, Rotate):
            assert [b.kind for b in mine] == ["rotate"]
            assert mine[0].rotary_rad == pytest.approx(step.to_rad, abs=2e-5)
        if isinstance(step, Fold):
            assert {b.crease for b in mine if b.kind == "pass"} == {step.crease}
        if isinstance(step, (Cut, Release)):
            assert {b.kind for b in mine} <= {"goto", "cut"}
    assert job.blocks[-1].kind == "ask"
    for a, b in zip(job.blocks, job.blocks[1:], strict=False):
        assert a.end == b.start


def test_it_is_deterministic_and_small(case):
    plan, process, rig, job = case
    again = make_job(plan, process, rig, STEEL, {"plan": "ab" * 32})
    assert again.sha256 == job.sha256
    text = write_gcode(job)
    assert text == write_gcode(again)
    assert len(text) / max(job.strokes, 1) < 600


def test_foreign_senders_pause_at_rotations():
    *_, job = made("star")
    plain, pauses = write_gcode(job), write_gcode(job, pauses=True)
    assert "M0" not in plain
    rotations = sum(b.kind in ("rotate", "ask") for b in job.blocks)
    assert pauses.count("\nM0\n") == rotations


def broken(**changes):
    plan, process, rig, _ = made("star")
    fold = replace(process.folds[0], **changes)
    return plan, replace(process, folds=(fold, *process.folds[1:])), rig


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"power_w": 19.5}, "cap"),
        ({"power_w": math.nan}, "finite"),
        ({"power_w": -1.0}, "cap"),
        ({"speed_mm_s": math.inf}, "finite"),
        ({"speed_mm_s": 400.0}, "mm/s"),
        ({"speed_mm_s": 1.0}, "in flight"),
        ({"crease": 0}, "another plan"),
        ({"step": 999}, "no fold"),
    ],
)
def test_a_process_that_the_rig_cannot_run_is_refused(changes, words):
    plan, process, rig = broken(**changes)
    with pytest.raises(JobError, match=words) as caught:
        make_job(plan, process, rig, STEEL)
    assert "step" in str(caught.value)


def test_a_rotary_out_of_range_is_refused():
    plan, process, rig, _ = made("star")
    steps = tuple(Rotate(5.0) if isinstance(s, Rotate) else s for s in plan.steps)
    with pytest.raises(JobError, match="rotary"):
        make_job(replace(plan, steps=steps), process, rig, STEEL)


def test_a_part_outside_the_travel_is_refused():
    plan, process, rig, _ = made("star")
    moved = replace(plan, net=replace(plan.net, vertices=plan.net.vertices + np.array([190.0, 0.0])))
    with pytest.raises(JobError, match="outside the travel"):
        make_job(moved, process, rig, STEEL)


def test_a_rig_without_focus_axis_works_flat_and_refuses_a_tilt():
    plan, process, _, _ = made("star")
    swap = load_rig("grbl-diode-swap")
    flat = replace(
        process,
        folds=tuple(replace(f, power_w=3.0, speed_mm_s=20.0) for f in process.folds),
        cuts=tuple(replace(c, power_w=3.0) for c in process.cuts),
    )
    job = make_job(plan, flat, swap, STEEL)
    program = read(write_gcode(job), axes="XYZ")
    turns = [m for m in program.moves if m.start["Z"] != m.end["Z"]]
    assert turns
    assert all(m.s == 0.0 and m.start["X"] == m.end["X"] for m in turns)
    leaning = tuple(Rotate(s.to_rad - 0.6) if isinstance(s, Rotate) else s for s in plan.steps)
    with pytest.raises(JobError, match="focus"):
        make_job(replace(plan, steps=leaning), flat, swap, STEEL)
