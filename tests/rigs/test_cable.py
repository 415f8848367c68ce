"""The bad cable: each harm does what it says, and a job over it ends dark or whole."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from rigs.cable import CableHarm, cable, read_cable
from rigs.emulator import start_emulator
from rigs.errors import MachineError, ProfileError
from rigs.journal import read_journal
from rigs.replay import replay
from tests.rigs.replay_jobs import RIG, small_job
from tests.rigs.replay_runs import STROKES, lit, read_trace


@contextlib.contextmanager
def echo() -> Iterator[str]:
    """A peer that sends back what it gets, one connection after another."""
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def talk() -> None:
            while True:
                try:
                    client, _ = listener.accept()
                except OSError:
                    return
                with client, contextlib.suppress(OSError):
                    while data := client.recv(4096):
                        client.sendall(data)

        threading.Thread(target=talk, daemon=True).start()
        yield f"socket://127.0.0.1:{listener.getsockname()[1]}"


def through(url: str, data: bytes, patience_s: float = 0.4) -> tuple[bytes, bool, float]:
    """What comes back, whether the connection ended, and when the first byte came."""
    parts = urlsplit(url)
    got, first = b"", 0.0
    with socket.create_connection((parts.hostname, parts.port)) as link:
        link.settimeout(patience_s)
        start = time.monotonic()
        link.sendall(data)
        while True:
            try:
                chunk = link.recv(4096)
            except TimeoutError:
                return got, False, first
            except ConnectionError:
                return got, True, first
            if not chunk:
                return got, True, first
            first = first or time.monotonic() - start
            got += chunk


@pytest.mark.parametrize(
    ("harms", "back"),
    [
        ([], b"0123456789"),
        (["drop@out3"], b"012456789"),
        (["drop@in3"], b"012456789"),
        (["double@out0", "double@in10"], b"00123456789" + b"9"),
        (["flip:1@in2"], b"0133456789"),
        (["add:65@out9"], b"0123456789A"),
        (["drop@out1", "flip:255@out200"], b"023456789"),
    ],
)
def test_bytes(harms, back):
    with echo() as peer, cable(peer, read_cable(harms)) as url:
        assert through(url, b"0123456789")[:2] == (back, False)


@pytest.mark.parametrize(("harm", "back"), [("cut@out4", b"0123"), ("cut@in4", b"0123"), ("cut@0s", b"")])
def test_a_cut_strikes_once(harm, back):
    with echo() as peer, cable(peer, read_cable([harm])) as url:
        got, ended, _ = through(url, b"0123456789")
        assert ended and back.startswith(got)
        assert through(url, b"abc")[:2] == (b"abc", False)


@pytest.mark.parametrize("harm", ["delay:0.3@out0", "delay:0.3@in0", "delay:0.15@0s"])
def test_a_delay_keeps_the_order(harm):
    with echo() as peer, cable(peer, read_cable([harm])) as url:
        got, ended, first = through(url, b"0123456789", 0.9)
        assert (got, ended) == (b"0123456789", False)
        assert first >= 0.29


def test_a_script(tmp_path):
    script = tmp_path / "bad.txt"
    script.write_text("# two harms\ncut@out300   # first\n\ndelay:0.5@2.5s\n")
    assert read_cable([str(script), "drop@in1"]) == (
        CableHarm("cut", way="out", at=300), CableHarm("delay", 0.5, at_s=2.5),
        CableHarm("drop", way="in", at=1),
    )  # fmt: skip


@pytest.mark.parametrize(
    "text",
    ["cut", "cut@", "cut:3@out1", "drop@2s", "flip@in3", "flip:0@in3", "flip:256@in3", "flip:1.5@in3",
     "delay@in0", "delay:90@in0", "bend@in3", "cut@out-3", "none.txt"],
)  # fmt: skip
def test_what_is_no_harm(text):
    with pytest.raises(ProfileError, match="cable"):
        read_cable([text])


def test_a_mistake_in_a_script_names_its_line(tmp_path):
    script = tmp_path / "bad.txt"
    script.write_text("cut@out300\nflip@in3\n")
    with pytest.raises(ProfileError, match=r"bad\.txt, line 2: 'flip@in3'"):
        read_cable([str(script)])


@pytest.mark.parametrize("url", ["socket://192.0.2.1:23", "/dev/ttyUSB0", "socket://127.0.0.1"])
def test_it_never_leads_to_a_real_machine(url):
    with pytest.raises(MachineError, match="never to a real machine"), cable(url, ()):
        pass


@pytest.mark.parametrize("at", [150, 200, 240, 251, 263, 275])
def test_a_job_over_a_cable_that_is_cut_ends_dark(tmp_path, at):
    path = tmp_path / "j"
    with (
        start_emulator(trace=tmp_path / "trace") as machine,
        cable(machine.url, read_cable([f"cut@out{at}"])) as url,
    ):
        with pytest.raises(MachineError):
            replay(small_job(), url, rig=RIG, journal_path=path, mode="arm")
        time.sleep(0.3)
    trace = read_trace(tmp_path / "trace")
    assert trace[-1]["rest_beam_s"] == 0.0
    assert lit(trace) == STROKES[: len(lit(trace))]
    assert read_journal(path).outcome == "fault"


def test_a_slow_cable_changes_nothing(tmp_path):
    harms = read_cable(["delay:0.02@out0", "delay:0.02@in0"])
    with start_emulator(trace=tmp_path / "trace") as machine, cable(machine.url, harms) as url:
        replay(small_job(), url, rig=RIG, journal_path=tmp_path / "j", mode="arm")
    assert lit(read_trace(tmp_path / "trace")) == STROKES
