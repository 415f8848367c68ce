"""The summary as table, plain lines and JSON."""

from __future__ import annotations

import io
import json

import pytest

from studio.summary import print_summary
from tests.studio.report_page import small_summary
from tests.studio.test_progress import Terminal


def test_plain_text(snapshot):
    stream = io.StringIO()
    print_summary(
        small_summary(bundle="out/pyramid", without=("sight",), replay="arm on EMULATED"), stream=stream
    )
    assert stream.getvalue() == snapshot


def test_what_is_not_known_is_left_out(snapshot):
    stream = io.StringIO()
    empty = small_summary(
        planned=False, passes=None, seconds=None, energy_j=None, blocked=(), notices=(),
        verdict="not validated",
        optimal=False, lower_bound=2, edits=3,
    )  # fmt: skip
    print_summary(empty, stream=stream)
    assert stream.getvalue() == snapshot


@pytest.mark.parametrize(
    ("verdict", "process", "words"),
    [
        ("pass", "", "pass"),
        ("pass", "uncalibrated", "pass: geometry passes, process uncalibrated"),
        ("pass", "calibrated", "pass: geometry passes, process calibrated"),
        ("contact", "uncalibrated", "contact"),
    ],
)
def test_a_pass_says_what_is_known_of_the_process(verdict, process, words):
    summary = small_summary(verdict=verdict, process=process)
    assert dict(summary.rows())["verdict"] == summary.verdict_words() == words
    assert summary.to_values()["verdict"] == verdict and summary.to_values()["process"] == process


def test_many_blocked_creases_are_cut_short():
    stream = io.StringIO()
    blocked = small_summary().blocked * 20
    print_summary(small_summary(blocked=blocked), stream=stream)
    lines = [line for line in stream.getvalue().splitlines() if line.startswith("blocked:")]
    assert len(lines) == 9
    assert lines[-1] == "blocked: and 12 more, see report.html"


def test_json_is_one_object_with_everything():
    stream = io.StringIO()
    summary = small_summary(bundle="out")
    print_summary(summary, as_json=True, stream=stream)
    assert stream.getvalue().count("\n") == 1
    values = json.loads(stream.getvalue())
    assert values["completion"] == 0.9
    assert values["verdict"] == "pass"
    assert values["blocked"][0] == {
        "crease": 1, "reached_deg": -77.883, "wanted_deg": -129.806, "by": "collision", "with": [2, 4],
        "at_deg": -79.181, "text": summary.blocked[0]["text"],
    }  # fmt: skip


def test_a_terminal_gets_a_table():
    stream = Terminal()
    print_summary(small_summary(), stream=stream)
    text = stream.getvalue()
    assert "\x1b" in text
    assert "90.0 %" in text
    assert "blocked: crease 1 stops at -77.9° of -129.8°" in text


def test_a_verdict_of_no_says_why():
    stream = io.StringIO()
    print_summary(small_summary(verdict="contact", reason="step 3: contact, faces 1, 2"), stream=stream)
    assert "verdict      contact\nbecause      step 3: contact, faces 1, 2\n" in stream.getvalue()


def test_headline():
    assert small_summary().headline() == (
        "6 faces, folded 90.0 %, 1 crease blocked by collision, 0.1 mm 304 on grbl-4axis"
    )


@pytest.mark.parametrize(
    ("edits", "bound", "seconds", "words"),
    [
        (0, 0, None, "proven: no edit from the bfs tree of base face 7 is needed"),
        (3, 3, 0.4, "proven (0.4 s): no net from the bfs tree of base face 7 has fewer than 3 edits"),
        (
            1, 0, 2.0,
            "not proven fewest (2.0 s): 1 edit from the bfs tree of base face 7, at least 0 needed, gap 1",
        ),
        (
            9, 6, 30.2,
            "not proven fewest (30 s): 9 edits from the bfs tree of base face 7, at least 6 needed, gap 3; "
            "time was up, more may help: --prove 120",
        ),
    ],
)  # fmt: skip
def test_the_proof_in_words(edits, bound, seconds, words):
    summary = small_summary(
        edits=edits, lower_bound=bound, optimal=edits == bound, tree="bfs", base_face=7, proof_s=seconds
    )
    assert summary.proof(30.0) == words


def test_the_next_best_bases_are_told():
    stream = io.StringIO()
    bases = tuple({"face": face, "edits": edits} for face, edits in ((7, 2), (3, 1), (1, 4), (0, -1), (5, 9)))
    print_summary(small_summary(bases=bases, base_face=7), stream=stream)
    assert "base         face 7; next best 3 (1 edit), 1 (4 edits), 0 (no net found)\n" in stream.getvalue()


def test_missing_faces_are_told_first():
    stream = io.StringIO()
    summary = small_summary(faces_left_out=2)
    print_summary(summary, stream=stream)
    assert "left out     2 of 8 faces\n" in stream.getvalue()
    assert summary.headline().startswith("2 faces left out, 6 faces, folded")


@pytest.mark.parametrize(
    ("pieces", "words"), [(0, "nothing of the sheet"), (1, "1 piece of the sheet"), (2, "2 pieces of")]
)
def test_clipped_pieces_are_counted_in_words(pieces, words):
    assert dict(small_summary(clipped_faces=3 * pieces, clipped_pieces=pieces).rows())["clipped"].startswith(
        words
    )
