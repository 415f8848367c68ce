"""Controllers that are not quite GRBL: scripted peers on a socket."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rigs.errors import MachineError
from rigs.probe import probe
from rigs.replay import is_emulated, replay
from tests.rigs.replay_jobs import RIG, small_job

STATUS = b"<Idle|MPos:0.000,0.000,0.000,0.000|FS:0,0|WCO:-400.000,-300.000,-240.000,0.000>\r\n"
SETTINGS = "".join(f"{key}={value:g}\r\n" for key, value in RIG.controller.expect.items()).encode()
GOOD = {
    b"?": STATUS,
    b"$I\n": b"[VER:1.1f:]\r\n[AXS:4:XYZA]\r\nok\r\n",
    b"$$\n": SETTINGS + b"ok\r\n",
    b"$#\n": b"[G54:-400.000,-300.000,-240.000,0.000]\r\nok\r\n",
    b"$G\n": b"[GC:G0 G54]\r\nok\r\n",
}


@contextmanager
def peer(answer: Callable[[bytes], bytes], greeting: bytes = b"") -> Iterator[tuple[str, bytearray]]:
    """A peer that answers each chunk it gets; the URL and what it heard."""
    heard = bytearray()
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def talk() -> None:
            client, _ = listener.accept()
            with client:
                client.sendall(greeting)
                while data := client.recv(4096):
                    heard.extend(data)
                    client.sendall(b"".join(answer(part) for part in _parts(data)))

        def run() -> None:
            try:
                talk()
            except OSError:
                return

        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield f"socket://127.0.0.1:{listener.getsockname()[1]}", heard
        finally:
            thread.join(timeout=10)


def _parts(data: bytes) -> Iterator[bytes]:
    for line in data.replace(b"?", b"?\0").replace(b"\n", b"\n\0").split(b"\0"):
        if line:
            yield line


def test_greetings_odd_bytes_and_split_answers_are_tolerated() -> None:
    greeting = b"\r\nGrbl 1.1f [\xe2\x80\x98$\xe2\x80\x99 for help]\r\nok\r\nok\r\n[MSG:hi]\r\n"
    with peer(lambda part: GOOD.get(part, b""), greeting) as (url, heard):
        found = probe(url, RIG)
    assert found.mistakes == ()
    assert not found.identity.emulated
    assert bytes(heard).replace(b"?", b"") == b"$I\n$$\n$#\n$G\n"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({b"$I\n": b"ok\r\n"}, "does not say what it is"),
        ({b"$$\n": b"ok\r\n"}, r"setting \$13 of the controller is missing"),
        ({b"$$\n": b"error:8\r\n"}, "error:8: only possible when the machine is idle"),
        ({b"$#\n": b"[G54:x]\r\nok\r\n"}, "has 0 axes"),
        ({b"$#\n": b"[G54:0,0,0,0]\r\nok\r\n"}, "work offset G54"),
        ({b"?": STATUS.replace(b"Idle", b"Run")}, "the machine is busy"),
        ({b"?": STATUS.replace(b"Idle", b"Door:1")}, "reset it by hand"),
        ({b"?": b"T:20.0 /0.0\r\n"}, "nothing answers"),
        ({b"$G\n": b"echo:unknown command\r\n"}, "not understood"),
    ],
)
def test_what_is_wrong_is_said_and_nothing_moves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changes: dict[bytes, bytes], words: str
) -> None:
    monkeypatch.setattr("rigs.controller._HELLO_S", 1.0)
    answers = GOOD | changes
    with peer(lambda part: answers.get(part, b"")) as (url, heard), pytest.raises(MachineError, match=words):
        replay(small_job(), url, rig=RIG, journal_path=tmp_path / "j", mode="arm")
    assert set(bytes(heard).replace(b"?", b"").split(b"\n")) <= {b"M5", b"$I", b"$$", b"$#", b"$G", b""}


def test_mark_of_the_emulator_does_not_count_over_the_network() -> None:
    marked = GOOD | {b"$I\n": b"[VER:1.1f:EMULATED]\r\n[AXS:4:XYZA]\r\nok\r\n"}
    with peer(lambda part: marked.get(part, b"ok\r\n" * part.count(b"\n"))) as (url, _):
        probed = probe(url, RIG)
        assert probed.identity.emulated
    assert is_emulated(probed.identity, "socket://127.0.0.1:99")
    assert not is_emulated(probed.identity, "socket://10.0.0.5:99")
    assert not is_emulated(probed.identity, "/dev/ttyUSB0")
