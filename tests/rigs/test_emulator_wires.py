"""The paced link of the emulated machine: bytes take their time, in both directions, and overrun is real."""

from __future__ import annotations

import pytest

from rigs.emulator.wires import Wires
from tests.rigs.emulator_bench import Bench

BYTE_S = 10.0 / 115200.0


def talk(wires: Wires, data: bytes) -> tuple[float, bytes]:
    """Send, wait for the line that comes back; how long both took."""
    start = wires.machine.now
    wires.take(data)
    while (event := wires.next_event()) is not None:
        wires.advance(event)
        if got := wires.arrived():
            return wires.machine.now - start, got
    raise AssertionError("nothing came back")


@pytest.mark.parametrize("baud", [9600, 115200])
def test_a_line_and_its_answer_take_their_bits(baud):
    seconds, got = talk(Wires(Bench().machine, baud), b"G1 F600\n")
    assert got == b"ok\r\n"
    assert seconds == pytest.approx((8 + 4) * 10.0 / baud, rel=1e-9)


def test_without_pace_it_is_at_once():
    wires = Wires(Bench().machine)
    wires.take(b"G1 F600\n")
    assert wires.arrived() == b"ok\r\n"


def test_realtime_bytes_wait_behind_others_on_the_wire():
    bench = Bench()
    wires = Wires(bench.machine, 115200)
    bench.say("G1 X100 F6000\n")
    wires.take(b"(" + b"x" * 98 + b")!")
    wires.advance(bench.machine.now + 100.5 * BYTE_S)
    assert bench.machine.state == "Idle"
    wires.advance(bench.machine.now + 0.6 * BYTE_S)
    assert bench.machine.state == "Hold"


def test_what_is_not_read_in_time_is_lost():
    """The planner is full and the reader waits: bytes beyond the receive buffer are dropped as they come."""
    bench = Bench()
    wires = Wires(bench.machine, 115200)
    lines = "".join(f"G1 X{n % 2} F60\n" for n in range(120)).encode()
    wires.take(lines)
    wires.advance(bench.machine.now + len(lines) * BYTE_S)
    config = bench.machine.config
    assert len(bench.machine.rx) == config.rx_bytes
    assert bench.machine.lines_seen < 120
    assert wires.next_event() is not None


def test_what_is_on_its_way_back_is_lost_when_nobody_listens():
    wires = Wires(Bench().machine, 115200)
    wires.take(b"?")
    wires.advance(wires.machine.now + 5 * BYTE_S)
    wires.hang_up()
    wires.advance(wires.machine.now + 1.0)
    assert wires.arrived() == b""


def test_there_is_no_endless_room():
    wires = Wires(Bench().machine, 9600)
    before = wires.room
    wires.take(b"x" * 1000)
    assert wires.room == before - 1000
