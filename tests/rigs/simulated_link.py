"""A replay in simulated time: host, cable at 115 200 baud and emulated machine in one process.

The clock moves only when the host waits, so times are exact whatever the load of the computer. A cable can
drop, double, flip or cut at any byte of either direction, and the host can die at any instant.
"""

from __future__ import annotations

import io
import json
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from rigs.emulator.config import config_for
from rigs.emulator.faults import read_faults
from rigs.emulator.machine import GrblMachine
from rigs.emulator.trace import Trace
from rigs.errors import MachineError
from rigs.rig import Rig

BYTE_S = 10.0 / 115200.0
_NEVER = float("inf")
_ACTING = frozenset(b"\n?!~\x18")


class HostKilled(BaseException):
    """The host is gone: nothing of it runs any more."""


@dataclass
class Clock:
    """Stands in for the module ``time``."""

    now: float = 1000.0
    jump: float = 0.0

    def monotonic(self) -> float:
        return self.now

    def time(self) -> float:
        return 1.7e9 + self.now + self.jump

    def sleep(self, seconds: float) -> None:
        self.now += seconds


@dataclass(frozen=True)
class Harm:
    """What happens to the byte number ``at`` of a direction."""

    way: Literal["out", "in"]
    at: int
    kind: Literal["drop", "double", "flip", "cut", "add"]
    value: int = 1

    def apply(self, byte: int) -> bytes:
        if self.kind == "drop":
            return b""
        if self.kind == "double":
            return bytes([byte, byte])
        if self.kind == "flip":
            return bytes([byte ^ self.value])
        return bytes([byte, self.value])


