"""Measuring the angle of a crease: one interface, typed in or read from a gauge on a serial port."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from rigs.errors import JobError, MachineError

__all__ = ["Measure", "SerialGauge", "TypedGauge"]

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


class Measure(Protocol):
    """Something that measures fold angles."""

    def __call__(self, crease: int, expected_deg: float) -> tuple[float, float]:
        """Fold angle of a crease in degrees, with the sign of the fold, and its standard deviation.

        Raises:
            JobError: if no figure can be had.
        """


@dataclass(frozen=True)
class TypedGauge:
    """A person reads a gauge and types the angle.

    Attributes:
        ask: shows a question and returns what was typed.
        sigma_deg: of a reading.
        tries: how often a figure that makes no sense is asked for again.
    """

    ask: Callable[[str], str]
    sigma_deg: float = 0.5
    tries: int = 3

    def __call__(self, crease: int, expected_deg: float) -> tuple[float, float]:
        """Ask for the angle; a reading without sign gets that of the fold."""
        for _ in range(self.tries):
            text = self.ask(f"angle of crease {crease} in degrees (expected {expected_deg:.1f}): ").strip()
            match = _NUMBER.fullmatch(text.replace(",", "."))
            if match and abs(float(match[0])) <= 180.0:
                angle = float(match[0])
                if text[:1] not in "+-":
                    angle = math.copysign(angle, expected_deg)
                return angle, self.sigma_deg
        raise JobError(f"no angle of crease {crease} was given: measure it, then resume")


class SerialGauge:
    """A gauge on a serial port: ``M<crease>`` asks, a line with one or two numbers answers: degrees, sigma.

    An answer may have words around the numbers (``ANGLE 44.8 0.2``). A gauge that measures without sign
    gets that of
    the fold.

    Args:
        url: port, such as ``/dev/ttyUSB1`` or ``socket://127.0.0.1:5000``.
        baud: of a serial port.
        timeout_s: longest time for an answer.
        sigma_deg: where the gauge does not say.

    Raises:
        MachineError: if the port does not open.
    """

    def __init__(
        self, url: str, *, baud: int = 115200, timeout_s: float = 5.0, sigma_deg: float = 0.3
    ) -> None:
        import serial

        self.url, self.timeout_s, self.sigma_deg = url, timeout_s, sigma_deg
        try:
            self._port = serial.serial_for_url(url, baudrate=baud, timeout=0.2, write_timeout=2.0)
        except (OSError, ValueError) as error:
            raise MachineError(f"{url}: cannot open the gauge: {error}") from error

    def __call__(self, crease: int, expected_deg: float) -> tuple[float, float]:
        """Ask the gauge.

        Raises:
            MachineError: if the port vanished.
            JobError: if it answers nothing that is an angle in time.
        """
        deadline = time.monotonic() + self.timeout_s
        seen = b""
        try:
            self._port.reset_input_buffer()
            self._port.write(f"M{crease}\n".encode())
            while time.monotonic() < deadline and len(seen) < 4096:
                seen += self._port.read(64)
                if b"\n" in seen:
                    break
        except (OSError, ValueError) as error:
            raise MachineError(f"{self.url}: the gauge vanished: {error}") from error
        line = seen.partition(b"\n")[0].decode("ascii", "replace")
        numbers = [float(n) for n in _NUMBER.findall(line)]
        if not numbers or abs(numbers[0]) > 180.0:
            raise JobError(
                f"{self.url}: the gauge answered {line[:40]!a} for crease {crease}: expected degrees"
            )
        sigma = numbers[1] if len(numbers) > 1 and numbers[1] > 0.0 else self.sigma_deg
        angle = numbers[0] if numbers[0] < 0.0 else math.copysign(numbers[0], expected_deg)
        return angle, sigma

    def close(self) -> None:
        """Close the port."""
        self._port.close()
