"""An emulated machine on the bench: bytes in, answers out, the light and the place at any instant."""

from __future__ import annotations

import json

from rigs.emulator.beam import level_now, pwm_value
from rigs.emulator.config import config_for
from rigs.emulator.faults import read_faults, timed_faults
from rigs.emulator.machine import GrblMachine
from rigs.emulator.trace import Trace
from rigs.rig import load_rig

BYTE_S = 10.0 / 115200.0


class Tape:
    """A trace file in memory."""

    def __init__(self) -> None:
        self.records: list[dict[str, object]] = []

    def write(self, text: str) -> None:
        self.records.append(json.loads(text))

    def close(self) -> None:
        """Nothing to close."""


class Bench:
    """A machine on the bench, unlocked, with its answers as text."""

    def __init__(self, rig: str = "grbl-4axis", faults: tuple[str, ...] = (), **settings: float) -> None:
        self.tape = Tape()
        config = config_for(load_rig(rig)).with_settings({int(k[1:]): v for k, v in settings.items()})
        trace = Trace(self.tape)  # type: ignore[arg-type]
        self.machine = GrblMachine(config, trace, read_faults(faults), timed_faults(faults))
        self.machine.advance(0.0)
        self.machine.state = "Idle"
        self.machine.out.clear()

    def say(self, data: bytes | str, seconds: float = 0.0) -> list[str]:
        self.machine.receive(data if isinstance(data, bytes) else data.encode("ascii"))
        return self.later(seconds)

    def type(self, data: str) -> list[str]:
        """The same at the pace of a 115200 baud line."""
        for byte in data.encode("ascii"):
            self.machine.receive(bytes([byte]))
            self.machine.advance(self.machine.now + BYTE_S)
        return self.later(0.0)

    def later(self, seconds: float) -> list[str]:
        self.machine.advance(self.machine.now + seconds)
        text = self.machine.out.decode("ascii")
        self.machine.out.clear()
        return text.split("\r\n")[:-1]

    def status(self) -> str:
        return self.say(b"?")[-1]

    def light(self) -> float:
        """Power word of the light at this instant, moves included."""
        return level_now(self.machine)

    def pwm(self) -> int:
        return pwm_value(self.light(), self.machine.settings[30], self.machine.settings[31])

    def x(self) -> float:
        return self.machine.motion.state(self.machine.now)[0][0]
