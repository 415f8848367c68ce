"""A bad cable: a proxy on the loopback address between a host and an emulated machine, with a script of harm.

It cuts, delays, drops, doubles, changes and adds bytes, so that anybody can see what a sender does then.
Bytes are counted over all connections, from 0 and in each direction by itself, and every harm strikes once.
It listens on 127.0.0.1 and leads to 127.0.0.1 only.
"""

from __future__ import annotations

import contextlib
import re
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, cast
from urllib.parse import urlsplit

from rigs.errors import MachineError, ProfileError

__all__ = ["CableHarm", "cable", "read_cable"]

Way = Literal["out", "in"]
_KINDS = ("cut", "drop", "double", "flip", "add", "delay")
_HARM = re.compile(r"([a-z]+)(?::(\d+(?:\.\d+)?))?@(?:(out|in)(\d+)|(\d+(?:\.\d+)?)s)")
_LOOK_S = 0.1


@dataclass(frozen=True)
class CableHarm:
    """One harm.

    Attributes:
        kind: ``cut`` the connection, ``drop`` a byte, ``double`` it, ``flip`` bits of it, ``add`` a byte
            behind it, ``delay`` all bytes from there on.
        value: bits that are flipped, byte that is added, or seconds of delay.
        way: ``out`` from the host or ``in`` to it; None for both, by time.
        at: number of the byte.
        at_s: seconds after the first connection.
    """

    kind: str
    value: float = 0.0
    way: Way | None = None
    at: int = 0
    at_s: float = 0.0


def read_cable(texts: Sequence[str]) -> tuple[CableHarm, ...]:
    """Read harms: ``cut@out300``, ``flip:4@in17``, ``add:10@in7``, ``delay:0.04@out0``, ``cut@2.5s``.

    A text that is the path of a file stands for its lines; ``#`` begins a comment.

    Raises:
        ProfileError: if a text is no harm.
    """
    out: list[CableHarm] = []
    for text in texts:
        lines = [text]
        if "@" not in text:
            try:
                lines = Path(text).read_text("utf-8").splitlines()
            except (OSError, UnicodeDecodeError) as error:
                raise ProfileError(
                    f"cable '{text}': neither a harm such as cut@out300 nor a file: {error}"
                ) from error
        for number, line in enumerate(lines, 1):
            words = line.partition("#")[0].strip()
            if words:
                out.append(_read(words, f"{text}, line {number}" if len(lines) > 1 else "cable"))
    return tuple(out)


def _read(text: str, where: str) -> CableHarm:
    match = _HARM.fullmatch(text)
    kind = match[1] if match else ""
    value = float(match[2]) if match and match[2] else None
    needs = {"flip": (1.0, 255.0), "add": (0.0, 255.0), "delay": (0.0, 60.0)}.get(kind)
    fits = (value is None) if needs is None else (value is not None and needs[0] <= value <= needs[1])
    whole = kind == "delay" or value is None or value.is_integer()
    by_time = match is not None and match[5] is not None
    if (
        match is None
        or kind not in _KINDS
        or not fits
        or not whole
        or (by_time and kind not in ("cut", "delay"))
    ):
        raise ProfileError(
            f"{where}: '{text}': expected KIND[:VALUE]@WAY: cut@out300, drop@in12, double@out5, "
            "flip:4@in17 "
            "(bits 1 to 255), add:10@in7 (a byte), delay:0.04@out0 (up to 60 s), or by time cut@2.5s, "
            "delay:0.04@2s"
        )
    return CableHarm(
        kind, value or 0.0, cast("Way | None", match[3]), int(match[4] or 0), float(match[5] or 0.0)
    )


@dataclass
class _Direction:
    """One direction: harms by byte, how many bytes came, and what waits for its time."""

    harms: dict[int, list[CableHarm]]
    count: int = 0
    delay_s: float = 0.0
    waiting: deque[tuple[float, bytes]] = field(default_factory=deque)

    def pass_on(self, data: bytes, now: float) -> bool:
        """Take bytes in; True when the cable is cut."""
        out = bytearray()
        for byte in data:
            passed = bytes([byte])
            for harm in self.harms.pop(self.count, ()):
                if harm.kind == "cut":
                    self._queue(out, now)
                    return True
                if harm.kind == "delay":
                    self._queue(out, now)
                    out.clear()
                    self.delay_s = harm.value
                else:
                    passed = _harmed(passed, harm)
            out += passed
            self.count += 1
        self._queue(out, now)
        return False

    def _queue(self, data: bytearray, now: float) -> None:
        if data:
            due = max(now + self.delay_s, self.waiting[-1][0] if self.waiting else 0.0)
            self.waiting.append((due, bytes(data)))


