"""Marlin behind the same driver: lines that passed the gate are numbered and summed, answers become Grbl's.

Marlin checks every line: a damaged or missing one is asked for again, so each line is executed once and in
order. It has no realtime bytes: while a block runs, its ``busy`` lines say that it lives, and a stop is
``M112``, which needs its EMERGENCY_PARSER. Light is ``M4 I``: power per move, scaled with speed. Not tried on
a real Marlin yet. Sources: Marlin's queue.cpp (numbers, ``Resend``), M3-M5.cpp, M114.cpp, M115.cpp.
"""

from __future__ import annotations

import functools
import operator
import re
import time
from collections import deque
from dataclasses import dataclass

from rigs.errors import JobError, MachineError
from rigs.gate import split_words
from rigs.link import Link
from rigs.rig import Rig

__all__ = ["MarlinLink", "marlin_line", "spoken"]

_HISTORY = 64
_STALE_S = 0.8
_DROPPED_G = frozenset((17.0, 54.0, 94.0))
_QUERIES = {b"$I": "M115", b"$$": "M503", b"$#": "M114", b"$H": "G28"}
_POSITION = re.compile(r"^X:\s*-?\d")
_AXIS = re.compile(r"([A-Z]):\s*(-?\d+\.?\d*)")
_SETTING = re.compile(r"^(?:echo:)?\s*M(92|201|203)((?:\s+[A-Z]-?\d+\.?\d*)+)")
_BASE = {"92": (100, 1.0), "203": (110, 60.0), "201": (120, 1.0)}
_ASKED_AGAIN = ("checksum mismatch", "line number is not", "no checksum", "no line number")


@dataclass
class _Waiting:
    kind: str
    since: float


def marlin_line(line: str, motion: float) -> tuple[str, float]:
    """A line of a job as Marlin has it, and the motion mode after it; empty if Marlin needs no such line.

    Args:
        line: as it passed the gate.
        motion: 0 or 1, the motion mode before it.
    """
    out: list[str] = []
    moved = False
    for letter, value in split_words(line) or []:
        if (letter == "G" and value in _DROPPED_G) or (letter == "M" and value in (2.0, 30.0)):
            continue
        if letter == "G" and value in (0.0, 1.0):
            motion = value
            continue
        moved = moved or letter in "XYZABC"
        if letter == "M" and value == 4.0:
            out.append("M4 I")
        elif letter == "P":
            out.append(f"P{1000.0 * value:.0f}")  # seconds in Grbl, milliseconds in Marlin
        else:
            out.append(f"{letter}{value:.3f}".rstrip("0").rstrip("."))
    if out and out[0] == "M5":
        out = out[:1]
    return " ".join([f"G{motion:g}", *out] if moved else out), motion


