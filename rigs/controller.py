"""A conversation with a GRBL controller: questions, blocks, confirmations, and what counts as lost."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Callable, Sequence

from rigs.errors import MachineError
from rigs.gate import Gate
from rigs.grbl import Answer, Status, alarm_text, error_text, read_answer, read_status
from rigs.identity import Identity
from rigs.link import Link
from rigs.marlin import MarlinLink
from rigs.replay_blocks import light_of
from rigs.rig import Rig

__all__ = ["LATE_S", "Controller"]

_HELLO_S = 5.0
_QUIET_S = 0.05
_HOMING_S = 180.0
_IDLE_S = 2.0
_LOOK_S = 0.05
_MOST_ANSWERS = 10_000

LATE_S = 0.45
"""Light that is not confirmed off this long after its planned end is stopped."""


class Controller:
    """Sends through the gate and waits for answers; everything unexpected is a ``MachineError``.

    Attributes:
        gate: what may pass.
        rig: the machine as it should be.
        offset: work offset that the controller reports.
        status: the last status report.
        heard: when the last line came from the controller, on the monotonic clock.
        in_job: True from the first block on: a restart or an alarm then means that the position is lost.
        on_status: called with every status report, for a shadow or a log.
        on_look: called whenever the controller is listened to.
        stop: when it is set, from any thread, the job is stopped.
    """

    def __init__(
        self, link: Link | MarlinLink, rig: Rig, on_status: Callable[[Status], None] | None = None
    ) -> None:
        self.link = link
        self.gate = Gate(link, rig)
        self.rig = rig
        self.offset: tuple[float, ...] = ()
        self.status: Status | None = None
        self.on_status = on_status
        self.on_look: Callable[[], None] | None = None
        self.stop: threading.Event | None = None
        self.heard = time.monotonic()
        self.in_job = False
        self._running = False
        self._s_most = math.inf

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
                line = self._read(left)
                if line is not None and self._note(read_answer(line)) == "status" and self.status:
                    self.swallow(deadline)
                    return self.status
        raise MachineError(
            f"{self.link.url}: nothing answers '?' within {_HELLO_S:g} s: switched on, right port, "
            f"{self.rig.controller.baud} baud? (after a limit alarm a controller is mute until it is reset)"
        )

    def swallow(self, deadline: float) -> None:
        """Read greetings, and answers to nothing that was asked, until it is quiet."""
        while time.monotonic() < deadline and self._read(_QUIET_S) is not None:
            pass

    def darken(self) -> None:
        """Switch the light off before anything else; a controller that shows light at rest is reset.

        A Grbl that was left in M3 shines on at standstill and says so only by the power word of its status.

        Raises:
            MachineError: if it still shows light afterwards.
        """
        self.gate.dark()
        self._answered(self.rig.safety.status_lost_s)
        status = self.ask_status()
        if status.s > 0.0 and status.state in ("Idle", "Alarm", "Check"):
            self.gate.reset()
            self.swallow(time.monotonic() + _HELLO_S)
            status = self.ask_status()
            if status.s > 0.0:
                raise MachineError(
                    f"{self.link.url}: the controller shows power S{status.s:g} at rest, after M5 and a "
                    "reset: switch the laser off by hand"
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

    def modes(self) -> tuple[str, ...]:
        """The answer to ``$G``; empty where a firmware has none."""
        return self._question("$G", "message", self.rig.safety.status_lost_s)

    def home(self) -> None:
        """Run the homing cycle; the controller may be silent meanwhile."""
        self.gate.home()
        self._collect(1, patience_s=_HOMING_S, poll=False)

    def run(self, lines: Sequence[str], seconds: float, grace_s: float) -> None:
        """Send lines in one write and wait until each is answered ``ok``.

        Light must be confirmed off within the planned time and ``LATE_S``, whatever ``grace_s`` says; a feed
        word that arrived damaged would burn for longer than planned.

        Args:
            lines: the last one must be answered only when the motion has ended (``M5`` after light, ``G4``).
            seconds: how long the lines should take.
            grace_s: how much longer than that may pass before an answer counts as missing.

        Raises:
            MachineError: on errors, alarms, resets, silence and a vanished port.
        """
        dark_at, light_s, self._s_most = light_of(lines, seconds)
        self.hear_out()
        self._obey()
        self._running = True
        try:
            count = self.gate.send(lines)
            due = (dark_at, light_s + LATE_S) if dark_at else None
            self._collect(count, patience_s=1.1 * seconds + grace_s, lines=lines, due=due)
        finally:
            self._running = False
            self._s_most = math.inf

    def hear_out(self) -> None:
        """Read what has come meanwhile; a restart, an alarm or an answer to nothing is a fault.

        Raises:
            MachineError: naming it.
        """
        while (line := self._read(0.0)) is not None:
            answer = read_answer(line)
            if self._note(answer) in ("ok", "error"):
                raise MachineError(
                    f"the controller answered '{answer.text}' to nothing: bytes were lost or doubled on the "
                    "way"
                )

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
            line = self._read(left)
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
            self._answered(0.2)

    def _answered(self, patience_s: float) -> None:
        """Wait for one ``ok`` or ``error``, or no longer than that."""
        until = time.monotonic() + patience_s
        while (left := until - time.monotonic()) > 0.0:
            line = self._read(left)
            if line is not None and read_answer(line).kind in ("ok", "error"):
                break

    def _question(self, question: str, kind: str, patience_s: float = _HELLO_S) -> tuple[str, ...]:
        self.gate.ask(question)
        return tuple(a.text for a in self._collect(1, patience_s=patience_s) if a.kind == kind)

    def _read(self, timeout_s: float) -> bytes | None:
        if self.on_look is not None:
            self.on_look()
        line = self.link.read_line(timeout_s)
        if line is not None:
            self.heard = time.monotonic()
        return line

    def _collect(
        self,
        count: int,
        *,
        patience_s: float,
        poll: bool = True,
        lines: Sequence[str] = (),
        due: tuple[int, float] | None = None,
    ) -> list[Answer]:
        answers: list[Answer] = []
        got = 0
        start = heard = time.monotonic()
        period = 1.0 / self.rig.safety.status_hz
        asked: float | None = None
        next_ask = start + period
        while got < count:
            line = self._read(0.0)  # what has come counts before any time limit: this host may have been slow
            now = time.monotonic()
            if line is None:
                self._check_times(now, start, heard, asked if poll else None, patience_s, count - got)
                if due is not None and got < due[0] and now - start > due[1]:
                    raise MachineError(
                        f"the end of the light was due {now - start - due[1] + LATE_S:.1f} s ago and is not "
                        "confirmed: the block runs longer than planned, or answers were lost"
                    )
                if poll and now >= next_ask:
                    self.gate.ask_status()
                    asked = now if asked is None else asked
                    next_ask = now + period
                ends = [next_ask - now, start + patience_s - now, _LOOK_S]
                ends += [start + due[1] - now] if due is not None and got < due[0] else []
                line = self._read(max(min(ends), 0.001))
            if line is None:
                continue
            heard = self.heard
            answer = read_answer(line)
            kind = self._note(answer)
            if kind == "status":
                asked = None
                continue
            if kind == "ok":
                got += 1
            elif kind == "error":
                where = f" to '{lines[got]}'" if got < len(lines) else ""
                raise MachineError(f"the controller answered {answer.text}{where}: {error_text(answer.code)}")
            elif kind == "other":
                raise MachineError(f"answer not understood: {answer.text[:60]!a}: bytes were lost on the way")
            answers.append(answer)
            if len(answers) > _MOST_ANSWERS:
                raise MachineError(
                    f"{self.link.url}: more than {_MOST_ANSWERS} lines in answer to one question"
                )
        return answers

    def _obey(self) -> None:
        if self.stop is not None and self.stop.is_set():
            raise MachineError("stopped on request")

    def _check_times(
        self, now: float, start: float, heard: float, asked: float | None, patience_s: float, missing: int
    ) -> None:
        self._obey()
        if asked is not None and now - max(asked, heard) > self.rig.safety.status_lost_s:
            raise self._mute()
        if now - start > patience_s:
            raise MachineError(
                f"{missing} answers are missing after {now - start:.1f} s: bytes were lost on the way"
            )

    def _note(self, answer: Answer) -> str:
        if answer.kind == "alarm":
            raise MachineError(
                f"the controller raised {answer.text}: {alarm_text(answer.code)}; "
                "home it before anything else"
            )
        if answer.kind == "banner" and (self._running or self.in_job):
            raise MachineError(
                f"the controller restarted in the middle of the job ('{answer.text}'): its position is lost"
            )
        if answer.kind == "status":
            status = read_status(answer.text)
            if status is None:
                return "mangled"
            if status.offset is not None:
                if self.in_job and self.offset and not _near(status.offset, self.offset):
                    raise MachineError(
                        "the work offset changed in the middle of the job: the position is lost"
                    )
                self.offset = status.offset
            self.status = status
            if self.on_status is not None:
                self.on_status(status)
            if self._running and status.state in ("Hold", "Door", "Alarm", "Sleep"):
                raise MachineError(f"the machine went to {_full(status)} by itself")
            if self._running and status.overrides is not None:
                for name, value in zip(("feed", "", "power"), status.overrides, strict=False):
                    if name and value != 100.0:
                        raise MachineError(f"the {name} override stands at {value:g} %: set it to 100 %")
            if self._running and status.s > self._s_most + 0.5:
                raise MachineError(
                    f"the controller shows S{status.s:g}, this block has S{self._s_most:g} at most: "
                    "bytes were damaged on the way"
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
