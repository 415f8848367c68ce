"""A conversation with a GRBL controller: questions, blocks, confirmations, and what counts as lost."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rigs.errors import MachineError
from rigs.gate import Gate
from rigs.grbl import Answer, Status, alarm_text, error_text, read_answer, read_status
from rigs.link import Link
from rigs.rig import Rig

__all__ = ["Controller", "Identity"]

_HELLO_S = 5.0
_QUIET_S = 0.05
_HOMING_S = 180.0
_IDLE_S = 2.0


@dataclass
class Identity:
    """What the controller says about itself.

    Attributes:
        info: lines of ``$I``; ``settings`` of ``$$``; ``offsets`` lines of ``$#``; ``modes`` line of ``$G``.
    """

    info: tuple[str, ...] = ()
    settings: dict[str, float] = field(default_factory=dict)
    offsets: tuple[str, ...] = ()
    modes: tuple[str, ...] = ()

    @property
    def emulated(self) -> bool:
        """True when ``$I`` carries the mark of the emulator."""
        return any(line.startswith("[VER:") and line.endswith(":EMULATED]") for line in self.info)

    def offset(self, name: str) -> tuple[float, ...]:
        """An offset of ``$#`` such as ``G54``; empty when it is missing."""
        for line in self.offsets:
            if line.startswith(f"[{name}:"):
                with contextlib.suppress(ValueError):
                    return tuple(float(v) for v in line[len(name) + 2 : -1].split(","))
        return ()


