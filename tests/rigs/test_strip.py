"""Where the pieces of a test strip stand."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigs.errors import JobError
from rigs.rig import load_rig
from rigs.strip import GAP_MM, Strip, lay_out

RIG = load_rig("grbl-4axis")


def box(strip: Strip, index: int) -> tuple[float, float, float, float]:
    xs, ys = zip(*strip.slit(strip.pieces[index]), strict=True)
    return min(xs), min(ys), max(xs), max(ys)


@given(st.sampled_from(["fold", "kerf"]), st.integers(1, 150), st.floats(2.0, 15.0), st.floats(2.0, 15.0))
@settings(max_examples=60, deadline=None)
def test_pieces_keep_apart_and_on_the_metal(kind, count, width, length):
    try:
        strip = lay_out(kind, [(9.0, 100.0, 1)] * count, RIG, width_mm=width, length_mm=length)
    except JobError:
        assert count * (width + GAP_MM) * (length + GAP_MM + 1.0) > 0.5 * 350.0 * 250.0
        return
    boxes = [box(strip, n) for n in range(count)]
    wide, deep = strip.size_mm
    for left, low, right, top in boxes:
        assert -0.5 * wide + GAP_MM <= left and right <= 0.5 * wide - GAP_MM
        assert -0.5 * deep + GAP_MM <= low and top <= 0.5 * deep - GAP_MM
    for a, b in itertools.combinations(boxes, 2):
        apart = max(b[0] - a[2], a[0] - b[2], b[1] - a[3], a[1] - b[3])
        assert apart >= GAP_MM - 1e-9
    assert wide + 2.0 * RIG.sheet.frame_margin_mm <= RIG.sheet.max_mm[0] + 1e-9
    assert deep + 2.0 * RIG.sheet.frame_margin_mm <= RIG.sheet.max_mm[1] + 1e-9
    (x, low), (same, high) = strip.mark
    assert x == same and -0.5 * wide < x < boxes[0][0] and low < high


def test_numbers_run_to_the_right_and_then_up():
    strip = lay_out("fold", [(5.0, 100.0, n) for n in range(1, 13)], RIG, width_mm=8.0, length_mm=8.0)
    assert [piece.number for piece in strip.pieces] == [piece.passes for piece in strip.pieces]
    places = [(piece.y_mm, piece.x_mm) for piece in strip.pieces]
    assert places == sorted(places)


def test_a_finger_hangs_on_its_crease_and_a_window_is_closed():
    fold, kerf = (
        lay_out(kind, [(5.0, 100.0, 1)], RIG, width_mm=8.0, length_mm=6.0) for kind in ("fold", "kerf")
    )
    slit, (a, b) = fold.slit(fold.pieces[0]), fold.crease(fold.pieces[0])
    assert slit[0] == (a[0], a[1] - 1.0) and slit[-1] == (b[0], b[1] - 1.0)
    assert slit[1] == (a[0], a[1] + 6.0) and b[0] - a[0] == 8.0
    window = kerf.slit(kerf.pieces[0])
    assert window[0] == window[-1] and len(set(window)) == 4


@pytest.mark.parametrize(
    ("count", "width", "length", "word"),
    [(0, 8.0, 8.0, "at least one"), (5000, 8.0, 8.0, "do not fit"), (1, 0.5, 8.0, "width"),
     (1, 8.0, float("nan"), "length"), (1, 500.0, 8.0, "takes 0")],
)  # fmt: skip
def test_what_does_not_fit_is_refused(count, width, length, word):
    with pytest.raises(JobError, match=word):
        lay_out("fold", [(9.0, 100.0, 1)] * count, RIG, width_mm=width, length_mm=length)
