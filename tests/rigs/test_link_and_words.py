"""Bytes and words: answers in any shape, ports of each kind."""

from __future__ import annotations

import os
import socket
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.errors import MachineError
from rigs.grbl import alarm_text, error_text, read_answer, read_status
from rigs.link import open_link
from tests.rigs.replay_jobs import RIG


@given(st.binary(max_size=60))
def test_any_bytes_are_sorted_without_failing(data: bytes) -> None:
    answer = read_answer(data)
    if answer.kind == "status":
        read_status(answer.text)
    assert (answer.kind == "ok") == (data.decode("utf-8", "replace").strip() == "ok")


@pytest.mark.parametrize(
    ("line", "kind", "code"),
    [(b"ok\r", "ok", 0), (b"o", "other", 0), (b"okok", "other", 0), (b"error:20\r", "error", 20),
     (b"error:x", "error", 0), (b"ALARM:171", "alarm", 171), (b"Grbl 1.1h ['$' for help]", "banner", 0),
     (b"GrblHAL 1.1f", "banner", 0), (b"[MSG:Caution]", "message", 0), (b"$32=1", "setting", 0),
     (b"\r", "empty", 0), (b"\xe2\x80\x99", "other", 0)],
)  # fmt: skip
def test_answers(line: bytes, kind: str, code: int) -> None:
    answer = read_answer(line)
    assert (answer.kind, answer.code) == (kind, code)


def test_status_reports_of_several_firmwares() -> None:
    status = read_status(
        "<Hold:1|MPos:1.000,-2.500,0.000,90.000|Bf:35,254|FS:600,500|WCO:0.000,0.000,0.000,0.000>"
    )
    assert status is not None
    assert (status.state, status.substate, status.machine) == ("Hold", 1, (1.0, -2.5, 0.0, 90.0))
    assert (status.speed, status.s, status.offset) == (600.0, 500.0, (0.0,) * 4)
    work = read_status("<Idle|WPos:1.000,2.000,3.000|F:0|Pn:XD|Ov:100,100,90|A:SF>")
    assert work is not None
    assert (work.work, work.overrides) == ((1.0, 2.0, 3.0), (100.0, 100.0, 90.0))
    for bad in ("<>", "<Idle>", "<Idle|MPos:1.0,x>", "<|MPos:1>", "<Idle|FS:1,2>"):
        assert read_status(bad) is None


def test_every_listed_number_has_words() -> None:
    assert "not supported" in error_text(20)
    assert "hard limit" in alarm_text(1)
    assert "not listed" in error_text(999)
    assert "not listed" in alarm_text(171)


def test_pseudo_terminal_is_opened_read_and_written() -> None:
    master, slave = os.openpty()
    link = open_link(os.ttyname(slave), RIG)
    try:
        link.write(b"$I\n")
        assert os.read(master, 100) == b"$I\n"
        os.write(master, b"o")
        assert link.read_line(0.05) is None
        os.write(master, b"k\r\n<Idle")
        assert link.read_line(2.0) == b"ok\r"
        assert link.read_line(0.0) is None
        with pytest.raises(MachineError, match="cannot open the port"):
            open_link(os.ttyname(slave), RIG)
        os.close(master)
        with pytest.raises(MachineError, match="vanished"):
            link.read_line(2.0)
            link.write(b"?")
    finally:
        link.close()
        os.close(slave)


def test_endless_line_is_cut_off_with_bounded_memory() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:

        def babble() -> None:
            peer, _ = listener.accept()
            with peer:
                try:
                    while True:
                        peer.sendall(b"x" * 4096)
                except OSError:
                    return

        thread = threading.Thread(target=babble)
        thread.start()
        link = open_link(f"socket://127.0.0.1:{listener.getsockname()[1]}", RIG)
        with pytest.raises(MachineError, match="without a line end"):
            link.read_line(5.0)
        link.close()
        thread.join(timeout=10)


def test_socket_has_no_delay() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        link = open_link(f"socket://127.0.0.1:{listener.getsockname()[1]}", RIG)
        assert link._port._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        link.close()


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("", r"no port is named.*socket://HOST:PORT"),
        ("socket://127.0.0.1", r"expected socket://HOST:PORT"),
        ("socket://:3333", r"expected socket://HOST:PORT"),
        ("socket://127.0.0.1:99999", r"expected socket://HOST:PORT"),
        ("/dev/no-such-port", r"^/dev/no-such-port: cannot open the port: No such file or directory: is it"),
        ("/dev/null", r"^/dev/null: cannot open the port: .*: is it plugged in"),
        ("carrier-pigeon://here", r"protocol 'carrier-pigeon' not known"),
    ],
)
def test_ports_that_cannot_be_opened_are_refused_in_words(url: str, words: str) -> None:
    with pytest.raises(MachineError, match=words):
        open_link(url, RIG)


def test_a_port_that_refuses_says_so_once() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"socket://127.0.0.1:{listener.getsockname()[1]}"
    with pytest.raises(MachineError, match=r"^socket://\S+: cannot open the port: Connection refused: is it"):
        open_link(url, RIG)


@pytest.mark.parametrize(
    ("block", "step", "words"),
    [(None, None, "lost"), (4, 0, "lost (block 4, step 0)"), (9, -1, "lost (block 9)")],
)
def test_a_machine_error_names_block_and_step(block: int | None, step: int | None, words: str) -> None:
    assert str(MachineError("lost", block=block, step=step)) == words
