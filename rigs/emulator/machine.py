"""A GRBL 1.1 machine in simulated time: bytes in, bytes out, moves, laser, alarms.

Behaviour follows Grbl 1.1h as measured on running firmware: ``ok`` of a move means planned, ``ok`` of ``M5``
or ``G4`` means executed, M4 light scales with speed and is off at rest, M3 light stays on at rest, with
``$32=0`` the light stays on always, ``!`` darkens, 0x18 in motion alarms, a limit mutes it until 0x18.
Feed, rapid and power overrides act at once; the spindle stop (0x9E) and coolant toggles are ignored.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from rigs.emulator.beam import beam_share, rest_level
from rigs.emulator.config import MachineConfig
from rigs.emulator.dollar import dollar_line
from rigs.emulator.faults import Fault
from rigs.emulator.gcode_words import GrblError, clean_line
from rigs.emulator.motion import Motion
from rigs.emulator.outside import OVERRIDES, turn_override
from rigs.emulator.parser import Modal, Wait, apply_line
from rigs.emulator.report import status_report
from rigs.emulator.trace import Trace

__all__ = ["GrblMachine"]

_REALTIME = frozenset(b"?!~\x18\x84") | frozenset(OVERRIDES)
_EPS = 1e-9


@dataclass
class GrblMachine:
    """The machine; the owner feeds bytes, moves the clock and takes the answers.

    Attributes:
        config: what it pretends to be.
        trace: where moves and light are written.
        faults: what goes wrong and when, by the number of the received line.
        timed: what goes wrong at a simulated second, in order.
        now: simulated time, s.
        out: answers not yet sent.
        dropped: True when a fault cut the link; the server closes the connection.
    """

    config: MachineConfig
    trace: Trace
    faults: dict[int, Fault] = field(default_factory=dict)
    timed: tuple[Fault, ...] = ()
    now: float = 0.0
    out: bytearray = field(default_factory=bytearray)
    dropped: bool = False

    def __post_init__(self) -> None:
        """Switch the machine on."""
        self.settings = dict(self.config.settings)
        self.wco = list(self.config.g54)
        self.lines_seen = 0
        self.mute = False
        self.door_open = False
        self.feed_percent = self.rapid_percent = self.power_percent = 100.0
        self.shift = [0.0] * len(self.config.axes)  # where the axes really are, less what MPos says
        self._timed = list(self.timed)
        self.power_up()

    # -- life ---------------------------------------------------------------------------------------------

    def power_up(self) -> None:
        """Start as after switching on: position zero, locked when homing is enabled."""
        self.motion = Motion((0.0,) * len(self.config.axes), self.settings.get(11, 0.01))
        self.state = "Alarm" if self.settings.get(22) else "Idle"
        self._restart()

    def power_cycle(self) -> None:
        """Lose power and get it back: the axes stay where they are, the controller believes to be at zero."""
        self.motion.abort(self.now)
        self.drain()
        self.shift = [s + p for s, p in zip(self.shift, self.motion.position, strict=True)]
        self.power_up()

    def _restart(self) -> None:
        self.modal = Modal(len(self.config.axes))
        self.rx = bytearray()
        self.task: Iterator[Wait] | None = None
        self.wait: Wait | None = None
        self.wake: float | None = None
        self.dwell_left: float | None = None  # of a dwell that a hold interrupted
        self.check = False
        self.reset_after_line = False
        self.mute = False
        self.reports = 0
        self.restored: float | None = None
        self.feed_percent = self.rapid_percent = self.power_percent = 100.0
        self.light()
        self.say("")
        self.say(self.config.banner)
        if self.state == "Alarm":
            self.say("[MSG:'$H'|'$X' to unlock]")

    def reset(self) -> None:
        """Soft reset (0x18): light off; in motion the position is no longer trusted (ALARM:3)."""
        moving = self.motion.moving and self.state != "Alarm"
        self.motion.abort(self.now)
        self.drain()
        if moving or self.state == "Home":
            self.say("ALARM:6" if self.state == "Home" else "ALARM:3")
            self.state = "Alarm"
        elif self.state != "Alarm":
            self.state = "Idle"
        self._restart()

    def alarm(self, code: int) -> None:
        """Stop at once with an alarm; after 1 and 2 nothing is answered until 0x18."""
        self.motion.abort(self.now)
        self.drain()
        self.state = "Alarm"
        self.say(f"ALARM:{code}")
        self.task = self.wait = self.wake = None
        self.light()
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
            self.hold("Hold")
        elif byte == 0x84:
            self.hold("Door")
        elif byte in OVERRIDES:
            turn_override(self, byte)
        elif byte == ord("~"):
            self._cycle_start()

    def _cycle_start(self) -> None:
        """``~``: go on after a hold; refused while the lid stands open."""
        if self.state not in ("Hold", "Door") or self.motion.moving or self.restored is not None:
            return
        if self.state == "Door":
            if self.door_open:
                return
            if self.config.door_restore_s > 0.0:
                self.restored = self.now + self.config.door_restore_s
                return
        self._go_on()

    def _go_on(self) -> None:
        self.restored = None
        self.motion.resume(self.now)
        if self.dwell_left is not None:
            self.wake, self.dwell_left = self.now + self.dwell_left, None
        self.state = "Idle"
        self.light()

    def hold(self, state: str) -> None:
        """Slow down to a stand without light: ``Hold`` or ``Door``."""
        if self.state in ("Idle", "Hold", "Door"):
            state = "Door" if self.state == "Door" else state  # '!' does not end a door
            self.motion.hold(self.now)
            self.drain()
            self.state = state
            if self.wake is not None:
                self.dwell_left, self.wake = max(self.wake - self.now, 0.0), None
            self.light()

    # -- time ---------------------------------------------------------------------------------------------

    def next_event(self) -> float | None:
        """Simulated time of the next thing that happens by itself, or None."""
        fault = self._timed[0].at_s if self._timed else None
        known = (self.motion.next_event(), self.motion.trips_at(), self.wake, self.restored, fault)
        times = [max(t, self.now) for t in known if t is not None]
        return min(times) if times else None

    def advance(self, to: float) -> None:
        """Move the clock; everything up to then happens in order."""
        while (event := self.next_event()) is not None and event <= to:
            self._step_to(event)
        self._step_to(to)

    def _step_to(self, t: float) -> None:
        self.now = max(self.now, t)
        while self._timed and self._timed[0].at_s <= self.now:
            self._timed.pop(0).strike(self)
        trip = self.motion.trips_at()
        if trip is not None and trip <= self.now + _EPS:
            self.alarm(1)
        self.motion.advance(self.now)
        if self.restored is not None and self.now >= self.restored - _EPS:
            self._go_on()
        self.drain()
        self.light()
        self.pump()

    def drain(self) -> None:
        """Write what was moved to the trace."""
        for start, end, segment in self.motion.finished:
            beam = beam_share(segment, laser_mode=bool(self.settings.get(32)))
            self.trace.move(start, end, segment, beam, self.power(segment.s), self.shift)
        self.motion.finished.clear()

    def light(self) -> None:
        """Note the light at standstill."""
        self.trace.rest(self.now, rest_level(self))

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
        if self.state in ("Hold", "Door"):
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
            if self.state == "Alarm" and line:
                return  # this line raised an alarm: it is never answered
        if fault is not None and fault.after(self):
            return
        self.say("ok")
        if self.reset_after_line:
            self.reset()

    def power(self, s: float) -> float:
        """S of the light for a power word: with the override, clipped at full scale without a word."""
        return min(s * self.power_percent / 100.0, self.settings.get(30, 1000.0))

    # -- reports ------------------------------------------------------------------------------------------

    def status(self) -> str:
        """The answer to ``?``."""
        return status_report(self)
