"""A gauge on a loopback port that measures the part in the emulated machine."""

from __future__ import annotations

import contextlib
import math
import socket
import threading
from collections.abc import Iterator

from twin.traced_part import TracedPart

__all__ = ["gauge_port"]

_LONGEST = 64


@contextlib.contextmanager
def gauge_port(traced: TracedPart, sigma_deg: float = 0.2) -> Iterator[str]:
    """Serve a gauge while the block runs.

    ``M<crease>`` is answered with the fold angle of the crease and its standard deviation, ``A`` with the
    angle at which the rotary really stands, degrees; anything else with ``ERR``.

    Args:
        traced: the part.
        sigma_deg: what the gauge says of itself.

    Yields:
        its URL.
    """
    server = socket.create_server(("127.0.0.1", 0))
    links: list[socket.socket] = []

    def serve() -> None:
        with contextlib.suppress(OSError):
            while True:
                link, _ = server.accept()
                links.append(link)
                _answer(link, traced, sigma_deg)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    try:
        yield f"socket://127.0.0.1:{server.getsockname()[1]}"
    finally:
        for end in (server, *links):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()
        thread.join(5.0)


def _answer(link: socket.socket, traced: TracedPart, sigma_deg: float) -> None:
    buffer = b""
    while data := link.recv(256):
        buffer += data
        while b"\n" in buffer:
            line, _, buffer = buffer.partition(b"\n")
            link.sendall(_words(line.strip().decode("ascii", "replace"), traced, sigma_deg).encode("ascii"))
        if len(buffer) > _LONGEST:
            buffer = b""


def _words(question: str, traced: TracedPart, sigma_deg: float) -> str:
    part = traced.update()
    if question == "A":
        return f"{math.remainder(traced.rotary_deg, 360.0):.4f}\n"
    if question.startswith("M") and question[1:].isdecimal():
        angle = math.degrees(part.angles_rad.get(int(question[1:]), 0.0))
        return f"{math.remainder(angle, 360.0):.4f} {sigma_deg:g}\n"
    return "ERR\n"
