"""The port: opened exclusively, without resetting the board where that can be avoided, with bounded waits."""

from __future__ import annotations

import contextlib
import io
import os
import select
import socket
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

from rigs.errors import MachineError
from rigs.rig import Rig

__all__ = ["Link", "open_link"]

_LINE_LIMIT = 4096
_URGENT_S = 0.1
_WRITE_S = 1.0
_LOOK_S = 0.02


class Link:
    """Bytes to and from a controller; only ``rigs.gate.Gate`` writes to it.

    Attributes:
        url: where it is connected.
        interrupted: asked while a write waits for room; True gives it up.
    """

    def __init__(self, port: Any, url: str) -> None:  # noqa: ANN401  pyserial ports share no typed base
        self._port = port
        self.url = url
        self._buffer = bytearray()
        self.interrupted: Callable[[], bool] | None = None
        self._patience_s = _WRITE_S
        try:
            self._fd: int | None = port.fileno()
        except (AttributeError, OSError, io.UnsupportedOperation):
            self._fd = None

    def write(self, data: bytes) -> None:
        """Write all bytes.

        Raises:
            MachineError: if the port fails, takes no bytes for a second, or the wait is interrupted.
        """
        try:
            if self._fd is None:
                self._port.write(data)
            else:
                self._write(self._fd, data)
        except MachineError:
            raise
        except (OSError, ValueError, AttributeError) as error:
            raise MachineError(f"{self.url}: the port vanished while writing: {error}") from error

    def _write(self, fd: int, data: bytes) -> None:
        """Write as the port takes it; a full one must not stop anybody from stopping."""
        deadline = time.monotonic() + self._patience_s
        while data:
            if select.select([], [fd], [], _LOOK_S)[1]:
                with contextlib.suppress(BlockingIOError):
                    data = data[os.write(fd, data) :]
                    continue
            if self.interrupted is not None and self.interrupted():
                raise MachineError(f"{self.url}: stopped on request, while the port took no bytes")
            if time.monotonic() > deadline:
                raise MachineError(
                    f"{self.url}: the port takes no bytes any more: {len(data)} were not sent; "
                    "does the other end still read?"
                )

    def urgent(self, data: bytes) -> None:
        """Write past everything that waits to be sent: what the system still holds back is dropped.

        A socket cannot take bytes back; where it is full, the bytes are tried for a tenth of a second.

        Raises:
            MachineError: if the port fails.
        """
        with contextlib.suppress(Exception):
            self._port.reset_output_buffer()
        with contextlib.suppress(Exception):
            self._port.write_timeout = _URGENT_S
        self._patience_s, self.interrupted = _URGENT_S, None
        self.write(data)

    def read_line(self, timeout_s: float) -> bytes | None:
        """The next line without its end, or None when none came in time.

        Raises:
            MachineError: if the port vanished, or sends an endless line.
        """
        deadline = time.monotonic() + timeout_s
        while True:
            end = self._buffer.find(b"\n")
            if end >= 0:
                line = bytes(self._buffer[:end])
                del self._buffer[: end + 1]
                return line
            if len(self._buffer) > _LINE_LIMIT:
                raise MachineError(
                    f"{self.url}: {_LINE_LIMIT} bytes without a line end: wrong baud rate or device?"
                )
            left = deadline - time.monotonic()
            if left < 0.0:
                return None
            self._buffer += self._read(left)

    def _read(self, timeout_s: float) -> bytes:
        try:
            if self._fd is not None:
                ready, _, _ = select.select([self._fd], [], [], timeout_s)
                return bytes(self._port.read(_LINE_LIMIT)) if ready else b""
            self._port.timeout = timeout_s
            first: bytes = self._port.read(1)
            return first + self._port.read(self._port.in_waiting) if first else b""
        except (OSError, ValueError, TypeError, AttributeError) as error:
            raise MachineError(f"{self.url}: the port vanished: {error}") from error

    def drain(self) -> None:
        """Forget what has been received."""
        self._buffer.clear()
        while self._read(0.0):
            pass

    def close(self) -> None:
        """Close the port; errors while closing do not matter."""
        with contextlib.suppress(Exception):
            sock = getattr(self._port, "_socket", None)
            if isinstance(sock, socket.socket):
                # pyserial sleeps 0.3 s after closing a socket: close it here
                self._port.is_open = False
                sock.close()
            else:
                self._port.close()


def open_link(url: str, rig: Rig) -> Link:
    """Open a port: ``/dev/tty…``, ``COM3``, ``socket://host:port`` or ``rfc2217://host:port``.

    Raises:
        MachineError: if it does not open; the message says what to look at.
    """
    import serial

    _check_url(url)
    try:
        port = serial.serial_for_url(url, do_not_open=True, baudrate=rig.controller.baud)
        port.timeout = 0
        port.write_timeout = _WRITE_S
        if "://" not in url:
            port.dtr = False  # before opening: a raised DTR resets the board, a pseudo-terminal has none
            port.rts = False
            port.exclusive = True
        port.open()
    except (OSError, ValueError) as error:
        cure = (
            "is it switched on, free, and are host and port right?"
            if "://" in url
            else ("is it plugged in, free and spelt right?")
        )
        raise MachineError(f"{url}: cannot open the port: {_reason(error)}: {cure}") from error
    sock = getattr(port, "_socket", None)
    if isinstance(sock, socket.socket):
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return Link(port, url)


def _check_url(url: str) -> None:
    """Refuse what pyserial would answer with a riddle."""
    scheme, mark, _ = url.partition("://")
    if not url.strip():
        raise MachineError("no port is named: expected /dev/ttyUSB0, COM3 or socket://HOST:PORT")
    if mark and scheme.lower() in ("socket", "rfc2217"):
        try:
            parts = urlsplit(url)
            complete = bool(parts.hostname) and parts.port is not None
        except ValueError:
            complete = False
        if not complete:
            raise MachineError(
                f"{url}: cannot open the port: expected {scheme}://HOST:PORT, PORT up to 65535"
            )


def _reason(error: BaseException) -> str:
    """What the system said: pyserial repeats the name of the port around it."""
    inner: BaseException | None = error
    while inner is not None:
        if isinstance(inner, OSError) and inner.strerror and "open port" not in inner.strerror:
            return inner.strerror
        inner = inner.__context__
    return str(error)
