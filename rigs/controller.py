"""A conversation with a GRBL controller: questions, blocks, confirmations, and what counts as lost."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Sequence

from rigs.errors import MachineError
from rigs.grbl import Answer, Status, error_text, read_answer
from rigs.identity import Identity
from rigs.listener import Listener, state_words
from rigs.replay_blocks import light_of

__all__ = ["LATE_S", "Controller"]

_HELLO_S = 5.0
_QUIET_S = 0.05
_HOMING_S = 180.0
_IDLE_S = 2.0
_LOOK_S = 0.05
_MOST_ANSWERS = 10_000

LATE_S = 0.45
"""Light that is not confirmed off this long after its planned end is stopped."""


class Controller(Listener):
    """Sends through the gate and waits for answers; everything unexpected is a ``MachineError``."""

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
                line = self.read(left)
                if line is not None and self.note(read_answer(line)) == "status" and self.status:
                    self.swallow(deadline)
                    return self.status
        raise MachineError(
            f"{self.link.url}: nothing answers '?' within {_HELLO_S:g} s: switched on, right port, "
            f"{self.rig.controller.baud} baud? (after a limit alarm a controller is mute until it is reset)"
        )

    def swallow(self, deadline: float) -> None:
        """Read greetings, and answers to nothing that was asked, until it is quiet."""
        while time.monotonic() < deadline and self.read(_QUIET_S) is not None:
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
        dark_at, light_s, self.s_most = light_of(lines, seconds)
        self.hear_out()
        self.obey()
        self.running = True
        try:
            count = self.gate.send(lines)
            due = (dark_at, light_s + LATE_S) if dark_at else None
            self._collect(count, patience_s=1.1 * seconds + grace_s, lines=lines, due=due)
        finally:
            self.running = False
            self.s_most = math.inf

    def hear_out(self) -> None:
        """Read what has come meanwhile; a restart, an alarm or an answer to nothing is a fault.

        Raises:
            MachineError: naming it.
        """
        while (line := self.read(0.0)) is not None:
            answer = read_answer(line)
            if self.note(answer) in ("ok", "error"):
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
            if status.state in ("Hold", "Door") and self.on_hold is not None:
                self.holds = status.state
                deadline += self.held(at_rest=True)
                continue
            if time.monotonic() > deadline:
                raise MachineError(f"the machine should stand still now, it reports {state_words(status)}")
            time.sleep(0.005)

    def ask_status(self) -> Status:
        """One ``?`` and its answer."""
        self.gate.ask_status()
        deadline = time.monotonic() + self.rig.safety.status_lost_s
        while (left := deadline - time.monotonic()) > 0.0:
            line = self.read(left)
            if line is None:
                break
            answer = read_answer(line)
            kind = self.note(answer)
            if kind == "status" and self.status is not None:
                return self.status
            if kind == "ok":
                raise MachineError(
                    "the controller sent an 'ok' too many: bytes were lost or doubled on the way"
                )
            if kind == "error":
                raise MachineError(f"the controller answered {answer.text} ({error_text(answer.code)})")
        raise self.mute()

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
            line = self.read(left)
            if line is not None and read_answer(line).kind in ("ok", "error"):
                break

    def _question(self, question: str, kind: str, patience_s: float = _HELLO_S) -> tuple[str, ...]:
        self.gate.ask(question)
        return tuple(a.text for a in self._collect(1, patience_s=patience_s) if a.kind == kind)

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
            line = self.read(0.0)  # what has come counts before any time limit: this host may have been slow
            now = time.monotonic()
            if line is None:
                lost = self.held()
                start, now = start + lost, now + lost
                self.check_times(now, start, heard, asked if poll else None, patience_s, count - got)
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
                line = self.read(max(min(ends), 0.001))
            if line is None:
                continue
            heard = self.heard
            answer = read_answer(line)
            kind = self.note(answer)
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
