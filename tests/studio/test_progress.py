"""Progress says what runs; piped it is plain, quiet it is silent."""

from __future__ import annotations

import io

import pytest

from studio.progress import Progress, duration_text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0.0 s"), (9.94, "9.9 s"), (9.96, "10 s"), (59.4, "59 s"), (59.6, "1 min 00 s"),
        (3599.4, "59 min 59 s"), (7440, "2 h 04 min"), (86_400 * 3, "72 h 00 min"),
    ],
)  # fmt: skip
def test_durations_as_people_say_them(seconds, text):
    assert duration_text(seconds) == text


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_piped_output_is_plain_lines():
    stream = io.StringIO()
    progress = Progress(stream=stream)
    with progress.stage("plan", "planning the folds"):
        progress.update(0.5, "net 3")
        progress.note("first run: compiling")
    lines = stream.getvalue().splitlines()
    assert lines[0] == "first run: compiling"
    assert lines[-1].startswith("plan     planning the folds: ")
    assert "\x1b" not in stream.getvalue()
    assert progress.seconds["plan"] >= 0.0


def test_piped_updates_come_now_and_then_with_an_estimate(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("studio.progress.time.monotonic", lambda: now[0])
    stream = io.StringIO()
    progress = Progress(stream=stream)
    with progress.stage("replay", "sending"):
        for second in range(1, 21):
            now[0] = float(second)
            progress.update(second / 20, f"block {second}")
    lines = stream.getvalue().splitlines()
    assert lines == [
        "replay    25 % block 5, about 15 s left",
        "replay    50 % block 10, about 10 s left",
        "replay    75 % block 15, about 5.0 s left",
        "replay   100 % block 20",
        "replay   sending: 20 s",
    ]


def test_a_terminal_gets_a_live_line():
    stream = Terminal()
    progress = Progress(stream=stream)
    with progress.stage("plan", "planning the folds"):
        progress.update(0.5, "net 3")
        progress.note("compiling [once]")
    assert "\x1b" in stream.getvalue()
    assert "compiling [once]" in stream.getvalue()


def test_quiet_says_nothing_but_keeps_the_times():
    stream = Terminal()
    progress = Progress(quiet=True, stream=stream)
    with progress.stage("plan", "planning"):
        progress.update(0.5)
        progress.note("hush")
    assert stream.getvalue() == ""
    assert set(progress.seconds) == {"plan"}


def test_a_stage_that_fails_leaves_the_terminal_in_order():
    stream = Terminal()
    progress = Progress(stream=stream)
    with pytest.raises(KeyboardInterrupt), progress.stage("plan", "planning"):
        raise KeyboardInterrupt
    assert stream.getvalue().endswith("\x1b[?25h") or "\x1b[?25h" in stream.getvalue()


def test_details_are_for_those_who_ask():
    for options, shown in (({}, False), ({"verbose": True}, True), ({"verbose": True, "quiet": True}, False)):
        stream = io.StringIO()
        Progress(stream=stream, **options).detail("plan.json: 12 bytes")
        assert ("plan.json" in stream.getvalue()) == shown