class MarlinLink:
    """Stands where a ``Link`` stands; Grbl's protocol above, Marlin's below.

    Args:
        link: the port.
        rig: its axes and receive buffer.
    """

    def __init__(self, link: Link, rig: Rig) -> None:
        self._link, self._rig = link, rig
        self.url = link.url
        self._number = 0
        self._sent: dict[int, bytes] = {}
        self._waiting: deque[_Waiting] = deque()
        self._ready: deque[bytes] = deque()
        self._swallow = 0
        self._motion = 0.0
        self._halted = False

    # -- to the machine -----------------------------------------------------------------------------------

    def write(self, data: bytes) -> None:
        """Send lines that passed the gate, or answer a question that Marlin does not know.

        Raises:
            JobError: if a block does not fit the receive buffer with its numbers and sums.
            MachineError: if the port fails.
        """
        if data == b"?":
            self._ask_position()
            return
        framed = bytearray()
        for text in data.decode("ascii").splitlines():
            if text == "$G":
                self._waiting.append(_Waiting("none", time.monotonic()))
                continue
            if (query := _QUERIES.get(text.encode())) is not None:
                kind = {"$#": "offsets", "$$": "settings"}.get(text, "query")
                framed += self._frame(query, kind)
                continue
            line, self._motion = marlin_line(text, self._motion)
            if line:
                framed += self._frame(line, "line")
            else:
                self._waiting.append(_Waiting("none", time.monotonic()))
        if len(framed) > self._rig.controller.rx_bytes - 8:
            raise JobError(
                f"a block of {len(framed)} bytes, with Marlin's numbers and sums, does not fit the receive "
                f"buffer of {self._rig.name} ({self._rig.controller.rx_bytes} bytes, 8 kept free)"
            )
        if framed:
            self._link.write(bytes(framed))
        self._settle()

    def urgent(self, _data: bytes) -> None:
        """Grbl's hold and reset are ``M112`` here: everything off; the board needs a reset afterwards."""
        self._waiting.clear()
        self._ready.clear()
        self._halted = True
        self._link.urgent(b"\nM112\nM5\n")

    def _ask_position(self) -> None:
        now = time.monotonic()
        if any(w.kind not in ("status", "none") or now - w.since < _STALE_S for w in self._waiting):
            return  # it is busy, and says so itself
        fresh = not self._sent or bool(self._waiting)
        self._waiting.clear()
        data = b""
        if fresh:  # after opening, or when it did not answer: agree on the numbers first
            self._sent.clear()
            self._number = 0
            data = self._frame("M110 N0", "reset", number=0)
            self._number = 0
        self._link.write(data + self._frame("M114", "status"))

    def _frame(self, line: str, kind: str, number: int | None = None) -> bytes:
        if number is None:
            self._number += 1
            number = self._number
        body = f"N{number} {line}".encode("ascii")
        data = body + b"*%d\n" % functools.reduce(operator.xor, body)
        self._sent[number] = data
        self._sent.pop(number - _HISTORY, None)
        self._waiting.append(_Waiting(kind, time.monotonic()))
        return data

    # -- from the machine ---------------------------------------------------------------------------------

    def read_line(self, timeout_s: float) -> bytes | None:
        """The next answer, as Grbl would have given it; None when none came in time.

        Raises:
            MachineError: if the port vanished, sends an endless line, or asks for a line that is long gone.
        """
        deadline = time.monotonic() + timeout_s
        while not self._ready:
            raw = self._link.read_line(max(deadline - time.monotonic(), 0.0))
            if raw is None:
                return None
            self._take(raw.decode("utf-8", "replace").strip())
        return self._ready.popleft()

    def drain(self) -> None:
        """Forget what has been received."""
        self._link.drain()
        self._ready.clear()

    def close(self) -> None:
        """Close the port."""
        self._link.close()

    def _take(self, text: str) -> None:
        low = text.lower()
        setting = _SETTING.match(text)
        if low == "ok" or low.startswith("ok "):
            self._answered()
        elif low.startswith(("resend:", "rs ")):
            self._again(text)
        elif low.startswith("error:") and any(words in low for words in _ASKED_AGAIN):
            return
        elif low.startswith("error:"):
            self._ready.append(f"ALARM:{text[6:]}".encode())
        elif low.startswith(("busy:", "echo:busy")):
            self._ready.append(b"[MSG:busy]")
        elif _POSITION.match(text):
            self._position(text)
        elif setting is not None:
            self._settings(setting[1], setting[2])
        elif low.startswith("echo:unknown command"):
            self._ready.append(f"error:20 {text[5:]}".encode())
        elif text.startswith(("FIRMWARE_NAME:", "Cap:")):
            self._ready.append(f"[{text}]".encode())
        elif low == "start":
            self._ready.append(b"Marlin restarted")
        elif not low or low == "wait" or low.startswith(("echo:", "//")) or self._in("settings", "query"):
            return
        else:
            self._ready.append(text.encode())

    def _in(self, *kinds: str) -> bool:
        return bool(self._waiting) and self._waiting[0].kind in kinds

    def _answered(self) -> None:
        if self._swallow:
            self._swallow -= 1
            return
        if not self._waiting:
            self._ready.append(b"ok")
            return
        if self._waiting.popleft().kind not in ("status", "reset"):
            self._ready.append(b"ok")
        self._settle()

    def _settle(self) -> None:
        """Lines that Marlin never saw are answered once all before them are."""
        while self._waiting and self._waiting[0].kind == "none":
            self._waiting.popleft()
            self._ready.append(b"ok")

    def _again(self, text: str) -> None:
        match = re.search(r"\d+", text)
        number = int(match[0]) if match else -1
        if self._halted:
            return
        if number not in self._sent or number > self._number:
            raise MachineError(
                f"{self.url}: the controller asks for line {number} again, it has had up to {self._number}: "
                "its position is lost"
            )
        self._swallow += 1  # it acknowledges the request itself
        self._link.write(b"".join(self._sent[n] for n in range(number, self._number + 1)))

    def _position(self, text: str) -> None:
        place = dict(_AXIS.findall(text.split("Count")[0]))
        words = [word for word in self._rig.axis_words if word in place]
        numbers = ",".join(f"{float(place[word]):.3f}" for word in words)
        if self._in("offsets"):
            self._ready.append(f"[G54:{','.join('0.000' for _ in words)}]".encode())
        else:
            state = "Run" if any(w.kind == "line" for w in self._waiting) else "Idle"
            self._ready.append(f"<{state}|WPos:{numbers}|FS:0,0>".encode())

    def _settings(self, code: str, words: str) -> None:
        base, scale = _BASE[code]
        for word, value in re.findall(r"([A-Z])(-?\d+\.?\d*)", words):
            if word in self._rig.axis_words:
                number = base + self._rig.axis_words.index(word)
                self._ready.append(f"${number}={scale * float(value):.3f}".encode())


def spoken(link: Link, rig: Rig) -> Link | MarlinLink:
    """The link in the dialect of the rig."""
    return MarlinLink(link, rig) if rig.controller.dialect == "marlin" else link
