"""Measuring the angle of a crease: one interface, typed in or read from a gauge on a serial port."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

from rigs.errors import JobError, MachineError
from rigs.gauge_words import read_angle

__all__ = ["Measure", "SerialGauge", "TypedGauge"]

_READINGS, _RESTLESS_DEG, _LONGEST = 5, 2.0, 256
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
    """A gauge on a serial port, such as a digital protractor with a cable.

    One that is asked gets ``M<crease>`` and answers with a line; one that streams prints lines by itself, of
    which the next few whole ones are taken. What a line may look like: ``rigs.gauge_words``. A gauge that
    measures without sign gets that of the fold.

    Args:
        url: port, such as ``/dev/ttyUSB1`` or ``socket://127.0.0.1:5000``.
        baud: of a serial port.
        timeout_s: longest time for an answer.
        sigma_deg: where the gauge does not say, and the least where it streams.
        streams: the gauge prints by itself.

    Raises:
        MachineError: if the port does not open.
    """

    def __init__(
        self,
        url: str,
        *,
        baud: int = 115200,
        timeout_s: float = 5.0,
        sigma_deg: float = 0.3,
        streams: bool = False,
    ) -> None:
        import serial

        self.url, self.timeout_s, self.sigma_deg, self.streams = url, timeout_s, sigma_deg, streams
        try:
            self._port = serial.serial_for_url(url, baudrate=baud, timeout=0.2, write_timeout=2.0)
        except (OSError, ValueError) as error:
            raise MachineError(f"{url}: cannot open the gauge: {error}") from error

    def __call__(self, crease: int, expected_deg: float) -> tuple[float, float]:
        """Read the gauge.

        Raises:
            MachineError: if the port vanished.
            JobError: if it says nothing that is an angle in time, or its readings do not rest.
        """
        angle, sigma = self.reading(f"M{crease}", f"crease {crease}")
        return angle if angle < 0.0 else math.copysign(angle, expected_deg), sigma

    def reading(self, question: str, what: str) -> tuple[float, float]:
        """One reading as the gauge gives it, with its standard deviation, degrees.

        Args:
            question: sent to a gauge that is asked.
            what: for messages, such as ``crease 7``.

        Raises:
            MachineError: if the port vanished.
            JobError: if it says nothing that is an angle in time, or its readings do not rest.
        """
        wanted = _READINGS if self.streams else 1
        readings: list[tuple[float, float]] = []
        last = b""
        for line in self._lines(question):
            last = line or last
            reading = read_angle(line)
            if reading is not None:
                readings.append((reading[0], reading[1] or self.sigma_deg))
            if len(readings) == wanted or (line.strip() and not self.streams):
                break
        if len(readings) < wanted:
            said = f"said {last[:40].decode('ascii', 'replace')!a}" if last else "said nothing"
            raise JobError(f"{self.url}: the gauge {said} for {what}: expected degrees")
        angles = sorted(a for a, _ in readings)
        angle, spread = angles[len(angles) // 2], angles[-1] - angles[0]
        sigma = max(max(s for _, s in readings), 0.5 * spread)
        if spread > _RESTLESS_DEG:
            raise JobError(
                f"{self.url}: the gauge says {angles[0]:.1f}° to {angles[-1]:.1f}° for {what}: "
                "wait until it rests"
            )
        return angle, sigma

    def _lines(self, question: str) -> Iterator[bytes]:
        """Whole lines until the time is over; of a stream the first one may be cut and does not count."""
        deadline = time.monotonic() + self.timeout_s
        buffer = b""
        cut = self.streams
        try:
            self._port.reset_input_buffer()
            if not self.streams:
                self._port.write(f"{question}\n".encode())
            while time.monotonic() < deadline:
                buffer += self._port.read(max(1, min(int(self._port.in_waiting), 256)))
                while b"\n" in buffer or b"\r" in buffer:
                    line, _, buffer = buffer.replace(b"\r", b"\n").partition(b"\n")
                    if not cut and line.strip():
                        yield line
                    cut = False
                if len(buffer) > _LONGEST:
                    break
        except (OSError, ValueError) as error:
            raise MachineError(f"{self.url}: the gauge vanished: {error}") from error
        if buffer.strip() and not self.streams:
            yield buffer[:_LONGEST]

    def close(self) -> None:
        """Close the port."""
        self._port.close()
