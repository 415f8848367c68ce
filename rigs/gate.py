"""The one object through which every byte goes to a machine. It refuses light outside the armed state."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Literal, Protocol

from rigs.errors import JobError
from rigs.rig import Rig

__all__ = ["Gate", "Level", "Wire", "split_words"]

Level = Literal["quiet", "held", "motion", "pilot", "armed"]
"""What may pass: questions only, twice; moves without light; moves with pilot light; the job with light."""

HOLD, GO_ON, RESET, STATUS = b"!", b"~", b"\x18", b"?"
_QUESTIONS = frozenset({"$I", "$$", "$#", "$G"})
_WORD = re.compile(r"([ABCFGLMNPSXYZ])([+-]?(?:\d+\.?\d*|\.\d+))")
_COMMENT = re.compile(r"\([^)]*\)|;.*")


def split_words(line: str) -> list[tuple[str, float]] | None:
    """Words of a G-code line without its comments; None where something is not a word."""
    text = "".join(_COMMENT.sub("", line).split()).upper()
    words: list[tuple[str, float]] = []
    place = 0
    while place < len(text):
        match = _WORD.match(text, place)
        if match is None:
            return None
        words.append((match[1], float(match[2])))
        place = match.end()
    return words


class Wire(Protocol):
    """Where the bytes go."""

    def write(self, data: bytes) -> None:
        """Write all bytes."""

    def urgent(self, data: bytes) -> None:
        """Write past everything that waits."""


class _NoLink:
    def write(self, data: bytes) -> None:
        raise JobError(f"this gate only checks: {len(data)} bytes were not sent")

    urgent = write


class Gate:
    """Checks outgoing lines against the level and the rig, then writes them in one piece.

    A gate without a link only checks.

    Attributes:
        level: what may pass, "quiet" at first; the replay raises it step by step and never by itself.
            "held" is left only where a person lets the machine go on.
        s_cap: largest S of the armed level.
    """

    def __init__(self, link: Wire | None, rig: Rig) -> None:
        self._link = link or _NoLink()
        self._rig = rig
        self.level: Level = "quiet"
        self._held = False
        self.s_cap = rig.laser.s_for_power(rig.laser.cap_fraction * rig.laser.max_w)

    def ask(self, question: str) -> None:
        """Send ``$I``, ``$$``, ``$#`` or ``$G``."""
        if question not in _QUESTIONS:
            raise JobError(f"the gate passes the questions {', '.join(sorted(_QUESTIONS))}, not '{question}'")
        self._link.write(question.encode() + b"\n")

    def ask_status(self) -> None:
        """Send ``?``; passes at every level."""
        self._link.write(STATUS)

    def hold(self, *, brakes: bool = True) -> None:
        """Feed hold; passes at every level, and nothing but questions and a stop passes afterwards.

        Args:
            brakes: False where the controller knows no hold: only the gate closes.
        """
        self.level = "held"
        self._held = True
        if brakes:
            self._link.write(HOLD)

    def go_on(self) -> None:
        """``~``: ends a hold. Only of a machine that this gate held, once its level was raised again.

        Raises:
            JobError: if nothing is held, or nobody raised the level.
        """
        if not self._held or self.level not in ("motion", "pilot", "armed"):
            raise JobError("'~' moves the machine: a person has to let it go on first")
        self._held = False
        self._link.write(GO_ON)

    def stop(self) -> None:
        """Hold and soft reset, past everything else; passes at every level and ends the armed state."""
        self.level = "quiet"
        self._held = False
        self._link.urgent(HOLD + RESET)

    def reset(self) -> None:
        """Soft reset alone, for a controller that went mute after an alarm."""
        self.level = "quiet"
        self._held = False
        self._link.urgent(RESET)

    def dark(self) -> None:
        """``M5``; passes at every level."""
        self._link.write(b"M5\n")

    def home(self) -> None:
        """``$H``: the machine moves. Only at the motion level."""
        if self.level != "motion":
            raise JobError("homing moves the machine: it needs the motion level")
        self._link.write(b"$H\n")

    def send(self, lines: Sequence[str]) -> int:
        """Check lines and write them at once; returns how many answers will come.

        Raises:
            JobError: naming the line, if one may not pass; nothing has been written then.
        """
        self.check(lines)
        self._link.write("".join(f"{line}\n" for line in lines).encode("ascii"))
        return len(lines)

    def check(self, lines: Sequence[str]) -> None:
        """Refuse lines that may not pass at this level; writes nothing.

        Raises:
            JobError: naming the line.
        """
        data = "".join(f"{line}\n" for line in lines)
        if len(data) > self._rig.controller.rx_bytes - 8:
            raise JobError(
                f"a block of {len(data)} bytes does not fit the receive buffer of {self._rig.name} "
                f"({self._rig.controller.rx_bytes} bytes, 8 kept free)"
            )
        light = False
        for line in lines:
            light = self._check(line, light)
        if light:
            raise JobError(
                f"a block ends with the light on ('{lines[-1]}'): its last spindle word must be M5"
            )

    def _check(self, line: str, light: bool) -> bool:
        if not line.isascii() or not line.isprintable():
            raise JobError(f"'{line!a}' holds bytes that are not printable ASCII")
        if len(line) > self._rig.controller.line_chars:
            raise JobError(
                f"'{line[:40]}…' has {len(line)} characters, {self._rig.controller.line_chars} are allowed"
            )
        if (words := split_words(line)) is None:
            raise JobError(f"'{line}' is not plain G-code: only words pass the gate")
        for letter, value in words:
            if letter == "M" and value in (3.0, 4.0):
                self._need_light(line, value)
                light = True
            elif letter == "M" and value in (2.0, 5.0, 30.0):
                light = False
            elif letter == "S":
                self._check_power(line, value)
            elif letter in "XYZABC" and self.level in ("quiet", "held"):
                raise JobError(f"'{line}' moves the machine before it is checked")
            elif letter == "G" and value in (10.0, 28.1, 30.1, 92.0, 91.0, 20.0):
                raise JobError(
                    f"'{line}' changes offsets, units or distance mode: jobs are absolute and in mm"
                )
        if light and any(letter == self._rig.rotary.word for letter, _ in words):
            raise JobError(f"'{line}' turns the rotary with the light on: the dose would be wrong")
        return light

    def _need_light(self, line: str, mode: float) -> None:
        if self.level == "armed" and mode == 4.0:
            return
        if self.level == "pilot" and self._rig.laser.pilot.kind == "low-power":
            return
        if self.level == "armed":
            raise JobError(f"'{line}': only M4 is used for light, M3 stays on at standstill")
        raise JobError(f"'{line}' would light the beam, the machine is not armed")

    def _check_power(self, line: str, s: float) -> None:
        cap = {"armed": self.s_cap, "pilot": self._rig.laser.pilot.s}.get(self.level, 0.0)
        if not math.isfinite(s) or not 0.0 <= s <= cap + 1e-6:
            raise JobError(f"'{line}' asks for S{s:g}, at most S{cap:g} may pass when {self.level}")
