"""A GRBL 1.1 machine in simulated time: bytes in, bytes out, moves, laser, alarms.

Behaviour follows Grbl 1.1h as measured on running firmware: ``ok`` of a move means planned, ``ok`` of ``M5``
or ``G4`` means executed, M4 light scales with speed and is off at rest, M3 light stays on at rest, with
``$32=0`` the light stays on always, ``!`` darkens, 0x18 in motion alarms, a limit mutes it until 0x18.
Power and feed overrides are ignored.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from rigs.emulator.config import MachineConfig
from rigs.emulator.dollar import dollar_line
from rigs.emulator.faults import Fault
from rigs.emulator.gcode_words import GrblError, clean_line
from rigs.emulator.motion import Motion, Segment
from rigs.emulator.parser import Modal, Wait, apply_line
from rigs.emulator.trace import Trace

__all__ = ["GrblMachine"]

_REALTIME = frozenset(b"?!~\x18")
_EPS = 1e-9


@dataclass
class GrblMachine:
    """The machine; the owner feeds bytes, moves the clock and takes the answers.

    Attributes:
        config: what it pretends to be.
        trace: where moves and light are written.
        faults: what goes wrong and when, by the number of the received line.
        now: simulated time, s.
        out: answers not yet sent.
        dropped: True when a fault cut the link; the server closes the connection.
    """

    config: MachineConfig
    trace: Trace
    faults: dict[int, Fault] = field(default_factory=dict)
    now: float = 0.0
    out: bytearray = field(default_factory=bytearray)
    dropped: bool = False

    def __post_init__(self) -> None:
        """Switch the machine on."""
        self.settings = dict(self.config.settings)
        self.wco = list(self.config.g54)
        self.lines_seen = 0
        self.mute = False
        self.power_up()

    # -- life ---------------------------------------------------------------------------------------------

    def power_up(self) -> None:
        """Start as after switching on: position zero, locked when homing is enabled."""
        self.motion = Motion((0.0,) * len(self.config.axes), self.settings.get(11, 0.01))
        self.state = "Alarm" if self.settings.get(22) else "Idle"
        self._restart()

    def _restart(self) -> None:
        self.modal = Modal(len(self.config.axes))
        self.rx = bytearray()
        self.task: Iterator[Wait] | None = None
        self.wait: Wait | None = None
        self.wake: float | None = None
        self.check = False
        self.reset_after_line = False
        self.mute = False
        self.reports = 0
        self._light()
        self.say("")
        self.say(
            f"Grbl {self.config.version.split('.')[0]}.{self.config.version.split('.')[1][:2]} ['$' for help]"
        )
        if self.state == "Alarm":
            self.say("[MSG:'$H'|'$X' to unlock]")

    def reset(self) -> None:
        """Soft reset (0x18): light off; in motion the position is no longer trusted (ALARM:3)."""
        moving = self.motion.moving and self.state != "Alarm"
        self.motion.abort(self.now)
        self._drain()
        if moving or self.state == "Home":
            self.say("ALARM:6" if self.state == "Home" else "ALARM:3")
            self.state = "Alarm"
        elif self.state != "Alarm":
            self.state = "Idle"
        self._restart()

    def alarm(self, code: int) -> None:
        """Stop at once with an alarm; after 1 and 2 nothing is answered until 0x18."""
        self.motion.abort(self.now)
        self._drain()
        self.state = "Alarm"
        self.say(f"ALARM:{code}")
        self.task = self.wait = self.wake = None
        self._light()
        if code in (1, 2):
            self.say("[MSG:Reset to continue]")
            self.mute = True

    # -- bytes --------------------------------------------------------------------------------------------

    def say(self, text: str) -> None:
        """Queue an answer line, unless the machine is mute."""
        if not self.mute:
            self.out += text.encode("ascii") + b"\r\n"

    def receive(self, data: bytes) -> None:
        """Take bytes from the link: realtime bytes act at once, the rest goes to the receive buffer."""
        for byte in data:
            if byte in _REALTIME:
                self._realtime(byte)
            elif byte == 0x84:
                self._hold("Door")
            elif byte < 0x80 and len(self.rx) < self.config.rx_bytes:
                self.rx.append(byte)
        self.pump()

    def _realtime(self, byte: int) -> None:
        if byte == 0x18:
            self.reset()
        elif self.mute:
            return
        elif byte == ord("?"):
            self.say(self.status())
        elif byte == ord("!"):
            self._hold("Hold")
        elif byte == ord("~") and self.state in ("Hold", "Door") and not self.motion.moving:
            self.motion.resume(self.now)
            self.state = "Idle"
            self._light()

    def _hold(self, state: str) -> None:
        if self.state in ("Idle", "Hold", "Door"):
            self.motion.hold(self.now)
            self._drain()
            self.state = state
            self._light()

    # -- time ---------------------------------------------------------------------------------------------

    def next_event(self) -> float | None:
        """Simulated time of the next thing that happens by itself, or None."""
        times = [t for t in (self.motion.next_event(), self.wake) if t is not None]
        return min(times) if times else None

    def advance(self, to: float) -> None:
        """Move the clock; everything up to then happens in order."""
        while (event := self.next_event()) is not None and event <= to:
            self._step_to(event)
        self._step_to(to)

    def _step_to(self, t: float) -> None:
        self.now = max(self.now, t)
        self.motion.advance(self.now)
        self._drain()
        self._light()
        self.pump()

    def _drain(self) -> None:
        for start, end, segment in self.motion.finished:
            self.trace.move(start, end, segment, self.beam_share(segment))
        self.motion.finished.clear()

    def beam_share(self, segment: Segment) -> str:
        """How the light behaves in a move: ``off``, ``scaled`` with speed, or ``full``."""
        if segment.mode == 5 or segment.s <= 0.0:
            return "off"
        if not self.settings.get(32):
            return "full"
        if segment.rapid:
            return "off"
        return "scaled" if segment.mode == 4 else "full"

    def _light(self) -> None:
        """Light at standstill, by the rules that make M3 and $32=0 dangerous."""
        laser = bool(self.settings.get(32))
        on = self.modal.spindle == 3 or (self.modal.spindle == 4 and not laser)
        on = on and self.state == "Idle" and not self.motion.moving
        self.trace.rest(self.now, min(self.modal.s, self.settings.get(30, 1000.0)) if on else 0.0)

    # -- lines --------------------------------------------------------------------------------------------

    def pump(self) -> None:
        """Run lines from the buffer until one has to wait."""
        while True:
            if self.task is None:
                end = self.rx.find(b"\n")
                if self.mute or self.dropped or self.state in ("Hold", "Door"):
                    return
                if end < 0 and len(self.rx) < self.config.rx_bytes:
                    return
                end = len(self.rx) - 1 if end < 0 else end
                line = bytes(self.rx[: end + 1])
                del self.rx[: end + 1]
                self.task = self._line(line.strip(b"\r\n").decode("ascii"))
            elif self.wait is not None and not self._ready():
                return
            try:
                self.wait = next(self.task)
            except StopIteration:
                self.task = self.wait = None
            except GrblError as error:
                self.task = self.wait = None
                self.say(f"error:{error.code}")
            if self.dropped:
                return

    def _ready(self) -> bool:
        wait = self.wait
        if wait is None:
            return True
        if not wait.sync:
            return len(self.motion.queue) < self.config.planner_blocks
        if self.motion.queue:
            return False
        if wait.seconds > 0.0 and self.wake is None:
            self.wake = self.now + wait.seconds
        if self.wake is not None and self.now < self.wake - _EPS:
            return False
        self.wake = None
        return True

    def _line(self, raw: str) -> Iterator[Wait]:
        self.lines_seen += 1
        self.trace.line(self.now, raw)
        fault = self.faults.get(self.lines_seen)
        if fault is not None:
            if fault.kind == "error":
                raise GrblError(fault.code)
            if fault.strike(self):
                return
        if len(raw) > self.config.line_chars:
            raise GrblError(11)
        if raw.strip().startswith("$"):
            yield from dollar_line(self, "".join(raw.split()).upper())
        else:
            line = clean_line(raw)
            if self.state == "Alarm" and line:
                raise GrblError(9)
            yield from apply_line(self, line)
        if fault is not None and fault.after(self):
            return
        self.say("ok")
        if self.reset_after_line:
            self.reset()

    # -- reports ------------------------------------------------------------------------------------------

    def status(self) -> str:
        """The answer to ``?``."""
        position, speed = self.motion.state(self.now)
        state = "Check" if self.check and self.state == "Idle" else self.state
        if state == "Idle" and (self.motion.moving or (self.wait is not None and self.wake is not None)):
            state = "Run"
        elif state in ("Hold", "Door"):
            state += ":1" if self.motion.moving else ":0"
        fields = [state, "MPos:" + ",".join(f"{v:.3f}" for v in position)]
        fields.append(f"FS:{speed * 60.0:.0f},{self.trace.s_now:.0f}")
        if self.reports % 10 == 0:
            fields.append("WCO:" + ",".join(f"{v:.3f}" for v in self.wco))
        elif self.reports % 10 == 1:
            fields.append("Ov:100,100,100")
        self.reports += 1
        return "<" + "|".join(fields) + ">"
