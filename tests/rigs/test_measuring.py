"""Gauges: typed, and on a port."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigs.errors import JobError, MachineError
from rigs.gauge_words import read_angle
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
        (b"\r\n A: 44,8 deg\r\n", (44.8, 0.3)),
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


@pytest.mark.parametrize(
    "answer", [b"hello\n", b"999 1\n", b"\xff\xfe\n", b"x" * 300, b"44.8 mm\n", b"Err 12\n", b""]
)
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


@pytest.mark.parametrize(
    ("line", "reading"),
    [
        (b"44.8", (44.8, None)), (b"+44,85 deg", (44.85, None)), (b"A=-12.5\xc2\xb0", (-12.5, None)),
        (b"ANGLE 44.8 0.2", (44.8, 0.2)), (b"44.8,0.2", (44.8, 0.2)), (b"44,8; 0,2", (44.8, 0.2)),
        (b"0.7854 rad", (45.0, None)), (b"785.4 mrad 1.745 mrad", (45.0, 0.1)),
        (b"44\xc2\xb051'", (44.85, None)),
        (b"-44d 51m 18s", (-44.855, None)), (b".5", (0.5, None)), (b"180", (180.0, None)),
        (b"44.8 -3", (44.8, None)),
        ("−7.5°".encode(), (-7.5, None)),
        (b"", None), (b"----", None), (b"OL", None), (b"12.5 mm", None), (b"180.1", None), (b"nan", None),
        (b"1e9", None), (b"44\xc2\xb075'", None), (b"Low Bat 44.8", None), (b"X7", None), (b"1" * 90, None),
    ],
)  # fmt: skip
def test_what_a_gauge_prints(line, reading):
    got = read_angle(line)
    if reading is None:
        assert got is None
    else:
        assert got is not None and got[0] == pytest.approx(reading[0], abs=2e-3)
        assert (got[1] is None) == (reading[1] is None)
        assert reading[1] is None or got[1] == pytest.approx(reading[1], rel=1e-3)


@given(st.binary(max_size=100))
def test_whatever_the_bytes_are_they_are_an_angle_or_none(line):
    got = read_angle(line)
    assert got is None or (abs(got[0]) <= 180.0 and (got[1] is None or 0.0 < got[1] <= 90.0 * 57.3))


@contextmanager
def stream(lines: list[bytes]) -> Iterator[str]:
    """A gauge that prints by itself, from the middle of a line on."""
    server = socket.create_server(("127.0.0.1", 0))
    over = threading.Event()

    def serve() -> None:
        link, _ = server.accept()
        with link:
            number = 0
            while not over.wait(0.01):
                try:
                    link.sendall(lines[number % len(lines)])
                except OSError:
                    return
                number += 1

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    yield f"socket://127.0.0.1:{server.getsockname()[1]}"
    over.set()
    thread.join(5.0)
    server.close()


def test_a_gauge_that_streams_never_gives_a_cut_line():
    with stream([b"4.8 deg\r\n 4", b"4.9 deg\r\n 4"]) as url:
        there = SerialGauge(url, timeout_s=5.0, streams=True)
        for _ in range(5):
            angle, sigma = there(7, -45.0)
            assert -45.0 < angle < -44.7 and sigma == pytest.approx(0.3)
        there.close()


def test_a_gauge_that_does_not_rest_or_prints_nothing_useful():
    with stream([b"40.0\n", b"44.0\n"]) as url:
        there = SerialGauge(url, timeout_s=5.0, streams=True)
        with pytest.raises(JobError, match=r"40.0° to 44.0° for crease 7: wait until it rests"):
            there(7, 45.0)
        there.close()
    with stream([b"----\n"]) as url:
        there = SerialGauge(url, timeout_s=0.5, streams=True)
        with pytest.raises(JobError, match="expected degrees"):
            there(7, 45.0)
        there.close()
