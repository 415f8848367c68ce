"""Gauges: typed, and on a port."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from rigs.errors import JobError, MachineError
from rigs.measuring import SerialGauge, TypedGauge


@pytest.mark.parametrize(
    ("typed", "expected", "angle"),
    [
        ("44.8", 45.0, 44.8),
        ("44,8", -45.0, -44.8),
        ("-3", 45.0, -3.0),
        ("+7.5", -45.0, 7.5),
        (" 90 ", 90.0, 90.0),
    ],
)
def test_typed_angles(typed, expected, angle):
    asked = []

    def ask(question: str) -> str:
        asked.append(question)
        return typed

    assert TypedGauge(ask)(12, expected) == (angle, 0.5)
    assert "crease 12" in asked[0] and f"{expected:.1f}" in asked[0]


def test_nonsense_is_asked_for_again_and_then_refused():
    answers = iter(["", "what?", "45"])
    assert TypedGauge(lambda _: next(answers))(1, 40.0)[0] == 45.0
    with pytest.raises(JobError, match="no angle of crease 1"):
        TypedGauge(lambda _: "200")(1, 40.0)


@contextmanager
def gauge(answer: bytes | None) -> Iterator[tuple[str, list[bytes]]]:
    """A gauge on a socket that answers every question alike; None: it closes."""
    server = socket.create_server(("127.0.0.1", 0))
    seen: list[bytes] = []

    def serve() -> None:
        link, _ = server.accept()
        with link:
            while data := link.recv(64):
                seen.append(data)
                if answer is None:
                    return
                link.sendall(answer)

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield f"socket://127.0.0.1:{server.getsockname()[1]}", seen
    server.close()


@pytest.mark.parametrize(
    ("answer", "reading"),
    [
        (b"44.8 0.2\n", (44.8, 0.2)),
        (b"ANGLE 44.8\r\n", (44.8, 0.3)),
        (b"-12.5 0.1\n", (-12.5, 0.1)),
        (b"4.48e1\n", (44.8, 0.3)),
    ],
)
def test_a_gauge_on_a_port(answer, reading):
    with gauge(answer) as (url, seen):
        there = SerialGauge(url, timeout_s=2.0)
        assert there(7, 45.0) == pytest.approx(reading)
        assert b"".join(seen) == b"M7\n"
        there.close()


def test_the_sign_of_the_fold_is_given_to_a_gauge_without_one():
    with gauge(b"30\n") as (url, _):
        there = SerialGauge(url, timeout_s=2.0)
        assert there(7, -45.0)[0] == -30.0
        there.close()


@pytest.mark.parametrize("answer", [b"hello\n", b"999 1\n", b"\xff\xfe\n", b"x" * 300])
def test_answers_that_are_no_angle(answer):
    with gauge(answer) as (url, _):
        there = SerialGauge(url, timeout_s=0.5)
        with pytest.raises(JobError, match="expected degrees"):
            there(7, 45.0)
        there.close()


def test_a_gauge_that_is_not_there_or_vanishes():
    with pytest.raises(MachineError, match="cannot open the gauge"):
        SerialGauge("socket://127.0.0.1:1")
    with gauge(None) as (url, _):
        there = SerialGauge(url, timeout_s=1.0)
        with pytest.raises((MachineError, JobError)):
            there(7, 45.0)
            there(7, 45.0)
