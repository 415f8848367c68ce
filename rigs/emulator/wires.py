"""The link of the emulated machine: everything at once, or byte after byte as a serial line carries it."""

from __future__ import annotations

import math
from collections import deque

from rigs.emulator.machine import GrblMachine

__all__ = ["BITS_A_BYTE", "Wires"]

BITS_A_BYTE = 10
"""Start bit, eight of data, stop bit (8N1)."""

_ROOM = 4096
_ACTING = frozenset(b"\n?!~\x18")


class _Wire:
    """One direction: bytes that are on their way, each with the time at which it arrives."""

    def __init__(self, byte_s: float) -> None:
        self.byte_s = byte_s
        self.free = 0.0
        self.bytes: deque[tuple[float, int]] = deque()
        self.acts: deque[float] = deque()

    def put(self, data: bytes | bytearray, now: float) -> None:
        """Send behind what is on its way."""
        self.free = max(self.free, now)
        for byte in data:
            self.free += self.byte_s
            self.bytes.append((self.free, byte))
            if byte >= 0x80 or byte in _ACTING:
                self.acts.append(self.free)

    def take(self, until: float) -> bytes:
        """What has arrived up to a time."""
        data = bytearray()
        while self.bytes and self.bytes[0][0] <= until:
            data.append(self.bytes.popleft()[1])
        while self.acts and self.acts[0] <= until:
            self.acts.popleft()
        return bytes(data)

    def next_act(self) -> float:
        """When a byte arrives on which the receiver acts: a line end or a realtime byte."""
        return self.acts[0] if self.acts else math.inf

    def clear(self) -> None:
        self.bytes.clear()
        self.acts.clear()


class Wires:
    """Both directions of the link, and the machine at their end. All times are simulated seconds.

    Args:
        machine: the emulated machine.
        baud: bits a second of a serial line; 0 passes bytes at once.
    """

    def __init__(self, machine: GrblMachine, baud: int = 0) -> None:
        self.machine = machine
        byte_s = BITS_A_BYTE / baud if baud > 0 else 0.0
        self._paced = baud > 0
        self._out, self._in = _Wire(byte_s), _Wire(byte_s)

    @property
    def room(self) -> int:
        """Bytes that can be handed over now; the others wait at the sender."""
        return max(_ROOM - len(self._out.bytes), 0)

    def take(self, data: bytes) -> None:
        """Bytes from the host."""
        if self._paced:
            self._out.put(data, self.machine.now)
        else:
            self.machine.receive(data)

    def next_event(self) -> float | None:
        """When the next thing happens: in the machine, at it, or a line arrives at the host."""
        event = self.machine.next_event()
        soonest = min(math.inf if event is None else event, self._out.next_act(), self._in.next_act())
        return None if soonest == math.inf else max(soonest, self.machine.now)

    def advance(self, to: float) -> None:
        """Move the clock; bytes arrive and things happen in the order of their times."""
        if not self._paced:
            self.machine.advance(to)
            return
        while True:
            event = self.machine.next_event()
            t = min(to, math.inf if event is None else max(event, self.machine.now), self._out.next_act())
            self.machine.receive(self._out.take(math.nextafter(t, 0.0)))
            self.machine.advance(t)
            self.machine.receive(self._out.take(t))
            self._in.put(self.machine.out, self.machine.now)
            self.machine.out.clear()
            if t >= to:
                return

    def arrived(self) -> bytes:
        """What has come to the host by now."""
        if self._paced:
            self._in.put(self.machine.out, self.machine.now)
            self.machine.out.clear()
            return self._in.take(self.machine.now)
        data = bytes(self.machine.out)
        self.machine.out.clear()
        return data

    def hang_up(self) -> None:
        """Nobody listens any more: what is on its way to the host is lost, what left it arrives."""
        self._in.clear()
        self.machine.out.clear()
