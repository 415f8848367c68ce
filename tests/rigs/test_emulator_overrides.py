"""Feed, rapid and power overrides of the emulated machine, as Grbl 1.1 documents them."""

from __future__ import annotations

import itertools
import math
import re

import pytest

from tests.rigs.emulator_bench import Bench


def ov(bench: Bench) -> str:
    """The overrides as the next reports tell them."""
    for _ in range(12):
        if match := re.search(r"\|Ov:([\d,]+)", bench.status()):
            return match[1]
    raise AssertionError("no overrides reported")


def feed(bench: Bench) -> float:
    return float(re.search(r"\|FS:(\d+),", bench.status())[1])  # type: ignore[index]


@pytest.mark.parametrize(
    ("codes", "told"),
    [
        (b"\x91", "110,100,100"), (b"\x92", "90,100,100"), (b"\x93", "101,100,100"), (b"\x94", "99,100,100"),
        (b"\x91\x91\x93\x90", "100,100,100"), (b"\x91" * 30, "200,100,100"), (b"\x92" * 30, "10,100,100"),
        (b"\x96", "100,50,100"), (b"\x97", "100,25,100"), (b"\x96\x95", "100,100,100"),
        (b"\x9a\x9c", "100,100,111"), (b"\x9b\x9d", "100,100,89"), (b"\x9b\x99", "100,100,100"),
        (b"\x9a" * 30, "100,100,200"), (b"\x91\x97\x9b", "110,25,90"),
    ],
)  # fmt: skip
def test_what_each_byte_does_and_its_limits(codes, told):
    bench = Bench()
    bench.say(codes)
    assert ov(bench) == told


def test_a_change_is_in_the_next_report_and_no_change_is_not():
    bench = Bench()
    bench.status()
    bench.status()
    assert "Ov:" not in bench.status()
    bench.say(b"\x91")
    assert "|Ov:110,100,100" in bench.status()
    assert "Ov:" not in bench.status()
    bench.say(b"\x95")  # it was 100 % already
    assert "Ov:" not in bench.status()


def test_a_feed_override_changes_the_move_under_way():
    bench = Bench()
    bench.say("G1 X100 F1200\n", 1.0)
    assert feed(bench) == 1200
    for codes, wanted in ((b"\x91" * 5, 1800), (b"\x90", 1200), (b"\x92" * 5, 600), (b"\x90", 1200)):
        bench.say(codes, 0.2)
        assert feed(bench) == wanted


def test_speed_is_continuous_and_place_is_kept():
    """Braking and speeding up take the acceleration of the axes; pieces join without a jump."""
    bench = Bench()
    bench.say("G1 X60 F6000\nG1 X90 Y20\nG1 X90 Y60\nG0 X10 Y0\n", 0.25)
    for codes in (b"\x92" * 6, b"\x91" * 12, b"\x90", b"\x97", b"\x95", b"\x92" * 9, b"\x90"):
        bench.say(codes, 0.17)
    bench.later(60.0)
    moves = [r for r in bench.tape.records if r["kind"] == "move"]
    for a, b in itertools.pairwise(moves):
        assert b["from"] == pytest.approx(a["to"], abs=2e-5)
        assert b["t0"] == pytest.approx(a["t1"], abs=1e-5)
        assert b["v"][0] == pytest.approx(a["v"][2], abs=1e-3)
    for r in moves:
        v_in, top, out = r["v"]
        length = math.dist(r["from"], r["to"])
        assert out**2 >= v_in**2 - 2.0 * 2900.0 * length - 1e-3  # 2000 mm/s² an axis, 2828 across
        assert top >= max(v_in, out) - 1e-6
    assert bench.x() == pytest.approx(-390.0)  # of the machine
    assert moves[-1]["v"][2] == 0.0


def test_feed_overrides_leave_rapids_alone_and_the_other_way_round():
    bench = Bench()
    bench.say("G0 X200\n", 0.4)
    bench.say(b"\x92" * 5, 0.05)
    assert feed(bench) == 12000
    bench.say(b"\x97", 0.3)
    assert feed(bench) == 3000
    bench.later(10.0)
    bench.say("G1 X0 F1200\n", 1.0)
    assert feed(bench) == 600  # 50 % of the feed, whatever the rapids are


def test_no_axis_is_driven_faster_than_it_can():
    bench = Bench()
    bench.say(b"\x91" * 10)
    bench.say("G1 X200 F9000\n", 0.6)
    assert feed(bench) == 12000  # $110


def test_later_moves_begin_with_the_override():
    bench = Bench()
    bench.say(b"\x92" * 5)
    bench.say("G1 X100 F1200\n", 1.0)
    assert feed(bench) == 600


@pytest.mark.parametrize("ends", ["reset", "M2", "M30"])
def test_a_reset_and_the_end_of_a_program_set_them_back(ends):
    bench = Bench()
    bench.say(b"\x91\x97\x9a")
    bench.say(b"\x18" if ends == "reset" else f"{ends}\n")
    assert ov(bench) == "100,100,100"


def test_the_light_of_m4_follows_the_speed_and_its_dose_stays():
    """S by actual over programmed speed: the same energy along the way; above full scale it is clipped."""
    bench = Bench()
    bench.say("M4 S400\nG1 X100 F1200\n", 1.0)
    assert bench.light() == pytest.approx(400.0)
    bench.say(b"\x92" * 5, 0.2)
    assert bench.light() == pytest.approx(200.0)
    bench.say(b"\x90" + b"\x91" * 10, 0.2)
    assert bench.light() == pytest.approx(800.0)
    bench.say(b"\x9a" * 5, 0.2)
    assert bench.light() == 1000.0


def test_overrides_while_it_is_held_count_when_it_goes_on():
    bench = Bench()
    bench.say("G1 X100 F1200\n", 1.0)
    bench.say(b"!", 0.5)
    bench.say(b"\x92" * 5, 0.5)
    place = bench.x()
    bench.say(b"~", 0.5)
    assert bench.x() < place - 1.0 and feed(bench) == 600
