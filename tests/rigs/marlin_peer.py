"""A small Marlin in a thread: line numbers, checksums, ``Resend``, ``busy``; it notes what it executed."""

from __future__ import annotations

import functools
import operator
import random
import re
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

INFO = (
    "FIRMWARE_NAME:Marlin 2.1.2.4 (Jan 1 2024) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin "
    "PROTOCOL_VERSION:1.0 MACHINE_TYPE:Laser UUID:0\nCap:SERIAL_XON_XOFF:0\nCap:EMERGENCY_PARSER:1\nok\n"
)
SETTINGS = (
    "echo:; Steps per unit:\necho:  M92 X80.00 Y80.00 Z400.00 A88.89\n"
    "echo:; Max feedrates (units/s):\necho:  M203 X200.00 Y200.00 Z20.00 A60.00\n"
    "echo:; Max Acceleration (units/s2):\necho:  M201 X2000.00 Y2000.00 Z200.00 A360.00\nok\n"
)


@dataclass
class Marlin:
    """The machine.

    Attributes:
        damage: share of the received lines in which a byte is changed.
        done: lines that were executed, without numbers.
        raw: bytes received.
        at_line: called with each executed line; may raise to cut the link.
    """

    damage: float = 0.0
    seed: int = 0
    info: str = INFO
    done: list[str] = field(default_factory=list)
    raw: bytearray = field(default_factory=bytearray)
    at_line: Callable[[str], None] | None = None
    last: int = 0
    asked_again: int = 0
    halted: bool = False

    def __post_init__(self) -> None:
        self.place = dict.fromkeys("XYZA", 0.0)
        self.rng = random.Random(self.seed)  # noqa: S311

    def answers(self, data: bytes) -> str:
        """Take a chunk of bytes; what it says. After an error the rest of the chunk is flushed."""
        out = ""
        for raw in data.decode("ascii").splitlines():
            line = raw.strip()
            if not line:
                continue
            if line == "M112":
                self.halted = True
                return out + "Error:Printer halted. kill() called!\n"
            if self.halted:
                continue
            if self.rng.random() < self.damage:
                place = self.rng.randrange(len(line))
                line = line[:place] + chr(ord(line[place]) ^ 1) + line[place + 1 :]
            numbered = re.fullmatch(r"N(-?\d+) (.*)\*(\d+)", line)
            if line.startswith("N") or self.last:
                problem = self._problem(line, numbered)
                if problem:
                    self.asked_again += 1
                    return out + f"Error:{problem}, Last Line: {self.last}\nResend: {self.last + 1}\nok\n"
            if numbered:
                self.last = int(numbered[1])
                line = numbered[2]
            out += self._execute(line)
        return out

    def _problem(self, line: str, numbered: re.Match[str] | None) -> str:
        if numbered is None:
            return "No Line Number with checksum" if "*" in line else "No Checksum with line number"
        body = line[: line.rindex("*")].encode()
        if functools.reduce(operator.xor, body) != int(numbered[3]):
            return "checksum mismatch"
        if int(numbered[1]) != self.last + 1 and "M110" not in numbered[2]:
            return "Line Number is not Last Line Number+1"
        return ""

    def _execute(self, line: str) -> str:
        if self.at_line is not None:
            self.at_line(line)
        code = line.split()[0]
        if code == "M110":
            return "ok\n"
        if code == "M114":
            at = " ".join(f"{k}:{v:.2f}" for k, v in self.place.items())
            return f"{at} E:0.00 Count X:0 Y:0 Z:0\nok\n"
        if code == "M115":
            return self.info
        if code == "M503":
            return SETTINGS
        self.done.append(line)
        if code in ("G0", "G1"):
            self.place.update({w[0]: float(w[1:]) for w in line.split()[1:] if w[0] in self.place})
        if code == "G28":
            self.place = dict.fromkeys("XYZA", 0.0)
        if code == "G4":
            return "echo:busy: processing\nok\n"
        if code not in ("G0", "G1", "G21", "G90", "G28", "M4", "M5"):
            return f'echo:Unknown command: "{line}"\nok\n'
        return "ok\n"


@contextmanager
def serve(marlin: Marlin) -> Iterator[str]:
    """The machine on a loopback socket; its URL."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def run() -> None:
            client, _ = listener.accept()
            with client:
                client.sendall(b"start\necho:Marlin 2.1.2.4\n\xc2\x80\nwait\n")
                while data := client.recv(4096):
                    marlin.raw.extend(data)
                    try:
                        client.sendall(marlin.answers(data).encode("ascii"))
                    except ConnectionAbortedError:
                        return

        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        yield f"socket://127.0.0.1:{listener.getsockname()[1]}"
        thread.join(timeout=10.0)
