"""The emulator answers as Grbl 1.1 was measured to do: one test for each row of that table that it claims."""

from __future__ import annotations

import math
import re

import pytest

from rigs.emulator.config import config_for
from rigs.emulator.faults import read_faults, timed_faults
from rigs.emulator.machine import GrblMachine
from rigs.emulator.trace import Trace
from rigs.errors import ProfileError
from rigs.rig import load_rig
from tests.rigs.emulator_bench import Bench

BEAM = "M{} S500\nG1 X-390 Y-299 F600\n"


@pytest.fixture
def bench() -> Bench:
    bench = Bench()
    bench.say("G21 G90\nG53 G0 X-399 Y-299 Z-1\nG4P0\n", 60.0)
    bench.say("G10 L2 P1 X0 Y0 Z0 A0\n", 1.0)
    return bench


def test_start_up_is_locked_until_homed_or_unlocked() -> None:
    machine = GrblMachine(config_for(load_rig("grbl-4axis")), Trace())
    assert machine.out.decode().split("\r\n")[:3] == [
        "",
        "Grbl 1.1q ['$' for help]",
        "[MSG:'$H'|'$X' to unlock]",
    ]
    machine.out.clear()
    machine.receive(b"G0X1\n$H\n")
    machine.advance(60.0)
    assert machine.out.decode() == "error:9\r\nok\r\n"
    assert machine.motion.position == (-1.0, -1.0, -1.0, 0.0)


def test_questions(bench: Bench) -> None:
    assert bench.say("$I\n")[-4:] == ["[VER:1.1q.20230611:EMULATED]", "[OPT:VM,35,255]", "[AXS:4:XYZA]", "ok"]
    assert "$32=1" in bench.say("$$\n")
    assert "$103=88.889" in bench.say("$$\n")
    assert bench.say("$G\n")[0].startswith("[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]")
    assert bench.say("$#\n")[0] == "[G54:0.000,0.000,0.000,0.000]"
    assert bench.say("$N\n") == ["error:3"]
    assert re.fullmatch(r"<Idle\|MPos:-399.000,-299.000,-1.000,0.000\|FS:0,0\|.*>", bench.status())


@pytest.mark.parametrize(
    ("line", "answer"),
    [("B5", 20), ("G1 XY5", 2), ("S-5", 4), ("F-5", 4), ("G1X1", 22), ("G2X1", 20), ("G0G1X1F5", 21),
     ("X1X2", 25), ("5X", 1), ("G4", 28), ("$32=-1", 4), ("$999=1", 3), ("G" + "1" * 99, 11), ("M3M4", 21),
     ("G10L5P1X0", 20), ("G92", 26), ("G80X1", 31), ("$Q", 3)],
)  # fmt: skip
def test_wrong_lines_are_answered_with_the_error_of_grbl_and_do_nothing(
    bench: Bench, line: str, answer: int
) -> None:
    before = bench.status().split("|")[:3]
    assert bench.say(line + "\n", 1.0) == [f"error:{answer}"]
    assert bench.status().split("|")[:3] == before
    assert bench.light() == 0.0


def test_three_axis_firmware_does_not_know_a() -> None:
    bench = Bench("grbl-diode-swap")
    assert bench.say("A5\n") == ["error:20"]
    assert len(bench.say("$I\n")) == 3


def test_ok_of_a_move_means_planned_and_ok_of_m5_and_g4_means_executed(bench: Bench) -> None:
    assert bench.say("M4 S500\nG1 X-389 F600\nM5\n") == ["ok", "ok"]  # 10 mm at 10 mm/s
    assert bench.later(0.9) == []
    assert bench.later(0.2) == ["ok"]
    assert bench.say("G1 X-399\nG4 P0\n") == ["ok"]
    assert bench.later(0.9) == []
    assert bench.later(0.2) == ["ok"]
    bench.say("M4 S500\nG1 X-389\n")
    assert bench.say("S0\n") == []
    assert bench.later(1.1) == ["ok"]


def test_dwell_takes_its_time(bench: Bench) -> None:
    assert bench.say("G4 P2.5\n", 2.4) == []
    assert bench.later(0.11) == ["ok"]


