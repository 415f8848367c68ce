"""T18: a peer that never reads: a write that waits is given up, a stop passes it where the port allows."""

from __future__ import annotations

import contextlib
import os
import socket
import threading
import time
from collections.abc import Iterator

import pytest

from rigs.controller import Controller
from rigs.errors import MachineError
from rigs.link import Link, open_link
from tests.rigs.replay_jobs import RIG

HANGS_S = 2.0
"""No call may last longer (a hang, not a measure of speed)."""


@contextlib.contextmanager
def deaf_socket() -> Iterator[tuple[Link, socket.socket]]:
    """A link to a peer that accepts and never reads."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        link = open_link(f"socket://127.0.0.1:{listener.getsockname()[1]}", RIG)
        peer, _ = listener.accept()
        with peer:
            yield link, peer
            link.close()


@contextlib.contextmanager
def deaf_terminal() -> Iterator[tuple[Link, int]]:
    """A link to a pseudo-terminal that nobody reads."""
    import tty

    ours, theirs = os.openpty()
    tty.setraw(theirs)
    link = open_link(os.ttyname(theirs), RIG)
    os.close(theirs)
    yield link, ours
    link.close()
    os.close(ours)


def fill(link: Link) -> int:
    """Write until the port takes no more; how many bytes it took."""
    fd = link._port.fileno()
    count, before = 0, -1
    while count > before:  # a terminal passes bytes on a little later
        before = count
        for chunk in (b"G" * 512, b"G"):
            with contextlib.suppress(BlockingIOError):
                while True:
                    count += os.write(fd, chunk)
        time.sleep(0.05)
    return count


@pytest.mark.parametrize("port", [deaf_socket, deaf_terminal])
def test_a_blocked_write_is_given_up_in_words(port):
    with port() as (link, _):
        assert fill(link) > 1000
        start = time.monotonic()
        with pytest.raises(MachineError, match="takes no bytes any more: 20 were not sent"):
            link.write(b"M4S0\nG1X1F600S5\nM5\n!")
        assert time.monotonic() - start < HANGS_S


@pytest.mark.parametrize("port", [deaf_socket, deaf_terminal])
def test_another_thread_stops_a_blocked_write(port):
    with port() as (link, _):
        fill(link)
        stop = threading.Event()
        link.interrupted = stop.is_set
        threading.Timer(0.1, stop.set).start()
        with pytest.raises(MachineError, match="stopped on request"):
            link.write(b"G1X1\n")


def test_the_stop_passes_what_a_serial_port_holds_back():
    """What the system has not given away yet is dropped: hold and reset are next on the wire."""
    with deaf_terminal() as (link, ours):
        held_back = fill(link)
        link.urgent(b"!\x18")
        os.set_blocking(ours, False)
        got = b""
        with contextlib.suppress(BlockingIOError):
            while chunk := os.read(ours, 65536):
                got += chunk
        assert got.endswith(b"!\x18")
        assert len(got) < held_back / 2


@pytest.mark.parametrize("port", [deaf_socket, deaf_terminal])
def test_an_emergency_stop_ends_whatever_the_port_does(port):
    with port() as (link, _):
        fill(link)
        controller = Controller(link, RIG)
        controller.gate.level = "armed"
        start = time.monotonic()
        controller.emergency_stop()
        assert time.monotonic() - start < HANGS_S
        assert controller.gate.level == "quiet"


def test_the_stop_is_first_once_a_full_socket_drains():
    """A socket cannot take bytes back; what was given up is not sent later, the stop is."""
    with deaf_socket() as (link, peer):
        full = fill(link)
        with pytest.raises(MachineError):
            link.write(b"M4S0\n")
        got = bytearray()

        def drain() -> None:
            while chunk := peer.recv(65536):
                got.extend(chunk)

        reader = threading.Thread(target=drain)
        reader.start()
        link.urgent(b"!\x18")
        link.close()
        reader.join()
        assert len(got) == full + 2
        assert got.replace(b"G", b"") == b"!\x18"
