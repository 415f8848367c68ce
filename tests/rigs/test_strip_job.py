"""The job of a strip: slits first, then passes in rounds with rests."""

from __future__ import annotations

import math
from collections import Counter

import pytest

from rigs.errors import JobError
from rigs.gcode import gcode_program
from rigs.material import load_material
from rigs.rig import load_rig
from rigs.strip import Cutting, lay_out
from rigs.strip_job import strip_job

RIG, STEEL = load_rig("grbl-4axis"), load_material("304")
CUT = Cutting(19.0, 30.0, 1)
SETTINGS = [(p, v, n) for v in (50.0, 100.0) for p in (6.0, 9.0) for n in (1, 3)]


def made(kind="fold", rest=5.0, cutting=CUT, settings=SETTINGS):
    strip = lay_out(kind, settings, RIG, width_mm=8.0, length_mm=8.0)
    return strip, strip_job(strip, RIG, STEEL, cutting, rest, {"more": "ab" * 32})


def test_every_finger_is_cut_once_and_then_lit_as_its_row_says():
    strip, job = made()
    kinds = [block.kind for block in job.blocks]
    assert max(n for n, k in enumerate(kinds) if k == "cut") < min(
        n for n, k in enumerate(kinds) if k == "pass"
    )
    passes = Counter(block.crease for block in job.blocks if block.kind == "pass")
    assert passes == {piece.number: piece.passes for piece in strip.pieces}
    x0, y0, _ = RIG.rotary.axis_point_mm
    for block in job.blocks:
        if block.kind == "pass":
            piece = strip.pieces[block.crease - 1]
            assert block.power_w == pytest.approx(piece.power_w, rel=0.01)
            assert block.speed_mm_s == pytest.approx(piece.speed_mm_s, rel=1e-3)
            ends = sorted((x - x0, y - y0) for x, y, _ in block.path)
            assert ends == [pytest.approx(end, abs=1e-3) for end in strip.crease(piece)]
    slits = Counter(block.step for block in job.blocks if block.kind == "cut")
    assert set(slits) == {0, *(piece.number for piece in strip.pieces)}
    lengths = {
        step: sum(b.lit_length_mm for b in job.blocks if b.kind == "cut" and b.step == step) for step in slits
    }
    assert all(lengths[piece.number] == pytest.approx(8.0 + 2 * 9.0, abs=0.01) for piece in strip.pieces)


@pytest.mark.parametrize("rest", [0.0, 5.0, 40.0])
def test_fingers_rest_between_their_passes(rest):
    _, job = made(rest=rest)
    now, end = 0.0, {}
    for block in job.blocks:
        now += block.seconds
        if block.kind == "pass":
            begin = now - block.seconds
            assert begin >= end.get(block.crease, -math.inf) + rest - 1e-3
            end[block.crease] = now
    waits = sum(block.seconds for block in job.blocks if block.kind == "wait")
    assert (waits > 0.0) == (rest > 0.0)


def test_windows_are_cut_with_the_setting_that_they_try():
    strip, job = made("kerf", settings=[(10.0, 20.0, 1), (19.0, 40.0, 2)])
    assert not any(block.kind == "pass" for block in job.blocks)
    for piece in strip.pieces:
        mine = [b for b in job.blocks if b.kind == "cut" and b.step == piece.number]
        assert sum(b.lit_length_mm for b in mine) == pytest.approx(32.0 * piece.passes, abs=0.01)
        assert all(b.power_w == pytest.approx(piece.power_w, rel=0.01) for b in mine)
        assert all(b.speed_mm_s == pytest.approx(piece.speed_mm_s, rel=1e-3) for b in mine)


def test_it_is_a_job_like_any_other():
    _, job = made()
    assert job.hashes == {"more": "ab" * 32, "rig": RIG.sha256, "material": STEEL.sha256}
    assert len(gcode_program(job).blocks) == len(job.blocks) + 2
    assert job.sha256 == made()[1].sha256 != made(rest=6.0)[1].sha256


def test_a_power_over_the_cap_names_the_piece():
    with pytest.raises(JobError, match="piece 1"):
        made(settings=[(25.0, 100.0, 1)])