def test_m4_is_dark_at_rest_and_scales_with_speed_m3_burns_on(bench: Bench) -> None:
    bench.say(BEAM.format(4), 0.0005)
    assert 0.0 < bench.light() < 500.0
    bench.later(0.5)
    assert bench.light() == pytest.approx(500.0)
    bench.later(5.0)
    assert bench.light() == 0.0
    bench.say("M5\nG0 X-399\nG4P0\n", 5.0)
    bench.say(BEAM.format(3), 5.0)
    assert bench.light() == 500.0
    assert bench.status().split("|")[2] == "FS:0,500"


@pytest.mark.parametrize("mode", [3, 4])
def test_without_laser_mode_light_stays_on_in_travel_and_at_rest(mode: int) -> None:
    bench = Bench(s32=0, s20=0)
    bench.say(f"M{mode} S500\nG0 X50\n", 0.1)
    assert bench.light() == 500.0
    bench.later(10.0)
    assert bench.light() == 500.0


def test_s_above_full_scale_is_clipped_silently(bench: Bench) -> None:
    assert bench.say("M3 S5000\n") == ["ok"]
    assert bench.light() == 1000.0


@pytest.mark.parametrize("mode", [3, 4])
def test_hold_darkens_and_cycle_start_fires_again(bench: Bench, mode: int) -> None:
    bench.say(BEAM.format(mode), 0.5)
    bench.say(b"!", 0.5)
    assert bench.status().startswith("<Hold:0|")
    assert bench.light() == 0.0
    bench.say(b"~", 0.05)
    assert bench.light() == pytest.approx(500.0)
    bench.later(5.0)
    assert bench.machine.motion.position[0] == pytest.approx(-390.0)


def test_door_darkens_and_cycle_start_fires_at_once(bench: Bench) -> None:
    bench.say(BEAM.format(4), 0.5)
    bench.say(b"\x84", 0.5)
    assert bench.status().startswith("<Door:0|")
    assert bench.light() == 0.0
    bench.say(b"~", 0.05)
    assert bench.light() > 0.0


def test_reset_in_motion_darkens_alarms_and_locks(bench: Bench) -> None:
    bench.say(BEAM.format(3), 0.5)
    answers = bench.say(b"\x18")
    assert answers[0] == "ALARM:3"
    assert "Grbl 1.1q ['$' for help]" in answers
    assert bench.light() == 0.0
    assert bench.say("G1 X1 F100\n") == ["error:9"]
    assert bench.say("$X\n") == ["[MSG:Caution: Unlocked]", "ok"]


def test_reset_at_rest_forgets_modes_without_an_alarm(bench: Bench) -> None:
    bench.say("G1 X-398 F600\nM4 S300\n", 1.0)
    answers = bench.say(b"\x18")
    assert not any(a.startswith("ALARM") for a in answers)
    assert "M5 M9 T0 F0 S0" in bench.say("$G\n")[0]
    assert bench.say("G1 X-397\n") == ["error:22"]


def test_limit_alarm_makes_it_mute_until_reset(bench: Bench) -> None:
    assert bench.say("G0 X900\n") == ["ALARM:2", "[MSG:Reset to continue]"]
    assert bench.say(b"?") == []
    assert bench.say("M5\n", 1.0) == []
    assert "Grbl 1.1q ['$' for help]" in bench.say(b"\x18")
    assert bench.status().startswith("<Alarm|")


def test_power_cycle_loses_position_and_light() -> None:
    bench = Bench(faults=("power@3",), s20=0)
    bench.say("M3 S500\nG1 X9 F600\n", 5.0)
    answers = bench.say("G1 X5\n")
    assert "Grbl 1.1q ['$' for help]" in answers
    assert "ok" not in answers
    assert bench.machine.motion.position == (0.0,) * 4
    assert bench.light() == 0.0


def test_mixed_move_takes_the_feed_over_mm_and_degrees(bench: Bench) -> None:
    bench.say("$113=100000\n")
    bench.say("G1 X-389 A90 F600\n", 1.0)
    share = 10.0 / math.hypot(10.0, 90.0)
    speed = bench.machine.motion.queue[0].speed * share * 60.0
    assert speed == pytest.approx(66.3, abs=0.1)