class Controller:
    """Sends through the gate and waits for answers; everything unexpected is a ``MachineError``.

    Attributes:
        gate: what may pass.
        rig: the machine as it should be.
        offset: work offset that the controller reports.
        status: the last status report.
        on_status: called with every status report, for a shadow or a log.
    """

    def __init__(self, link: Link, rig: Rig, on_status: Callable[[Status], None] | None = None) -> None:
        self.link = link
        self.gate = Gate(link, rig)
        self.rig = rig
        self.offset: tuple[float, ...] = ()
        self.status: Status | None = None
        self.on_status = on_status
        self._running = False

    def hello(self) -> Status:
        """Wait until the controller answers ``?``; a board that resets on opening takes its time.

        Raises:
            MachineError: if it never answers.
        """
        deadline = time.monotonic() + _HELLO_S
        while time.monotonic() < deadline:
            self.gate.ask_status()
            until = time.monotonic() + 0.5
            while (left := until - time.monotonic()) > 0.0:
                line = self.link.read_line(left)
                if line is not None and self._note(read_answer(line)) == "status" and self.status:
                    while self.link.read_line(_QUIET_S) is not None:
                        pass  # greetings, and answers to nothing that was asked
                    return self.status
        raise MachineError(
            f"{self.link.url}: nothing answers '?' within {_HELLO_S:g} s: switched on, right port, "
            f"{self.rig.controller.baud} baud? (after a limit alarm a controller is mute until it is reset)"
        )

    def identify(self) -> Identity:
        """Ask ``$I $$ $# $G``."""
        info = self._question("$I", "message")
        settings = dict(text.split("=", 1) for text in self._question("$$", "setting"))
        values: dict[str, float] = {}
        for key, text in settings.items():
            with contextlib.suppress(ValueError, IndexError):
                values[key] = float(text.split()[0])
        identity = Identity(info, values, self._question("$#", "message"), self._question("$G", "message"))
        self.offset = identity.offset("G54")
        return identity

    def home(self) -> None:
        """Run the homing cycle; the controller may be silent meanwhile."""
        self.gate.home()
        self._collect(1, patience_s=_HOMING_S, poll=False)

    def run(self, lines: Sequence[str], seconds: float, grace_s: float) -> None:
        """Send lines in one write and wait until each is answered ``ok``.

        Args:
            lines: the last one must be answered only when the motion has ended (``M5`` after light, ``G4``).
            seconds: how long the lines should take.
            grace_s: how much longer than that may pass before an answer counts as missing.

        Raises:
            MachineError: on errors, alarms, resets, silence and a vanished port.
        """
        self._running = True
        try:
            count = self.gate.send(lines)
            self._collect(count, patience_s=1.25 * seconds + grace_s, lines=lines)
        finally:
            self._running = False

    def confirm_idle(self) -> Status:
        """Ask for a status until the machine is idle.

        Raises:
            MachineError: if it does not become idle.
        """
        deadline = time.monotonic() + max(_IDLE_S, self.rig.safety.status_lost_s)
        while True:
            status = self.ask_status()
            if status.state in ("Idle", "Check"):
                return status
            if time.monotonic() > deadline:
                raise MachineError(f"the machine should stand still now, it reports {_full(status)}")
            time.sleep(0.005)

    def ask_status(self) -> Status:
        """One ``?`` and its answer."""
        self.gate.ask_status()
        deadline = time.monotonic() + self.rig.safety.status_lost_s
        while (left := deadline - time.monotonic()) > 0.0:
            line = self.link.read_line(left)
            if line is None:
                break
            answer = read_answer(line)
            kind = self._note(answer)
            if kind == "status" and self.status is not None:
                return self.status
            if kind == "ok":
                raise MachineError(
                    "the controller sent an 'ok' too many: bytes were lost or doubled on the way"
                )
            if kind == "error":
                raise MachineError(f"the controller answered {answer.text} ({error_text(answer.code)})")
        raise self._mute()

    def work_position(self, status: Status) -> dict[str, float]:
        """Work coordinates by axis word."""
        words = self.rig.axis_words
        if status.work is not None:
            return dict(zip(words, status.work, strict=False))
        machine = status.machine or ()
        offset = self.offset or (0.0,) * len(machine)
        return {w: m - o for w, m, o in zip(words, machine, offset, strict=False)}

    def emergency_stop(self) -> None:
        """Hold, soft reset, ``M5``, whatever the state; never raises."""
        with contextlib.suppress(Exception):
            self.gate.stop()
        with contextlib.suppress(Exception):
            until = time.monotonic() + 0.3
            while (left := until - time.monotonic()) > 0.0:
                line = self.link.read_line(left)
                if line is not None and read_answer(line).kind == "banner":
                    break
        with contextlib.suppress(Exception):
            self.gate.dark()
            until = time.monotonic() + 0.2
            while (left := until - time.monotonic()) > 0.0:
                line = self.link.read_line(left)
                if line is not None and read_answer(line).kind in ("ok", "error"):
                    break

    def _question(self, question: str, kind: str) -> tuple[str, ...]:
        self.gate.ask(question)
        return tuple(a.text for a in self._collect(1, patience_s=_HELLO_S) if a.kind == kind)

    def _collect(
        self, count: int, *, patience_s: float, poll: bool = True, lines: Sequence[str] = ()
    ) -> list[Answer]:
        answers: list[Answer] = []
        got = 0
        start = heard = time.monotonic()
        period = 1.0 / self.rig.safety.status_hz
        asked: float | None = None
        next_ask = start + period
        while got < count:
            now = time.monotonic()
            if poll and asked is not None and now - max(asked, heard) > self.rig.safety.status_lost_s:
                raise self._mute()
            if poll and now >= next_ask:
                self.gate.ask_status()
                asked = now if asked is None else asked
                next_ask = now + period
            if now - start > patience_s:
                raise MachineError(
                    f"{count - got} of {count} answers are missing after {now - start:.1f} s: "
                    "bytes were lost on the way"
                )
            line = self.link.read_line(max(min(next_ask - now, period), 0.001))
            if line is None:
                continue
            heard = time.monotonic()
            answer = read_answer(line)
            kind = self._note(answer)
            if kind == "status":
                asked = None
            elif kind == "ok":
                got += 1
            elif kind == "error":
                where = f" to '{lines[got]}'" if got < len(lines) else ""
                raise MachineError(f"the controller answered {answer.text}{where}: {error_text(answer.code)}")
            elif kind == "other":
                raise MachineError(f"answer not understood: {answer.text[:60]!a}: bytes were lost on the way")
            answers.append(answer)
        return answers

    def _note(self, answer: Answer) -> str:
        if answer.kind == "alarm":
            raise MachineError(
                f"the controller raised {answer.text}: {alarm_text(answer.code)}; "
                "home it before anything else"
            )
        if answer.kind == "banner" and self._running:
            raise MachineError(
                f"the controller restarted in the middle of the job ('{answer.text}'): its position is lost"
            )
        if answer.kind == "status":
            status = read_status(answer.text)
            if status is None:
                return "mangled"
            if status.offset is not None:
                if self._running and self.offset and not _near(status.offset, self.offset):
                    raise MachineError(
                        "the work offset changed in the middle of the job: the position is lost"
                    )
                self.offset = status.offset
            self.status = status
            if self.on_status is not None:
                self.on_status(status)
            if self._running and status.state in ("Hold", "Door", "Alarm", "Sleep"):
                raise MachineError(f"the machine went to {_full(status)} by itself")
            if self._running and status.overrides is not None and status.overrides[-1] != 100.0:
                raise MachineError(
                    f"the power override stands at {status.overrides[-1]:g} %: set it to 100 %"
                )
        return answer.kind

    def _mute(self) -> MachineError:
        return MachineError(
            f"{self.link.url}: no answer for {self.rig.safety.status_lost_s:g} s: "
            "the controller or the cable is lost (after a limit alarm it is mute until a reset)"
        )


def _near(a: Sequence[float], b: Sequence[float]) -> bool:
    return len(a) == len(b) and all(abs(x - y) < 0.0015 for x, y in zip(a, b, strict=True))


def _full(status: Status) -> str:
    return status.state if status.substate is None else f"{status.state}:{status.substate}"
