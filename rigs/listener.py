"""What comes from a controller: every line is read, sorted and noted; what may not be is a fault."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

from rigs.errors import MachineError
from rigs.gate import Gate
from rigs.grbl import Answer, Status, alarm_text, read_answer, read_status
from rigs.link import Link
from rigs.marlin import MarlinLink
from rigs.rig import Rig

__all__ = ["Listener", "state_words"]


class Listener:
    """Reads the answers of a controller.

    Attributes:
        gate: what may pass.
        rig: the machine as it should be.
        offset: work offset that the controller reports.
        status: the last status report.
        heard: when the last line came from the controller, on the monotonic clock.
        in_job: True from the first block on: a restart or an alarm then means that the position is lost.
        running: True while lines are in flight: then a hold or a changed override is a fault, too.
        s_most: largest power word that a status report may show meanwhile.
        on_status: called with every status report, for a shadow or a log.
        on_look: called whenever the controller is listened to.
        stop: when it is set, from any thread, the job is stopped.
        hold: when it is set, from any thread, the machine is held, where ``on_hold`` is there to do so.
        on_hold: holds the machine and returns when it goes on; None makes every hold a fault.
        holds: state by which the machine holds without having been told to, or None.
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
        self.hold: threading.Event | None = None
        self.on_hold: Callable[[], None] | None = None
        self.holds: str | None = None
        self._aside: deque[bytes] = deque()
        self.heard = time.monotonic()
        self.in_job = False
        self.running = False
        self.s_most = math.inf

    def read(self, timeout_s: float) -> bytes | None:
        """The next line, or None when none came in time."""
        if self._aside:
            return self._aside.popleft()
        return self._read(timeout_s)

    def _read(self, timeout_s: float) -> bytes | None:
        if self.on_look is not None:
            self.on_look()
        line = self.link.read_line(timeout_s)
        if line is not None:
            self.heard = time.monotonic()
        return line

    def obey(self) -> None:
        """Stop where somebody asked for it.

        Raises:
            MachineError: saying so.
        """
        if self.stop is not None and self.stop.is_set():
            raise MachineError("stopped on request")

    def status_aside(self) -> Status:
        """One ``?`` and its answer; answers to lines in flight are kept for whoever waits for them.

        Raises:
            MachineError: if it does not come, and as ``note``.
        """
        self.gate.ask_status()
        deadline = time.monotonic() + self.rig.safety.status_lost_s
        while (left := deadline - time.monotonic()) > 0.0:
            line = self._read(left)
            if line is None:
                break
            answer = read_answer(line)
            if answer.kind not in ("status", "alarm", "banner"):
                self._aside.append(line)
            elif self.note(answer) == "status" and self.status is not None:
                return self.status
        raise self.mute()

    def held(self, *, at_rest: bool = False) -> float:
        """Hold where somebody asked for it or the machine did; returns the seconds until it went on again.

        While lines are in flight, or with ``at_rest`` between blocks. Marlin knows no hold: only there.

        Raises:
            JobError: if it may not go on.
            MachineError: if it cannot.
        """
        asked = self.hold is not None and self.hold.is_set()
        brakes = self.rig.controller.dialect != "marlin"
        if self.on_hold is None or not (asked or self.holds) or not (at_rest or (self.running and brakes)):
            return 0.0
        start = time.monotonic()
        self.on_hold()
        return time.monotonic() - start

    def check_times(
        self, now: float, start: float, heard: float, asked: float | None, patience_s: float, missing: int
    ) -> None:
        """Stop on request, where the controller is silent, and where answers take too long.

        Args:
            now: on the monotonic clock, as all times here.
            start: when the lines were sent.
            heard: when the last line came.
            asked: when the status was asked for that has not come yet, or None.
            patience_s: how long all answers may take.
            missing: answers that have not come.

        Raises:
            MachineError: saying what is missing.
        """
        self.obey()
        if asked is not None and now - max(asked, heard) > self.rig.safety.status_lost_s:
            raise self.mute()
        if now - start > patience_s:
            raise MachineError(
                f"{missing} answers are missing after {now - start:.1f} s: bytes were lost on the way"
            )

    def note(self, answer: Answer) -> str:
        """Take an answer in; returns its kind, ``mangled`` for a status that cannot be read.

        Raises:
            MachineError: alarm, restart, moved offset, hold, override, more light than there may be.
        """
        if answer.kind == "alarm":
            raise MachineError(
                f"the controller raised {answer.text}: {alarm_text(answer.code)}; "
                "home it before anything else"
            )
        if answer.kind == "banner" and (self.running or self.in_job):
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
            if self.running and status.state in ("Hold", "Door") and self.on_hold is not None:
                self.holds = status.state
            elif self.running and status.state in ("Hold", "Door", "Alarm", "Sleep"):
                raise MachineError(f"the machine went to {state_words(status)} by itself")
            if self.running and status.overrides is not None:
                for name, value in zip(("feed", "", "power"), status.overrides, strict=False):
                    if name and value != 100.0:
                        raise MachineError(f"the {name} override stands at {value:g} %: set it to 100 %")
            if self.running and status.s > self.s_most + 0.5:
                raise MachineError(
                    f"the controller shows S{status.s:g}, this block has S{self.s_most:g} at most: "
                    "bytes were damaged on the way"
                )
        return answer.kind

    def mute(self) -> MachineError:
        """The error of a controller that does not answer."""
        return MachineError(
            f"{self.link.url}: no answer for {self.rig.safety.status_lost_s:g} s: "
            "the controller or the cable is lost (after a limit alarm it is mute until a reset)"
        )


def _near(a: Sequence[float], b: Sequence[float]) -> bool:
    return len(a) == len(b) and all(abs(x - y) < 0.0015 for x, y in zip(a, b, strict=True))


def state_words(status: Status) -> str:
    """State and sub-state, as the controller writes them."""
    return status.state if status.substate is None else f"{status.state}:{status.substate}"