def test_overrun_loses_bytes_without_a_word(bench: Bench) -> None:
    bench.say("G1 X-300 F60\nM5 S1\n")  # the spindle word waits for standstill: lines pile up
    answers = bench.say("".join(f"G1 X-{300 + n} F600\n" for n in range(120)).encode())
    answers += bench.later(10000.0)
    assert answers.count("ok") + sum(a.startswith("error") for a in answers) < 122
    assert bench.machine.motion.position[0] != -419.0


def test_check_mode_reports_errors_and_moves_nothing(bench: Bench) -> None:
    assert bench.say("$C\n") == ["[MSG:Enabled]", "ok"]
    assert bench.status().startswith("<Check|")
    assert bench.say("G1 X-300 F100\nB4\nG1 XY\n") == ["ok", "error:20", "error:2"]
    before = bench.machine.motion.position
    answers = bench.say("$C\n", 5.0)
    assert answers[:2] == ["[MSG:Disabled]", "ok"]
    assert "Grbl 1.1q ['$' for help]" in answers
    assert bench.machine.motion.position == before
    bench.say("G1 X-300 F100\n")
    assert bench.say("$C\n") == ["error:8"]


def test_disconnect_leaves_it_running(bench: Bench) -> None:
    bench.say("M4 S500\n" + "".join(f"G1 X-{390 - n} F600\n" for n in range(8)))
    bench.later(60.0)  # nobody reads
    assert bench.machine.motion.position[0] == pytest.approx(-383.0)
    assert bench.light() == 0.0


def test_unplugged_at_any_byte_of_a_beam_block_it_ends_dark(bench: Bench) -> None:
    block = b"M4S0\nG1X-389F600S500\nG1X-399\nM5\nG4P0.01\n"
    for cut in range(len(block) + 1):
        fresh = Bench(s20=0)
        fresh.machine.motion.position = (-399.0, -299.0, -1.0, 0.0)
        fresh.machine.wco = [0.0] * 4
        fresh.say(block[:cut])
        fresh.later(60.0)  # longer than the block takes; nobody is there
        assert fresh.light() == 0.0
        assert fresh.machine.trace.rest_beam_s == 0.0
        assert fresh.machine.trace.beam_s <= 2.1
        lit = [r for r in fresh.tape.records if r["kind"] == "move" and r["beam"] != "off"]
        for record in lit:
            ends = (record["from"], record["to"])
            assert all(-399.0 <= place[0] <= -389.0 and place[1] == -299.0 for place in ends)  # type: ignore[index]


def test_inverse_time_and_inches_and_relative(bench: Bench) -> None:
    bench.say("G93\nG1 X-389 F6\nG4P0\n", 9.9)
    assert bench.machine.motion.moving
    bench.later(0.5)
    assert not bench.machine.motion.moving
    assert bench.say("G1 X-388\n") == ["error:22"]
    bench.say("G94 G20 G91\nG0 X1\nG4P0\nG21 G90\n", 5.0)
    assert bench.machine.motion.position[0] == pytest.approx(-389.0 + 25.4)


def test_trace_tells_what_was_lit(bench: Bench) -> None:
    bench.say("M4 S500\nG1 X-389 F600\nM5\nG0 X-399\nG4P0\n", 10.0)
    moves = [r for r in bench.tape.records if r["kind"] == "move"][-2:]
    assert [m["beam"] for m in moves] == ["scaled", "off"]
    assert moves[0]["to"] == [-389.0, -299.0, -1.0, 0.0]
    assert bench.machine.trace.beam_s == pytest.approx(1.005)
    assert bench.machine.trace.rest_beam_s == 0.0


def test_fault_script_is_read_strictly() -> None:
    assert read_faults(["error:9@12"])[12].code == 9
    assert read_faults(["slip:A-5.5@7"])[7].axis == "A"
    script = ["door@2.5s", "error:9@12", "power@1s"]
    assert [(f.kind, f.at_s) for f in timed_faults(script)] == [("power", 1.0), ("door", 2.5)]
    assert set(read_faults(script)) == {12}
    for bad in (
        "error", "melt@3", "error:x@3", "drop@", "drop@0", "error:9@2s", "slip:5@3", "slip@3", "error:9.5@3",
        "alarm:X1@3", "door@2.5",
    ):  # fmt: skip
        with pytest.raises(ProfileError, match=r"fault '.*expected|needs the line"):
            read_faults([bad])