def _harmed(passed: bytes, harm: CableHarm) -> bytes:
    value = int(harm.value)
    return {
        "drop": b"",
        "double": passed * 2,
        "flip": bytes(b ^ value for b in passed),
        "add": passed + bytes([value]),
    }[harm.kind]


class _Cable:
    """The proxy: one connection after another, until it is closed."""

    def __init__(self, listener: socket.socket, peer: tuple[str, int], harms: Sequence[CableHarm]) -> None:
        self.listener, self.peer = listener, peer
        self.timed = sorted((h for h in harms if h.way is None), key=lambda h: h.at_s)
        self.ways: dict[Way, _Direction] = {"out": _Direction({}), "in": _Direction({})}
        for harm in harms:
            if harm.way is not None:
                self.ways[harm.way].harms.setdefault(harm.at, []).append(harm)
        self.first: float | None = None
        self.closing = threading.Event()

    def run(self) -> None:
        """Serve until ``closing`` is set."""
        while not self.closing.is_set():
            if not select.select([self.listener], [], [], _LOOK_S)[0]:
                continue
            host, _ = self.listener.accept()
            with contextlib.closing(host), contextlib.suppress(OSError):
                machine = socket.create_connection(self.peer, timeout=5.0)
                with contextlib.closing(machine):
                    for end in (host, machine):
                        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._carry(host, machine)

    def _carry(self, host: socket.socket, machine: socket.socket) -> None:
        self.first = time.monotonic() if self.first is None else self.first
        routes: tuple[tuple[Way, socket.socket, socket.socket], ...] = (
            ("out", host, machine),
            ("in", machine, host),
        )
        for way in self.ways.values():
            way.waiting.clear()
        while not self.closing.is_set():
            now = time.monotonic()
            due = [way.waiting[0][0] - now for way in self.ways.values() if way.waiting]
            due += [self.timed[0].at_s - (now - self.first)] if self.timed else []
            ready = select.select([host, machine], [], [], max(min([*due, _LOOK_S]), 0.0))[0]
            now = time.monotonic()
            if self._strikes(now - self.first):
                return
            ended = False
            for name, source, _ in routes:
                if source in ready:
                    data = source.recv(65536)
                    ended = ended or not data or self.ways[name].pass_on(data, now)
            for name, _, target in routes:
                waiting = self.ways[name].waiting
                while waiting and (waiting[0][0] <= now or (ended and self.ways[name].delay_s == 0.0)):
                    target.sendall(waiting.popleft()[1])
            if ended:
                return

    def _strikes(self, seconds: float) -> bool:
        """Harms by time; True when the cable is cut."""
        while self.timed and self.timed[0].at_s <= seconds:
            harm = self.timed.pop(0)
            if harm.kind == "cut":
                return True
            for way in self.ways.values():
                way.delay_s = harm.value
        return False


@contextlib.contextmanager
def cable(url: str, harms: Sequence[CableHarm], port: int = 0) -> Iterator[str]:
    """Run a bad cable to a machine while the block runs; yields the URL of its near end.

    Args:
        url: ``socket://127.0.0.1:PORT`` of the machine.
        harms: what the cable does.
        port: where it listens on 127.0.0.1; 0 takes a free port.

    Raises:
        MachineError: if the machine is not on this computer, or the port is taken.
    """
    parts = urlsplit(url)
    if parts.scheme != "socket" or parts.hostname not in ("127.0.0.1", "localhost") or parts.port is None:
        raise MachineError(
            f"{url}: a bad cable leads to socket://127.0.0.1:PORT only, never to a real machine"
        )
    try:
        listener = socket.create_server(("127.0.0.1", port))
    except OSError as error:
        raise MachineError(f"127.0.0.1:{port}: the cable cannot listen here: {error.strerror}") from error
    with contextlib.closing(listener):
        wire = _Cable(listener, ("127.0.0.1", parts.port), harms)
        thread = threading.Thread(target=wire.run, name="cable", daemon=True)
        thread.start()
        try:
            yield f"socket://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            wire.closing.set()
            thread.join(timeout=5.0)