@dataclass
class SimulatedLink:
    """A ``Link`` to a machine in the same process.

    Attributes:
        sent: (time, byte) as they left the host, whether or not they arrived.
        cut: True once the cable is off; the machine goes on alone.
        events: (time, what happens then), such as another sender or a power cut, in order of time.
        frozen: from when to when the controller does nothing at all.
        dies_at: time at which the host is killed.
    """

    machine: GrblMachine
    clock: Clock
    harms: Sequence[Harm] = ()
    latency_s: float = 0.0
    dies_at: float = float("inf")
    byte_s: float = BYTE_S
    url: str = "socket://127.0.0.1:1"
    sent: list[tuple[float, int]] = field(default_factory=list)
    cut: bool = False
    cut_at: float = float("inf")
    events: list[tuple[float, Callable[[SimulatedLink], None]]] = field(default_factory=list)
    frozen: tuple[float, float] = (_NEVER, _NEVER)

    def __post_init__(self) -> None:
        self._to_machine: deque[tuple[float, int]] = deque()
        self._to_host: deque[tuple[float, int]] = deque()
        self._acts: deque[float] = deque()  # when bytes arrive on which the machine acts
        self._lines: deque[float] = deque()  # when lines for the host are complete
        self._buffer = bytearray()
        self._free = {"out": 0.0, "in": 0.0}
        self._count = {"out": 0, "in": 0}
        self._by_place = {(h.way, h.at): h for h in self.harms}

    # -- what the driver calls ----------------------------------------------------------------------------

    def write(self, data: bytes) -> None:
        self._alive()
        if self.cut:
            raise MachineError(f"{self.url}: the port vanished while writing")
        for byte in data:
            self.sent.append((self.clock.now, byte))
            self._pass("out", byte, self._to_machine)
        self.clock.now += 1e-5

    urgent = write

    def read_line(self, timeout_s: float) -> bytes | None:
        deadline = self.clock.now + timeout_s
        while True:
            self._alive()
            self._deliver()
            if (end := self._buffer.find(b"\n")) >= 0:
                line = bytes(self._buffer[:end])
                del self._buffer[: end + 1]
                return line
            if len(self._buffer) > 4096:
                raise MachineError("4096 bytes without a line end")
            if self.cut:
                raise MachineError(f"{self.url}: the port vanished")
            event = self._next()
            if event > deadline:
                self.run_to(deadline)
                return None
            self.run_to(event)

    def drain(self) -> None:
        self._buffer.clear()

    def close(self) -> None:
        self.cut = True

    # -- the world ----------------------------------------------------------------------------------------

    def run_to(self, t: float) -> None:
        """Move the clock; bytes arrive and the machine moves in order."""
        stop = min(t, self.dies_at) if self.clock.now <= self.dies_at else t
        while (event := self._next_of_machine()) <= stop:
            self.clock.now = max(self.clock.now, event)
            while self.events and self.events[0][0] <= self.clock.now:
                self.events.pop(0)[1](self)
            self.machine.advance(self.clock.now)
            arrived = bytearray()
            while self._to_machine and self._to_machine[0][0] <= self.clock.now + 1e-12:
                arrived.append(self._to_machine.popleft()[1])
            while self._acts and self._acts[0] <= self.clock.now + 1e-12:
                self._acts.popleft()
            if arrived:
                self.machine.receive(bytes(arrived))
            self._collect()
        self.clock.now = max(self.clock.now, stop)
        if not self.frozen[0] <= self.clock.now < self.frozen[1]:
            self.machine.advance(self.clock.now)
        self._collect()
        self._alive()

    def inject(self, data: bytes) -> None:
        """Bytes that the host gets and the controller never sent."""
        for byte in data:
            self._pass("in", byte, self._to_host)

    def leave_alone(self, seconds: float) -> None:
        """The host is gone; the machine does what it still has."""
        self.dies_at = float("inf")
        self.cut = True
        self.run_to(self.clock.now + seconds)

    def _alive(self) -> None:
        if self.clock.now >= self.dies_at:
            raise HostKilled

    def _next_of_machine(self) -> float:
        event = self.machine.next_event()
        times = (event if event is not None else _NEVER, self._acts[0] if self._acts else _NEVER)
        soonest = min(times)
        if self.frozen[0] <= soonest < self.frozen[1]:
            soonest = self.frozen[1]
        return min(soonest, self.events[0][0] if self.events else _NEVER)

    def _next(self) -> float:
        return min(self._next_of_machine(), self._lines[0] if self._lines else _NEVER)

    def _collect(self) -> None:
        for byte in self.machine.out:
            self._pass("in", byte, self._to_host)
        self.machine.out.clear()
        if self.machine.dropped:
            self.cut, self.machine.dropped = True, False

    def _deliver(self) -> None:
        while self._to_host and self._to_host[0][0] <= self.clock.now + 1e-12:
            self._buffer.append(self._to_host.popleft()[1])
        while self._lines and self._lines[0] <= self.clock.now + 1e-12:
            self._lines.popleft()

    def _pass(self, way: Literal["out", "in"], byte: int, queue: deque[tuple[float, int]]) -> None:
        if self.cut:
            return
        harm = self._by_place.get((way, self._count[way]))
        self._count[way] += 1
        if harm is not None and harm.kind == "cut":
            self.cut, self.cut_at = True, self.clock.now
            return
        for one in harm.apply(byte) if harm is not None else (byte,):
            self._free[way] = max(self._free[way], self.clock.now) + self.byte_s
            arrives = self._free[way] + self.latency_s
            queue.append((arrives, one))
            if way == "in" and one == 10:
                self._lines.append(arrives)
            elif way == "out" and (one >= 0x80 or one in _ACTING):
                self._acts.append(arrives)


def machine_for(
    rig: Rig, clock: Clock, faults: Sequence[str] = (), *, homed: bool = True, **settings: float
) -> GrblMachine:
    """An emulated machine that keeps its trace in memory; homed, it stands over the rotary axis."""
    config = config_for(rig).with_settings({int(key[1:]): value for key, value in settings.items()})
    machine = GrblMachine(config, Trace(io.StringIO()), read_faults(list(faults)), now=clock.now)
    machine.out.clear()
    if homed:
        machine.state = "Idle"
        place = (*rig.rotary.axis_point_mm, 0.0)
        machine.motion.position = tuple(a + b for a, b in zip(place, config.g54, strict=False))
    return machine


def records_of(machine: GrblMachine) -> list[dict[str, Any]]:
    """The trace of a machine."""
    machine.trace.rest(machine.now, 0.0)
    assert isinstance(machine.trace.file, io.StringIO)
    return [json.loads(line) for line in machine.trace.file.getvalue().splitlines()]
